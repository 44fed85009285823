// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Compounds on the device, as an application sees them: manifolds, changes of their shapes, the way to the stock path
// and back.
#include <set>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btTransform at(double x, double y, double z) {
  return btTransform(btQuaternion::getIdentity(), btVector3(s(x), s(y), s(z)));
}

btGpuSettings onDevice() {
  btGpuSettings settings;
  settings.m_smallWorld = 0;
  return settings;
}

// A floor and a table on four legs that stands on it, a little above.
template <typename World>
struct TableWorld : WorldOf<World> {
  template <typename... Settings>
  explicit TableWorld(const Settings&... settings) : WorldOf<World>(settings...) {
    auto& o = this->objects;
    this->world.setGravity(btVector3(0, -10, 0));
    ground = o.add(0, o.box(btVector3(10, 1, 10)), btVector3(0, -1, 0));
    shape = o.template shape<btCompoundShape>();
    shape->addChildShape(at(0, 0.45, 0), o.box(btVector3(1, s(0.05), 1)));
    leg = o.box(btVector3(s(0.1), s(0.4), s(0.1)));
    for (const double x : {-0.8, 0.8}) {
      for (const double z : {-0.8, 0.8}) shape->addChildShape(at(x, 0, z), leg);
    }
    table = o.add(5, shape, btVector3(0, s(0.42), 0));
    for (btRigidBody* body : o.bodies()) body->setSleepingThresholds(0, 0);
  }
  // Numbers of the table's shapes that have points with another body, one a manifold.
  std::multiset<int> touching() {
    std::multiset<int> shapes;
    for (int i = 0; i < this->dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold& m = *this->dispatcher.getManifoldByIndexInternal(i);
      if (m.getNumContacts() == 0) continue;
      const bool first = m.getBody0() == table;
      const btManifoldPoint& p = m.getContactPoint(0);
      EXPECT_EQ(first ? p.m_index1 : p.m_index0, -1) << "the other one is no compound";
      shapes.insert(first ? p.m_index0 : p.m_index1);
    }
    return shapes;
  }
  double lift() {
    double sum = 0;
    for (int i = 0; i < this->dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold& m = *this->dispatcher.getManifoldByIndexInternal(i);
      for (int k = 0; k < m.getNumContacts(); ++k) sum += double(m.getContactPoint(k).m_appliedImpulse);
    }
    return sum;
  }

  btRigidBody *ground, *table;
  btCompoundShape* shape;
  btBoxShape* leg;
};
using GpuTable = TableWorld<btGpuDynamicsWorld>;
using StockTable = TableWorld<btDiscreteDynamicsWorld>;

TEST(Compounds, StandOnTheDeviceAsInStock) {
  GpuTable gpu(onDevice());
  StockTable stock;
  for (int i = 0; i < 120; ++i) {
    gpu.run(1);
    stock.run(1);
    // Later a double world of stock's rocks on three legs.
    if (i < 60) { ASSERT_EQ(gpu.touching(), stock.touching()) << "step " << i; }
  }
  expectAllOnDevice(gpu.world);
  EXPECT_EQ(gpu.touching(), (std::multiset<int>{1, 2, 3, 4}));
  EXPECT_NEAR(double(gpu.table->getWorldTransform().getOrigin().y()),
              double(stock.table->getWorldTransform().getOrigin().y()), 1e-3);
  EXPECT_NEAR(gpu.lift(), 5 * 10 / 60.0, 0.02) << "its weight";
}

TEST(Compounds, AManifoldStaysWhileItsShapesTouchAndGoesWithThem) {
  GpuTable w(onDevice());
  w.run(30);
  std::set<const btPersistentManifold*> before, after;
  for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) before.insert(w.dispatcher.getManifoldByIndexInternal(i));
  int data = 1;
  w.dispatcher.getManifoldByIndexInternal(0)->getContactPoint(0).m_userPersistentData = &data;
  w.run(10);
  for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) after.insert(w.dispatcher.getManifoldByIndexInternal(i));
  EXPECT_EQ(before, after);
  EXPECT_EQ(w.dispatcher.getManifoldByIndexInternal(0)->getContactPoint(0).m_userPersistentData, &data);
  w.dispatcher.getManifoldByIndexInternal(0)->getContactPoint(0).m_userPersistentData = nullptr;
  // The bodies' boxes overlap still, their shapes do not.
  w.table->setWorldTransform(at(0, 0.55, 0));
  w.table->setLinearVelocity(btVector3(0, 0, 0));
  w.run(1);
  EXPECT_TRUE(w.touching().empty());
  EXPECT_EQ(w.dispatcher.getNumManifolds(), 0);
}

