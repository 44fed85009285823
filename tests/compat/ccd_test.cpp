// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Continuous collision detection: fast bodies that ask for it are stopped by what stops them in stock, with the step on
// the device and only their sweeps on the CPU.
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <cmath>
#include <memory>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

constexpr const char* kShare = "continuous collision detection (CCD)";

// Stopped so far from a surface, a ball of 0.2 is 0.037 deep in it, and less in the next step: not at the 0.04 from
// which on the solver splits impulses, where the last digit would decide.
constexpr btScalar kSwept = btScalar(0.163);

// So many that the order of the rows does not matter: a body that is stopped has a predicted contact and a real one,
// whose normals may differ.
constexpr int kIterations = 200;

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 v(double x, double y, double z) { return {s(x), s(y), s(z)}; }

enum class Wall { StaticBox, Mesh, Compound, Dynamic, Plane };
const char* nameOf(Wall wall) {
  const char* names[] = {"StaticBox", "Mesh", "Compound", "Dynamic", "Plane"};
  return names[static_cast<int>(wall)];
}
enum class Bullet { Sphere, Capsule, Hull, Compound };
const char* nameOf(Bullet bullet) {
  const char* names[] = {"Sphere", "Capsule", "Hull", "Compound"};
  return names[static_cast<int>(bullet)];
}

// A wall of 0.1 across the x axis at 5, and a body that flies at it.
template <typename World>
struct Range {
  Range(Wall kind, Bullet bullet, double speed) {
    w.world.setGravity(v(0, -10, 0));
    w.world.getSolverInfo().m_numIterations = kIterations;
    addWall(kind);
    projectile = w.objects.add(s(0.5), shapeOf(bullet), v(0, 0.1, 2));  // off the diagonal of the mesh
    projectile->setLinearVelocity(v(speed, 0, 0));
    projectile->setRestitution(s(0.3));
    // Only the real contact's friction turns the body, and how much of the work is the predicted one's depends on the
    // order of the rows, in stock too.
    projectile->setFriction(0);
    projectile->setCcdMotionThreshold(s(0.1));
    projectile->setCcdSweptSphereRadius(kSwept);
  }
  void addWall(Wall kind) {
    btScalar mass = 0;
    btCollisionShape* shape = w.objects.box(v(0.05, 4, 4));
    if (kind == Wall::Dynamic) mass = 100;
    if (kind == Wall::Mesh) {
      triangles = std::make_unique<btTriangleMesh>();
      triangles->addTriangle(v(0, -4, -4), v(0, 4, -4), v(0, 4, 4));
      triangles->addTriangle(v(0, -4, -4), v(0, 4, 4), v(0, -4, 4));
      shape = w.objects.template shape<btBvhTriangleMeshShape>(triangles.get(), true);
    }
    if (kind == Wall::Compound) {
      auto* compound = w.objects.template shape<btCompoundShape>();
      for (const int side : {-1, 1}) {
        compound->addChildShape(btTransform(btQuaternion::getIdentity(), v(0, 0, 2 * side)),
                                w.objects.box(v(0.05, 4, 2)));
      }
      shape = compound;
    }
    if (kind == Wall::Plane) shape = w.objects.plane(v(-1, 0, 0), 0);
    wall = w.objects.add(mass, shape, v(5, 0, 0));
  }
  btCollisionShape* shapeOf(Bullet bullet) {
    if (bullet == Bullet::Capsule) return w.objects.capsule(s(0.15), s(0.3));
    if (bullet == Bullet::Hull) return w.objects.hull(scenes::prism(6, 0.2, 0.2));
    if (bullet == Bullet::Compound) {  // stock sweeps only convex shapes
      auto* compound = w.objects.template shape<btCompoundShape>();
      compound->addChildShape(btTransform::getIdentity(), w.objects.sphere(s(0.2)));
      return compound;
    }
    return w.objects.sphere(s(0.2));
  }
  std::unique_ptr<btTriangleMesh> triangles;  // goes after its shape
  World w;
  btRigidBody *wall = nullptr, *projectile = nullptr;
};

// Manifolds with contacts, predicted ones too.
int touching(btDispatcher& dispatcher) {
  int count = 0;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    count += dispatcher.getManifoldByIndexInternal(i)->getNumContacts() > 0;
  }
  return count;
}

struct Shot {
  Wall wall;
  Bullet bullet;
  double speed;
};

class CcdShot : public ::testing::TestWithParam<Shot> {};

