// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tolerances.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace btgpu {

const std::vector<Tolerance>& tolerances() {
  static const std::vector<Tolerance> table = {
      {"device.missing_steps", 0, "steps that did not run on the device", "stock would be compared with stock"},
      {"device.fallbacks", 0, "entries of the fallback report that the scene does not declare",
       "nothing may run elsewhere unseen"},
      {"state.not_finite", 0, "bodies with NaN or infinity at the end", "there is no right NaN"},

      {"contact.missing_pairs", 1e-4,
       "share of pairs that penetrate by more than 1e-4 of their size in one world and have no contact in the other",
       "same state and cache; where an edge and a face tie within rounding, Bullet's clipper may find no corner"},
      {"contact.depth", 1e-3, "share of pairs whose deepest points differ by more than 2e-4 of their size",
       "two axes of nearly equal depth may be taken in either order, and then the clipped corners differ; where "
       "Bullet's "
       "GJK ends beside the closest features, or its manifold has lost a point, the check knows it"},
      {"contact.normal", 1e-2, "share of pairs whose deepest points' normals differ by more than 2.5 degrees",
       "the same ties"},

      {"solver.free_velocity", 2e-5, "largest velocity difference of a body without contact, relative to 1 + speed",
       "float: damping, gravity and gyroscopic term, about 20 operations of 6e-8 each relative to the speed"},
      {"solver.single_velocity", 1e-3,
       "share of bodies with a single manifold, to a fixed body, whose velocity differs by more than 1e-4 of 1 + speed",
       "same rows in the same order: rounding of 120 row updates times the lever arm over the smallest edge, 1e-5 "
       "measured; "
       "only where the slip is within rounding of Bullet's threshold for its direction may the direction differ"},
      {"solver.residual", 1.05, "rms of the contact rows' velocity errors after the solve, ours over stock's",
       "both stop after the same iterations; times what reversing the order of its rows does to stock's own residual"},
      {"solver.distance_to_converged", 1.1,
       "distance of the velocities from stock's with 1,000 iterations, ours over stock's",
       "no further from the solution than stock; times what reversing the order of its rows does to stock's own "
       "distance"},
      {"splitting.residual", 1.05,
       "Solver mass_splitting only: as solver.residual, but with 2 n times the iterations, n the most copies of a body",
       "Jacobi's error shrinks half as much in an iteration as that of Gauss-Seidel, and by an n-th of that with "
       "masses "
       "split n times"},
      {"splitting.distance_to_converged", 1.1, "as solver.distance_to_converged, likewise", "likewise"},
      {"solver.energy", 0.01,
       "kinetic energy that the solver adds to what went in, beyond what stock's adds, over what went in; sums over "
       "all steps",
       "energy may only come from pushing penetrations apart, which both do by the same rule"},
      {"integrate.pose", 2e-5,
       "largest pose difference of a body without contact after the step, relative to its size and distance",
       "float: one multiply-add and one quaternion product"},
      {"integrate.not_finite", 0, "a body that came out of a step with NaN or infinity where stock's is finite",
       "there is no right NaN"},
      {"sleep.state", 0.005,
       "share of bodies and steps whose activation state differs from stock's after the step, with velocities on the "
       "same side of the sleeping thresholds",
       "the timers are the same; the velocities have checks of their own"},

      {"free.position", 0.02, "largest position difference while positions are comparable, relative to the body's size",
       "two right solvers drift apart by their residual; the scene says for how many steps"},
      {"free.height", 0.005, "mean height at the end: distance from stock's range, over stock's height",
       "the packing is the same within the solvers' penetration; piles are chaotic, see stock's range in "
       "docs/compare.md"},
      {"free.kinetic_energy", 1.1,
       "mean kinetic energy over the last 60 steps, over the highest of stock's runs plus 1e-4 J a body / 1.1",
       "no jitter beyond stock's own"},
      {"free.penetration", 1.2,
       "99th percentile of the penetration over the last 60 steps, over the highest of stock's runs (at least 1e-3 of "
       "the size)",
       "as stiff as stock within the spread between row orders"},
      {"free.below_ground", 0, "bodies below the ground at the end", "nothing may be lost"},
      {"free.momentum", 0.02, "momentum at the end of a scene without fixed contacts, difference over the sum of sizes",
       "conserved by pairs of equal and opposite impulses; float sums"},
  };
  return table;
}

const Tolerance& tolerance(const std::string& name) {
  for (const Tolerance& t : tolerances()) {
    if (name == t.name) return t;
  }
  throw std::logic_error("no tolerance named " + name);
}

void liftLimitsOfIterations(std::vector<Check>& checks) {
  const char* const ofIterations[] = {"solver.residual", "solver.distance_to_converged", "free.position",
                                      "free.height",     "free.kinetic_energy",          "free.penetration"};
  for (Check& check : checks) {
    const bool listed =
        std::find(std::begin(ofIterations), std::end(ofIterations), check.name) != std::end(ofIterations);
    if (listed && !std::isnan(check.value)) check.limit = HUGE_VAL;
  }
}

}  // namespace btgpu