TEST(Compounds, ChangesOfTheirShapesAreNoticed) {
  GpuTable w(onDevice());
  w.run(30);
  // A leg less: it tips over to that side.
  w.shape->removeChildShapeByIndex(4);
  w.run(3);
  EXPECT_EQ(w.touching().count(4), 0u);
  // And back, longer: it lifts the table.
  w.shape->addChildShape(at(0.8, -0.1, 0.8), w.leg);
  const double height = double(w.table->getWorldTransform().getOrigin().y());
  w.run(20);
  EXPECT_EQ(w.touching().count(4), 1u);
  EXPECT_GT(double(w.table->getWorldTransform().getOrigin().y()), height + 0.01);
  // One of them elsewhere.
  w.shape->updateChildTransform(0, at(0, -0.44, 0));
  w.run(10);
  EXPECT_EQ(w.touching().count(0), 1u);
  expectAllOnDevice(w.world);
}

TEST(Compounds, DifferentOnesInOneWorldAndSlotsThatAreUsedAgain) {
  GpuTable w(onDevice());
  auto& o = w.objects;
  btCompoundShape* nested = o.shape<btCompoundShape>();
  nested->addChildShape(at(0, -0.2, 0), w.shape);
  nested->addChildShape(at(0, 0.6, 0), o.sphere(s(0.3)));
  std::vector<btRigidBody*> others;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i)
      others.push_back(o.add(1, i % 2 ? nested : w.shape, btVector3(s(3 * i - 4.5), s(1.5), 4)));
    w.run(60);
    for (btRigidBody* body : others) {
      EXPECT_NEAR(double(body->getWorldTransform().getOrigin().y()), body->getCollisionShape() == nested ? 0.6 : 0.4,
                  0.02);
      w.world.removeRigidBody(body);
    }
    w.run(1);
    EXPECT_EQ(w.touching(), (std::multiset<int>{1, 2, 3, 4}));
    others.clear();
  }
  expectAllOnDevice(w.world);
}

// What its shapes touch, by the pairs of the shapes: as a whole it meets nothing that moves.
template <typename World>
int wokenByAKinematicOne(TableWorld<World>& w) {
  w.table->setMassProps(0, btVector3(0, 0, 0));
  w.world.removeRigidBody(w.table);
  w.table->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  w.table->setActivationState(DISABLE_DEACTIVATION);
  w.world.addRigidBody(w.table);
  btRigidBody* box = w.objects.add(1, w.leg, btVector3(0, s(1.31), 0));
  box->forceActivationState(ISLAND_SLEEPING);
  w.run(2);
  return box->getActivationState();
}

TEST(Compounds, AKinematicOneWakesWhatItTouches) {
  GpuTable gpu(onDevice());
  StockTable stock;
  EXPECT_EQ(wokenByAKinematicOne(gpu), wokenByAKinematicOne(stock));
  EXPECT_EQ(wokenByAKinematicOne(gpu), ACTIVE_TAG);
  expectAllOnDevice(gpu.world);
}

// A class of the application's own may override anything.
class OwnBox : public btBoxShape {
 public:
  using btBoxShape::btBoxShape;
};

TEST(Compounds, OfAShapeThatTheDeviceLacksCollideOnTheHost) {
  GpuTable w(onDevice());
  OwnBox box(btVector3(10, 1, 10));
  btCompoundShape shape;
  shape.addChildShape(at(0, -1, 0), &box);
  btRigidBody* body = w.objects.add(0, &shape, btVector3(0, s(-0.2), 0));
  w.run(5);
  EXPECT_GT(reported(w.world, "Compound shape").m_count, 0u) << reportText(w.world);
  EXPECT_FALSE(reported(w.world, "Compound shape").m_wholeStep);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
  w.world.removeRigidBody(body);
}

// Impulses go along, both ways: else the table would sink and rise.
TEST(Compounds, KeepTheirImpulsesOnTheWayToTheStockPathAndBack) {
  for (const bool contacts : {true, false}) {
    btGpuSettings settings = onDevice();
    settings.m_contacts = contacts;
    GpuTable w(settings);
    w.run(120);
    const double height = double(w.table->getWorldTransform().getOrigin().y());
    double off = 0;
    for (int i = 0; i < 12; ++i) {
      w.world.getSolverInfo().m_leastSquaresResidualThreshold = s(i % 6 < 3 ? 1e-30 : 0);  // not on the device
      w.run(1);
      off = std::max(off, std::fabs(double(w.table->getWorldTransform().getOrigin().y()) - height));
      const btVector3 v = w.table->getLinearVelocity();
      EXPECT_LT(length(v), 5e-3) << "step " << i;
    }
    EXPECT_GT(w.world.statistics().m_stockSteps, 0u);
    EXPECT_LT(off, 1e-4) << contacts;
  }
}

TEST(Compounds, AWorldThatIsHeldAgainstStockStepByStepAgrees) {
  btGpuSettings settings = onDevice();
  settings.m_crosscheckEvery = 1;
  GpuTable w(settings);
  w.table->setAngularVelocity(btVector3(1, 0, s(0.5)));
  w.run(60);
  EXPECT_TRUE(w.world.crosscheck().agreed());
  EXPECT_EQ(w.world.crosscheck().m_checkedSteps, 60u);
}

}  // namespace
}  // namespace btgpu::test