// Until the projectile has been thrown back or is through: later, what the contact's rounding made of its spin takes
// single bodies apart.
TEST_P(CcdShot, StopsWhereStockDoes) {
  const Shot shot = GetParam();
  Range<StockWorld> stock(shot.wall, shot.bullet, shot.speed);
  Range<GpuWorld> gpu(shot.wall, shot.bullet, shot.speed);
  const int steps = 12 + static_cast<int>(5 / shot.speed * 60);
  double furthest = -1e30;
  for (int step = 1; step <= steps; ++step) {
    stock.w.run(1);
    gpu.w.run(1);
    const BodyState ours = stateOf(*gpu.projectile), theirs = stateOf(*stock.projectile);
    furthest =
        std::max(furthest, double((theirs.transform.getOrigin() - stateOf(*stock.wall).transform.getOrigin()).x()));
    // Roundings of the pose, velocities of the shot's size, ten iterations on the contact; through the wall or not they
    // would be metres.
    const double tolerance = 10 * floatNoise(step, shot.speed) + 1e-4;
    EXPECT_LE(distance(ours.transform.getOrigin(), theirs.transform.getOrigin()), tolerance) << "step " << step;
    EXPECT_LE(distance(ours.linear, theirs.linear), 10 * tolerance) << "step " << step;
    if (theirs.hitFraction != 1) {
      EXPECT_GT(touching(gpu.w.dispatcher), 0) << "the predicted contact is there to be seen, step " << step;
      EXPECT_EQ(touching(gpu.w.dispatcher), touching(stock.w.dispatcher)) << "step " << step;
    }
    if (HasFailure()) break;
    // Then it rests on the wall, with all its corners at once (decision 5) where stock finds one a step.
    if (shot.bullet == Bullet::Hull && theirs.linear.length() < 1) break;
  }
  // A wall that moves is hit again while it falls.
  if (shot.bullet != Bullet::Compound && shot.wall != Wall::Dynamic) {
    EXPECT_LT(furthest, 0.0) << "stock lets it through";
  }
  expectAllOnDevice(gpu.w.world, {kShare});
  EXPECT_EQ(reported(gpu.w.world, kShare).m_count, unsigned(gpu.w.world.statistics().m_deviceSteps));
}

std::vector<Shot> allShots() {
  std::vector<Shot> shots;
  for (const Wall wall : {Wall::StaticBox, Wall::Mesh, Wall::Compound, Wall::Dynamic, Wall::Plane}) {
    for (const double speed : {10.0, 100.0, 1000.0}) shots.push_back({wall, Bullet::Sphere, speed});
  }
  for (const Bullet bullet : {Bullet::Capsule, Bullet::Hull, Bullet::Compound}) {
    shots.push_back({Wall::StaticBox, bullet, 290});
  }
  return shots;
}

INSTANTIATE_TEST_SUITE_P(All, CcdShot, ::testing::ValuesIn(allShots()), [](const auto& p) {
  return std::string(nameOf(p.param.bullet)) + "At" + nameOf(p.param.wall) + std::to_string(int(p.param.speed));
});

// Nothing of the above says much if nothing would pass through.
TEST(Ccd, PassesThroughWithout) {
  Range<GpuWorld> gpu(Wall::StaticBox, Bullet::Sphere, 300);
  gpu.projectile->setCcdMotionThreshold(0);
  gpu.w.run(3);
  EXPECT_GT(double(gpu.projectile->getWorldTransform().getOrigin().x()), 6.0);
  expectAllOnDevice(gpu.w.world);
}

TEST(Ccd, OffByTheDispatchInfo) {
  Range<GpuWorld> gpu(Wall::StaticBox, Bullet::Sphere, 300);
  gpu.w.world.getDispatchInfo().m_useContinuous = false;
  gpu.w.run(3);
  EXPECT_GT(double(gpu.projectile->getWorldTransform().getOrigin().x()), 6.0);
  expectAllOnDevice(gpu.w.world);
}

// The settings that keep less of the host's world current.
TEST(Ccd, WithoutHostQueriesAndContacts) {
  Range<StockWorld> stock(Wall::Mesh, Bullet::Sphere, 300);
  Range<GpuWorld> gpu(Wall::Mesh, Bullet::Sphere, 300);
  btGpuSettings settings;
  settings.m_hostQueries = settings.m_contacts = false;
  btGpuDynamicsWorld::configure(&gpu.w.world, settings);
  stock.w.run(12);
  gpu.w.run(12);
  EXPECT_LE(distance(stateOf(*gpu.projectile).transform.getOrigin(), stateOf(*stock.projectile).transform.getOrigin()),
            1e-3);
  EXPECT_LT(double(gpu.projectile->getWorldTransform().getOrigin().x()), 5.0);
  expectAllOnDevice(gpu.w.world, {kShare});
}

