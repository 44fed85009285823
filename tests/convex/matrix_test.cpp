// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Each kind of convex shape against each other (and a plane) in random poses: deep, touching, apart, face on face, edge
// on edge, vertex on face, one far larger. Held against Bullet's own algorithm for the pair, run once on a new
// manifold: whether there is a contact, the deepest point's normal and its depth.
//
// A pose is ambiguous, and only then left out, when Bullet's own normal turns by more than 2 degrees under one of eight
// jitters of 1e-4 of the pose: at most 10 % of a pair's. Bullet's GJK and EPA have limits in lengths and volumes and end
// early on curved shapes of a metre: where theirs is another contact, ours is right if they find it with the same shapes
// 64 times as large ("finely"). Exceptions ("better"), at most 1 % of all poses, are those in which they don't and
// Bullet's own support functions say that the axis which ours found is the better one: along it the shapes are farther
// apart, or overlap less, than along Bullet's; and two hulls with features, see isClippedAside().
// BTGPU_TEST_POSES: poses a pair, 200 unless told otherwise.
#include <BulletCollision/NarrowPhaseCollision/btSubSimplexConvexCast.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>

#include "tests/convex/shape_kinds.h"
#include "tests/support/test_world.h"
#include "translation/oracle/found_contacts.h"

namespace btgpu::test {
namespace {

constexpr double kJitter = 1e-4;
constexpr btScalar kApart = btScalar(0.1);  // at first, before one is moved to the other
constexpr double kDegree = 3.14159265358979 / 180;
constexpr double kTurn = 2 * kDegree;  // of the issue: more is another normal, of ours or of Bullet's under a jitter
constexpr double kFloat = 5e-5;        // poses are floats of some 100
constexpr double kShare = 0.01;        // of the smaller size or the margin, for depths

int posesAPair() {
  const char* text = std::getenv("BTGPU_TEST_POSES");
  return text ? std::atoi(text) : 200;
}

struct Deepest {
  btVector3 normal{0, 0, 0};  // on the second object
  double distance = 1e30;
};

std::optional<Deepest> deepestOf(const btPersistentManifold& m, const btCollisionObject* first) {
  std::optional<Deepest> found;
  for (int k = 0; k < m.getNumContacts(); ++k) {
    const btManifoldPoint& p = m.getContactPoint(k);
    if (found && double(p.getDistance()) >= found->distance) continue;
    found = Deepest{m.getBody0() == first ? p.m_normalWorldOnB : -p.m_normalWorldOnB, double(p.getDistance())};
  }
  return found;
}

// Bullet's algorithm for two objects.
class Oracle {
 public:
  Oracle() : m_dispatcher(&m_configuration) {}
  std::optional<Deepest> collide(const btCollisionObject& a, const btCollisionObject& b) {
    const btCollisionObjectWrapper wrapA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
    btCollisionAlgorithm* algorithm = m_dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    btManifoldResult result(&wrapA, &wrapB);
    algorithm->processCollision(&wrapA, &wrapB, m_info, &result);
    btManifoldArray manifolds;
    algorithm->getAllContactManifolds(manifolds);
    std::optional<Deepest> found;
    for (int i = 0; i < manifolds.size(); ++i) found = deepestOf(*manifolds[i], &a);
    algorithm->~btCollisionAlgorithm();
    m_dispatcher.freeCollisionAlgorithm(algorithm);
    return found;
  }

 private:
  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher;
  btDispatcherInfo m_info;
};

btQuaternion anyTurn(RandomSource& random) {
  btQuaternion q(scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1));
  return q.length2() > btScalar(1e-3) ? q.normalized() : btQuaternion::getIdentity();
}
btVector3 anyDirection(RandomSource& random) {
  const btVector3 v(scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1));
  return v.length() > btScalar(0.1) ? v.normalized() : btVector3(0, 1, 0);
}
// By quarters of a turn about the axes, so that faces look along them.
btQuaternion quarterTurns(RandomSource& random) {
  const btScalar quarter = SIMD_HALF_PI;
  return btQuaternion(btVector3(1, 0, 0), quarter * btScalar(random() % 4)) *
         btQuaternion(btVector3(0, 0, 1), quarter * btScalar(random() % 4));
}

