// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "support_check.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "exact_type.h"

BTGPU_TRANSLATION_BEGIN
namespace {

using AlgorithmTable = btCollisionAlgorithmCreateFunc* (
    btCollisionDispatcher::*)[MAX_BROADPHASE_COLLISION_TYPES][MAX_BROADPHASE_COLLISION_TYPES];

// The dispatcher's table of algorithms is protected; a derived class may name it.
struct DispatcherTable : btCollisionDispatcher {
  static AlgorithmTable member() { return &DispatcherTable::m_doubleDispatchContactPoints; }
};

using PairCallback = btOverlappingPairCallback*;

struct HashedCache : btHashedOverlappingPairCache {
  static PairCallback btHashedOverlappingPairCache::*member() { return &HashedCache::m_ghostPairCallback; }
};
struct SortedCache : btSortedOverlappingPairCache {
  static PairCallback btSortedOverlappingPairCache::*member() { return &SortedCache::m_ghostPairCallback; }
};

PairCallback pairCallbackOf(btOverlappingPairCache& cache) {
  if (auto* hashed = dynamic_cast<btHashedOverlappingPairCache*>(&cache)) return hashed->*HashedCache::member();
  if (auto* sorted = dynamic_cast<btSortedOverlappingPairCache*>(&cache)) return sorted->*SortedCache::member();
  return nullptr;
}

const btOverlappingPairCallback* userCallbackOf(btBroadphaseInterface& broadphase) {
  if (auto* sweep = dynamic_cast<btAxisSweep3Internal<unsigned short>*>(&broadphase)) {
    return sweep->getOverlappingPairUserCallback();
  }
  if (auto* sweep = dynamic_cast<btAxisSweep3Internal<unsigned int>*>(&broadphase)) {
    return sweep->getOverlappingPairUserCallback();
  }
  return nullptr;
}

// btGhostPairCallback only keeps the lists of ghost objects.
bool mayChangeBodies(const btOverlappingPairCallback* callback) {
  return callback && !isExactly<btGhostPairCallback>(*callback);
}

// Shapes that the device collides. Of a pair of them for which the application has registered an algorithm, the type
// that comes first here is the host's: the last ones are those of which everything rests.
constexpr int kShapeTypes[] = {SPHERE_SHAPE_PROXYTYPE,
                               BOX_SHAPE_PROXYTYPE,
                               CAPSULE_SHAPE_PROXYTYPE,
                               CONVEX_HULL_SHAPE_PROXYTYPE,
                               TRIANGLE_SHAPE_PROXYTYPE,
                               TETRAHEDRAL_SHAPE_PROXYTYPE,
                               CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE,
                               CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE,
                               MULTI_SPHERE_SHAPE_PROXYTYPE,
                               CONE_SHAPE_PROXYTYPE,
                               CYLINDER_SHAPE_PROXYTYPE,
                               UNIFORM_SCALING_SHAPE_PROXYTYPE,
                               BOX_2D_SHAPE_PROXYTYPE,
                               CONVEX_2D_SHAPE_PROXYTYPE,
                               MINKOWSKI_DIFFERENCE_SHAPE_PROXYTYPE,
                               COMPOUND_SHAPE_PROXYTYPE,
                               STATIC_PLANE_PROXYTYPE,
                               TRIANGLE_MESH_SHAPE_PROXYTYPE,
                               SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE,
                               MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE,
                               TERRAIN_SHAPE_PROXYTYPE};

bool hasStockConfiguration(btCollisionConfiguration& configuration) {
  return isExactly<btDefaultCollisionConfiguration, btSoftBodyRigidBodyCollisionConfiguration>(configuration);
}

void checkDispatcher(btDiscreteDynamicsWorld& world, FallbackList& missing) {
  btDispatcher& dispatcher = *world.getDispatcher();
  if (!isExactly<btCollisionDispatcher>(dispatcher)) {
    missing.add("dispatcher", "not Bullet's own btCollisionDispatcher");
    return;
  }
  // Its table of algorithms came from there, so that what is the application's own can't be told.
  if (!hasStockConfiguration(*static_cast<btCollisionDispatcher&>(dispatcher).getCollisionConfiguration())) {
    missing.add("collision configuration", "not Bullet's own");
  }
}

void checkPairCache(btDiscreteDynamicsWorld& world, FallbackList& missing) {
  btOverlappingPairCache& cache = *world.getPairCache();
  if (!isExactly<btHashedOverlappingPairCache, btSortedOverlappingPairCache>(cache)) {
    missing.add("pair cache", "not Bullet's own: it may keep pairs out that the device would collide");
  }
}

void checkSolver(btDiscreteDynamicsWorld& world, FallbackList& missing) {
  btConstraintSolver& solver = *world.getConstraintSolver();
  if (!isExactly<btSequentialImpulseConstraintSolver>(solver)) {
    missing.add("constraint solver", "not Bullet's own btSequentialImpulseConstraintSolver");
  }
  const btContactSolverInfo& info = world.getSolverInfo();
  if (info.m_solverMode & SOLVER_RANDMIZE_ORDER) missing.add("SOLVER_RANDMIZE_ORDER", "not on the device");
  if (info.m_leastSquaresResidualThreshold != btScalar(0)) {
    missing.add("m_leastSquaresResidualThreshold", "iterations can't end early on the device");
  }
  btSimulationIslandManager& islands = *world.getSimulationIslandManager();
  if (!isExactly<btSimulationIslandManager>(islands)) missing.add("island manager", "not Bullet's own");
}

}  // namespace