// stepSimulation with several substeps: the device may not go ahead of the sweeps.
TEST(Ccd, InSubsteps) {
  Range<StockWorld> stock(Wall::StaticBox, Bullet::Sphere, 200);
  Range<GpuWorld> gpu(Wall::StaticBox, Bullet::Sphere, 200);
  for (int i = 0; i < 4; ++i) {
    stock.w.world.stepSimulation(s(4.0 / 60), 4);
    gpu.w.world.stepSimulation(s(4.0 / 60), 4);
    EXPECT_LE(
        distance(stateOf(*gpu.projectile).transform.getOrigin(), stateOf(*stock.projectile).transform.getOrigin()),
        1e-3);
  }
  expectAllOnDevice(gpu.w.world, {kShare});
}

// Restitution of contacts that stopped a body before it touched.
TEST(Ccd, SpeculativeRestitution) {
  Range<StockWorld> stock(Wall::StaticBox, Bullet::Sphere, 200);
  Range<GpuWorld> gpu(Wall::StaticBox, Bullet::Sphere, 200);
  const auto shoot = [](auto& range) {
    range.w.world.setApplySpeculativeContactRestitution(true);
    range.w.world.setGravity(btVector3(0, 0, 0));
    range.projectile->setGravity(btVector3(0, 0, 0));
    range.projectile->setRestitution(s(0.5));
    range.wall->setRestitution(1);
    range.w.run(10);
    return stateOf(*range.projectile);
  };
  const BodyState ours = shoot(gpu), theirs = shoot(stock);
  EXPECT_LE(distance(ours.linear, theirs.linear), 1e-2);
  EXPECT_LE(distance(ours.transform.getOrigin(), theirs.transform.getOrigin()), 1e-2);
  expectAllOnDevice(gpu.w.world, {kShare});
}

// Several at once, and at each other: whom the sweep of one meets where depends on who has moved already.
template <typename World>
void crossfire(World& w, std::vector<btRigidBody*>& bodies) {
  w.world.setGravity(v(0, 0, 0));
  w.world.getSolverInfo().m_numIterations = kIterations;
  btCollisionShape* ball = w.objects.sphere(s(0.2));
  for (int i = 0; i < 12; ++i) {
    const double side = i % 2 ? 1 : -1;
    btRigidBody* body = w.objects.add(1, ball, v(5.0 * side + 0.05 * i, 0.01 * i, 3.0 * (i / 2)));
    body->setLinearVelocity(v(-(150.0 + 20 * i) * side, 0, 0));
    body->setFriction(0);
    if (i % 3 != 2) {
      body->setCcdMotionThreshold(s(0.1));
      body->setCcdSweptSphereRadius(kSwept);
    }
    bodies.push_back(body);
  }
}

TEST(Ccd, BodiesAtEachOther) {
  StockWorld stock;
  GpuWorld gpu;
  std::vector<btRigidBody*> theirs, ours;
  crossfire(stock, theirs);
  crossfire(gpu, ours);
  for (int step = 1; step <= 4; ++step) {
    stock.run(1);
    gpu.run(1);
    for (size_t i = 0; i < ours.size(); ++i) {
      EXPECT_LE(distance(stateOf(*ours[i]).transform.getOrigin(), stateOf(*theirs[i]).transform.getOrigin()), 1e-2)
          << "body " << i << " step " << step;
    }
  }
  expectAllOnDevice(gpu.world, {kShare});
}

// A world that comes from the stock path with predictive contacts, and goes back to it.
TEST(Ccd, BetweenThePaths) {
  Range<StockWorld> stock(Wall::StaticBox, Bullet::Sphere, 20);
  Range<GpuWorld> gpu(Wall::StaticBox, Bullet::Sphere, 20);
  btGpuSettings settings;
  for (int i = 0; i < 30; ++i) {
    settings.m_stockOnly = i % 3 == 0;
    btGpuDynamicsWorld::configure(&gpu.w.world, settings);
    stock.w.run(1);
    gpu.w.run(1);
    EXPECT_LE(
        distance(stateOf(*gpu.projectile).transform.getOrigin(), stateOf(*stock.projectile).transform.getOrigin()),
        1e-2)
        << "step " << i;
  }
  EXPECT_GT(gpu.w.world.statistics().m_deviceSteps, 15u);
}

}  // namespace
}  // namespace btgpu::test