enum class Pose { Deep, Touching, Apart, Faces, Edges, VertexOnFace, FarLarger };
constexpr std::array kPoses = {Pose::Deep,  Pose::Touching,     Pose::Apart,    Pose::Faces,
                               Pose::Edges, Pose::VertexOnFace, Pose::FarLarger};

// Farthest point along a direction in the world, with the margin.
btScalar reachOf(const btCollisionShape& shape, const btMatrix3x3& turn, const btVector3& direction) {
  const auto& convex = static_cast<const btConvexShape&>(shape);
  const btVector3 local = direction * turn;
  return convex.localGetSupportingVertex(local).dot(local);
}

// How far b can go against the direction until it touches a, by Bullet's own cast; nothing if it passes by.
btScalar wayTo(const btConvexShape& a, const btTransform& atA, const btConvexShape& b, const btTransform& atB,
               const btVector3& direction) {
  const btScalar way = a.getMargin() + b.getMargin() + 100;
  btVoronoiSimplexSolver simplex;
  btSubsimplexConvexCast cast(&a, &b, &simplex);
  btConvexCast::CastResult result;
  const btTransform toB(atB.getRotation(), atB.getOrigin() - direction * way);
  return cast.calcTimeOfImpact(atA, atA, atB, toB, result) ? result.m_fraction * way : btScalar(0);
}

double sizeOf(const btCollisionShape& shape) {
  btVector3 centre;
  btScalar radius;
  shape.getBoundingSphere(centre, radius);
  return double(radius);
}

struct Case {
  btCollisionObject* a;
  btCollisionObject* b;
  Pose pose;
  double smaller;  // size of the smaller shape
  double margin;   // of the two, the larger one
};

struct Tally {
  int poses = 0, ambiguous = 0, finely = 0, exceptions = 0, touching = 0, wrongExistence = 0, wrongNormal = 0,
      wrongDepth = 0;
  double worstTurn = 0, worstDepth = 0;

  void add(const Tally& t) {
    poses += t.poses;
    ambiguous += t.ambiguous;
    finely += t.finely;
    exceptions += t.exceptions;
    touching += t.touching;
    wrongExistence += t.wrongExistence;
    wrongNormal += t.wrongNormal;
    wrongDepth += t.wrongDepth;
  }
};

class Matrix {
 public:
  explicit Matrix(unsigned seed) : m_random(seed) { w.world.setGravity(btVector3(0, 0, 0)); }

  // One pair of shapes in every kind of pose, each pair at a place of its own.
  void add(const ShapeKind& first, const ShapeKind* second, int count) {
    const int side = static_cast<int>(std::ceil(std::cbrt(double(count))));
    for (int n = 0; n < count; ++n) {
      const Pose pose = kPoses[static_cast<size_t>(n) % kPoses.size()];
      const btVector3 place(btScalar(n % side), btScalar(n / side % side), btScalar(n / side / side));
      addPair(first, second, pose, place * btScalar(30));
    }
  }