void checkWorld(btDiscreteDynamicsWorld& world, btScalar timeStep, FallbackList& missing) {
  if (!(timeStep > btScalar(0)) || !std::isfinite(double(timeStep))) missing.add("time step", "not a positive number");
  if (world.getDispatchInfo().m_dispatchFunc != btDispatcherInfo::DISPATCH_DISCRETE) {
    missing.add("continuous dispatch", "not on the device");
  }
  checkDispatcher(world, missing);
  checkPairCache(world, missing);
  checkSolver(world, missing);
}

bool hasPairCallback(btDiscreteDynamicsWorld& world) {
  return mayChangeBodies(pairCallbackOf(*world.getPairCache())) ||
         mayChangeBodies(userCallbackOf(*world.getBroadphase()));
}

const char* globalContactCallback(const btCollisionDispatcher& dispatcher) {
  if (dispatcher.getNearCallback() != btCollisionDispatcher::defaultNearCallback) return "near callback";
  if (gContactProcessedCallback) return "gContactProcessedCallback";
  if (gCalculateCombinedFrictionCallback != &btManifoldResult::calculateCombinedFriction ||
      gCalculateCombinedRestitutionCallback != &btManifoldResult::calculateCombinedRestitution ||
      gCalculateCombinedRollingFrictionCallback != &btManifoldResult::calculateCombinedRollingFriction ||
      gCalculateCombinedSpinningFrictionCallback != &btManifoldResult::calculateCombinedSpinningFriction ||
      gCalculateCombinedContactDampingCallback != &btManifoldResult::calculateCombinedContactDamping ||
      gCalculateCombinedContactStiffnessCallback != &btManifoldResult::calculateCombinedContactStiffness) {
    return "material combine callback";
  }
  return nullptr;
}

const char* contactCallback(const btCollisionObject& object) {
  const bool asked = object.getCollisionFlags() & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK;
  return gContactAddedCallback && asked ? "gContactAddedCallback" : nullptr;
}

std::uint64_t typesWithOwnAlgorithms(const btCollisionDispatcher& dispatcher) {
  btCollisionConfiguration& configuration = *const_cast<btCollisionDispatcher&>(dispatcher).getCollisionConfiguration();
  const auto& table = dispatcher.*DispatcherTable::member();
  const auto isOwn = [&](int a, int b) {
    return table[a][b] != configuration.getCollisionAlgorithmCreateFunc(a, b) ||
           table[b][a] != configuration.getCollisionAlgorithmCreateFunc(b, a);
  };
  std::uint64_t types = 0;
  for (const int* a = std::begin(kShapeTypes); a != std::end(kShapeTypes); ++a) {
    if (std::any_of(a, std::end(kShapeTypes), [&](int b) { return isOwn(*a, b); })) types |= std::uint64_t{1} << *a;
  }
  return types;
}

bool checkObject(const btCollisionObject& object, FallbackList& missing) {
  const int type = object.getInternalType();
  const int known =
      btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY | btCollisionObject::CO_GHOST_OBJECT;
  const char* what = nullptr;
  const char* reason = "not on the device yet";
  if (type & btCollisionObject::CO_SOFT_BODY) {
    what = "soft body";
  } else if (type & btCollisionObject::CO_FEATHERSTONE_LINK) {
    what = "multibody link";
  } else if (type & ~known) {
    what = "collision object of the application's own type";
  } else if (!object.getCollisionShape() || !object.getBroadphaseHandle()) {
    what = "collision object without shape or broadphase proxy";
    reason = "the stock path decides what to do with it";
  }
  if (what) missing.add(what, reason);
  return what == nullptr;
}

bool isSwept(const btCollisionObject& object) {
  return object.getCcdSquareMotionThreshold() > btScalar(0) && !object.isStaticOrKinematicObject() &&
         object.getActivationState() != DISABLE_SIMULATION;
}

BTGPU_TRANSLATION_END