  Tally run() {
    w.run(1);
    expectAllOnDevice(w.world);
    std::map<std::pair<const void*, const void*>, const btPersistentManifold*> manifolds;
    for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold* m = w.dispatcher.getManifoldByIndexInternal(i);
      manifolds[{m->getBody0(), m->getBody1()}] = manifolds[{m->getBody1(), m->getBody0()}] = m;
    }
    Tally tally;
    for (size_t i = 0; i < m_cases.size(); ++i) {
      const Case& c = m_cases[i];
      const auto found = manifolds.find({c.a, c.b});
      const auto ours = found == manifolds.end() ? std::nullopt : deepestOf(*found->second, c.a);
      c.a->setWorldTransform(m_poses[i].first);  // the step has moved them
      compare(c, ours, tally);
    }
    return tally;
  }

 private:
  // Two of Bullet's 2D shapes collide as seen along z.
  static bool isFlat(const btCollisionShape& shape) { return shape.isConvex2d(); }

  void addPair(const ShapeKind& first, const ShapeKind* second, Pose pose, const btVector3& place) {
    const bool far = pose == Pose::FarLarger;
    btCollisionShape* a = first.make(m_store, m_random, far ? 0.3 : 1);
    btCollisionShape* b = second ? second->make(m_store, m_random, far ? 6 : 1)
                                 : m_store.make<btStaticPlaneShape>(anyDirection(m_random), btScalar(0));
    btTransform atA(anyTurn(m_random)), atB(anyTurn(m_random));
    btVector3 direction = anyDirection(m_random);
    const btQuaternion eighth(btVector3(1, 0, 0), SIMD_HALF_PI / 2), other(btVector3(0, 0, 1), SIMD_HALF_PI / 2);
    if (pose == Pose::Faces || pose == Pose::Edges || pose == Pose::VertexOnFace) {
      atA.setRotation(quarterTurns(m_random));
      atB.setRotation(quarterTurns(m_random));
      direction = btVector3(0, 1, 0);
    }
    if (pose == Pose::Edges) {
      atA.setRotation(eighth * atA.getRotation());
      atB.setRotation(other * atB.getRotation());
    }
    if (pose == Pose::VertexOnFace) {
      atA.setRotation(btQuaternion(btVector3(1, 0, -1).normalized(), btScalar(0.9553)) * atA.getRotation());
    }
    if (second && isFlat(*a) && isFlat(*b)) {
      direction = btVector3(direction.x(), direction.y(), 0);
      direction = direction.length() > btScalar(0.1) ? direction.normalized() : btVector3(0, 1, 0);
      for (btTransform* t : {&atA, &atB}) {
        const btScalar turn =
            pose == Pose::Faces ? SIMD_HALF_PI * btScalar(m_random() % 4) : scalarIn(m_random, 0, 6.28);
        t->setRotation(btQuaternion(btVector3(0, 0, 1), turn));
      }
    }
    const double smaller = second ? std::min(sizeOf(*a), sizeOf(*b)) : sizeOf(*a);
    const double margin = double(btMax(a->getMargin(), second ? b->getMargin() : btScalar(0)));
    double gap = uniformIn(m_random, -0.02, 0.01);
    if (pose == Pose::Deep) gap = uniformIn(m_random, -0.6, -0.1) * smaller;
    if (pose == Pose::Apart) gap = uniformIn(m_random, 0.01, 0.3);
    if (second) {
      const btScalar reach = reachOf(*a, atA.getBasis(), direction) + reachOf(*b, atB.getBasis(), -direction);
      const btVector3 aside =
          pose == Pose::Faces || far ? anyDirection(m_random) * btScalar(0.2 * smaller) : btVector3(0, 0, 0);
      btVector3 shift = aside - direction * aside.dot(direction);
      if (isFlat(*a) && isFlat(*b)) shift.setZ(0);
      // Where they are sure to be apart, and as far on as they can go.
      atA.setOrigin(place);
      atB.setOrigin(place + direction * (reach + kApart) + shift);
      const btScalar way = wayTo(static_cast<btConvexShape&>(*a), atA, static_cast<btConvexShape&>(*b), atB, direction);
      atB.setOrigin(atB.getOrigin() + direction * (btScalar(gap) - way));
    } else {
      // A plane has no bounds and meets every body: filters keep it to its own.
      atB.setIdentity();
      const btVector3 normal = static_cast<btStaticPlaneShape*>(b)->getPlaneNormal();
      atB.setOrigin(place);
      atA.setOrigin(place + normal * (reachOf(*a, atA.getBasis(), -normal) + btScalar(gap)));
    }
    btRigidBody* bodyA = w.objects.add(1, a, atA);
    btRigidBody* bodyB = w.objects.add(0, b, atB);
    bodyA->setSleepingThresholds(0, 0);
    m_cases.push_back({bodyA, bodyB, pose, smaller, margin});
    m_poses.push_back({atA, atB});
    for (size_t i = 0; !second && i + 1 < m_cases.size(); ++i) {
      m_cases[i].a->setIgnoreCollisionCheck(bodyB, true);
      bodyA->setIgnoreCollisionCheck(m_cases[i].b, true);
    }
  }

  // The most that Bullet's own normal turns under eight jitters; nothing if it loses or gains the contact.
  bool isAmbiguous(const Case& c, const std::optional<Deepest>& stock) {
    const btTransform before = c.a->getWorldTransform();
    bool ambiguous = false;
    for (int k = 0; k < 8 && !ambiguous; ++k) {
      btTransform t = before;
      t.getOrigin() += btVector3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1) * btScalar(kJitter / std::sqrt(3.0));
      const btVector3 about(k & 2 ? 1 : -1, k & 4 ? 1 : -1, k & 1 ? 1 : -1);
      t.setRotation(btQuaternion(about.normalized(), btScalar(kJitter)) * before.getRotation());
      c.a->setWorldTransform(t);
      const auto other = m_oracle.collide(*c.a, *c.b);
      if (stock && other) ambiguous = angle(stock->normal, other->normal) > kTurn;
    }
    c.a->setWorldTransform(before);
    return ambiguous;
  }
  static double angle(const btVector3& a, const btVector3& b) {
    return std::atan2(double(a.cross(b).length()), double(a.dot(b)));
  }

  // How far apart two shapes are along an axis from the second to the first, by Bullet's own support functions.
  static double gapAlong(const Case& c, const btVector3& normal) {
    const auto farthest = [](const btCollisionObject& object, const btVector3& direction) {
      const auto& shape = static_cast<const btConvexShape&>(*object.getCollisionShape());
      const btVector3 local = direction * object.getWorldTransform().getBasis();
      const btVector3 p = object.getWorldTransform()(shape.localGetSupportingVertexWithoutMargin(local));
      return double(p.x()) * double(direction.x()) + double(p.y()) * double(direction.y()) +
             double(p.z()) * double(direction.z()) + double(shape.getMargin());
    };
    return -farthest(*c.a, -normal) - farthest(*c.b, normal);
  }
  bool isOursBetter(const Case& c, const Deepest& ours, const Deepest& stock) const {
    return c.b->getCollisionShape()->isConvex() && gapAlong(c, ours.normal) > gapAlong(c, stock.normal) + kFloat;
  }

  // Two such collide without their margins, and with a quirk of their own: btPolyhedralContactClipping tells how deep a
  // corner lies behind the face that it clipped, as far as that may be from along the axis that it found, and calls
  // that axis the normal. Ours is right if it is as deep as the shapes overlap along that same axis.
  static bool isClippedAside(const Case& c, const Deepest& ours, double turn) {
    const auto isFeatured = [](const btCollisionShape* shape) {
      return shape->isPolyhedral() && static_cast<const btPolyhedralConvexShape*>(shape)->getConvexPolyhedron();
    };
    if (!isFeatured(c.a->getCollisionShape()) || !isFeatured(c.b->getCollisionShape()) || turn > kTurn) return false;
    const double margins =
        double(c.a->getCollisionShape()->getMargin()) + double(c.b->getCollisionShape()->getMargin());
    return std::fabs(gapAlong(c, ours.normal) + margins - ours.distance) < kFloat;
  }
  // Bullet's own GJK and EPA agree with ours where the shapes are so large that they do not end early.
  static bool isBulletsFinely(const Case& c, const Deepest& ours, double allowed) {
    if (!c.b->getCollisionShape()->isConvex()) return false;
    const auto placed = [](const btCollisionObject& o) {
      return PlacedShape{static_cast<const btConvexShape*>(o.getCollisionShape()), o.getWorldTransform()};
    };
    FoundContact fine;
    return contactFoundFinely(placed(*c.a), placed(*c.b), fine) && angle(ours.normal, fine.normal) <= kTurn &&
           std::fabs(ours.distance - fine.distance) <= allowed;
  }

  void compare(const Case& c, const std::optional<Deepest>& ours, Tally& tally) {
    ++tally.poses;
    const auto stock = m_oracle.collide(*c.a, *c.b);
    const double allowed = kShare * std::max(c.smaller, c.margin);
    if (isAmbiguous(c, stock)) {
      ++tally.ambiguous;
      return;
    }
    const bool verbose = std::getenv("BTGPU_TEST_VERBOSE") != nullptr;
    if (!ours && !stock) return;
    if (!ours || !stock) {
      // Whether a contact arises is decided at the breaking threshold, above zero.
      const double distance = ours ? ours->distance : stock->distance;
      if (distance > -allowed && distance > 0) return;
      ++tally.wrongExistence;
      if (verbose)
        std::printf("    pose %d: %s alone, %.6f\n", static_cast<int>(c.pose), ours ? "ours" : "stock's", distance);
      return;
    }
    ++tally.touching;
    const double turn = angle(ours->normal, stock->normal);
    const double depth = std::fabs(ours->distance - stock->distance);
    if ((turn > kTurn || depth > allowed) && isBulletsFinely(c, *ours, allowed)) {
      ++tally.finely;
      return;
    }
    if ((turn > kTurn || depth > allowed) && (isOursBetter(c, *ours, *stock) || isClippedAside(c, *ours, turn))) {
      ++tally.exceptions;
      if (verbose)
        std::printf("    better, pose %d: turned %.2f degrees, %.6f (%.6f), stock's %.6f (%.6f), allowed %.6f\n",
                    static_cast<int>(c.pose), turn / kDegree, ours->distance, gapAlong(c, ours->normal),
                    stock->distance, gapAlong(c, stock->normal), allowed);
      return;
    }
    tally.worstTurn = std::max(tally.worstTurn, turn);
    tally.worstDepth = std::max(tally.worstDepth, depth / c.smaller);
    tally.wrongNormal += turn > kTurn;
    tally.wrongDepth += depth > allowed;
    if (verbose && (turn > kTurn || depth > allowed)) {
      std::printf("    pose %d: turned %.2f degrees, depth %.6f (%.6f), stock's %.6f (%.6f), allowed %.6f\n",
                  static_cast<int>(c.pose), turn / kDegree, ours->distance, gapAlong(c, ours->normal), stock->distance,
                  gapAlong(c, stock->normal), allowed);
    }
  }

  GpuWorld w;
  ShapeStore m_store;
  RandomSource m_random;
  Oracle m_oracle;
  std::vector<Case> m_cases;
  std::vector<std::pair<btTransform, btTransform>> m_poses;
};

Tally& all() {
  static Tally tally;
  return tally;
}

void expectAsStock(const std::string& name, const Tally& t) {
  std::printf(
      "%-32s %3d poses, %3d touch, %2d ambiguous, %2d finely, %2d better, wrong: %d existence, %d normal, %d depth; "
      "worst %.2f "
      "degrees, %.4f of the size\n",
      name.c_str(), t.poses, t.touching, t.ambiguous, t.finely, t.exceptions, t.wrongExistence, t.wrongNormal,
      t.wrongDepth, t.worstTurn / kDegree, t.worstDepth);
  // Of few poses the share says little: 10 % is what the long run is held to.
  EXPECT_LE(t.ambiguous, t.poses >= 100 ? t.poses / 10 : t.poses / 4) << name;
  EXPECT_EQ(t.wrongExistence + t.wrongNormal + t.wrongDepth, 0) << name;
  all().add(t);
}

// Each kind is a test, against itself, those that come after it, and a plane, so that a part of the matrix can be run.
class ConvexMatrix : public ::testing::TestWithParam<size_t> {
 protected:
  static void TearDownTestSuite() {
    const Tally& t = all();
    std::printf(
        "all: %d poses, %d touch, %d ambiguous, %d finely, %d better, wrong: %d existence, %d normal, %d depth\n",
        t.poses, t.touching, t.ambiguous, t.finely, t.exceptions, t.wrongExistence, t.wrongNormal, t.wrongDepth);
    EXPECT_LE(t.exceptions, t.poses / 100);
  }
};

TEST_P(ConvexMatrix, AgainstThoseAfterIt) {
  const auto kinds = convexKinds();
  const size_t i = GetParam();
  for (size_t j = i; j <= kinds.size(); ++j) {
    const ShapeKind* second = j < kinds.size() ? &kinds[j] : nullptr;
    Matrix matrix(static_cast<unsigned>(100 * i + j));
    matrix.add(kinds[i], second, posesAPair());
    expectAsStock(kinds[i].name + " / " + (second ? second->name : "plane"), matrix.run());
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, ConvexMatrix, ::testing::Range(size_t(0), convexKinds().size()),
                         [](const auto& p) { return testNameOf(convexKinds()[p.param].name); });

}  // namespace
}  // namespace btgpu::test
