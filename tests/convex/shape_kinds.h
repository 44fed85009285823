// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One of Bullet's shapes of each convex kind that the device collides, of random measures, for the tests that put each
// against each other.
#pragma once

#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace btgpu::test {

// Shapes and what they are made of, as long as a test needs them.
class ShapeStore {
 public:
  template <typename T, typename... Arguments>
  T* make(Arguments&&... arguments) {
    auto made = std::make_shared<T>(std::forward<Arguments>(arguments)...);
    m_kept.push_back(made);
    return made.get();
  }

 private:
  std::vector<std::shared_ptr<void>> m_kept;
};

using RandomSource = std::mt19937;

inline double uniformIn(RandomSource& random, double low, double high) {
  return low + (high - low) * (double(random()) / 4294967296.0);
}
inline btScalar scalarIn(RandomSource& random, double low, double high) {
  return static_cast<btScalar>(uniformIn(random, low, high));
}
inline btVector3 halfExtents(RandomSource& random, double size) {
  const btScalar x = scalarIn(random, 0.4, 1), y = scalarIn(random, 0.4, 1), z = scalarIn(random, 0.4, 1);
  return btVector3(x, y, z) * static_cast<btScalar>(size);
}
inline std::vector<btVector3> cornersOf(RandomSource& random, double size, int count) {
  const btVector3 half = halfExtents(random, size);
  std::vector<btVector3> points;
  while (static_cast<int>(points.size()) < count) {
    const btVector3 p(scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1));
    if (p.length() > btScalar(0.2) && p.length() < btScalar(1)) points.push_back(p.normalized() * half);
  }
  return points;
}

struct ShapeKind {
  std::string name;
  // A shape of about this size (half an extent).
  std::function<btCollisionShape*(ShapeStore&, RandomSource&, double size)> make;
};

// As gtest wants the names of tests: letters and digits.
inline std::string testNameOf(std::string kind) {
  kind.erase(std::remove_if(kind.begin(), kind.end(), [](unsigned char c) { return !std::isalnum(c); }), kind.end());
  return kind;
}

inline btConvexShape* makeHull(ShapeStore& store, RandomSource& random, double size) {
  auto* hull = store.make<btConvexHullShape>();
  for (const btVector3& p : cornersOf(random, size, 6 + static_cast<int>(random() % 12))) hull->addPoint(p, false);
  hull->recalcLocalAabb();
  return hull;
}

inline btConvexShape* makeCylinder(ShapeStore& store, RandomSource& random, double size) {
  btVector3 half = halfExtents(random, size);
  switch (random() % 3) {
    case 0:
      half[1] = half[2];
      return store.make<btCylinderShapeX>(half);
    case 1:
      half[1] = half[0];
      return store.make<btCylinderShapeZ>(half);
    default:
      half[2] = half[0];
      return store.make<btCylinderShape>(half);
  }
}

inline btConvexShape* makeCone(ShapeStore& store, RandomSource& random, double size) {
  const btVector3 half = halfExtents(random, size);
  switch (random() % 3) {
    case 0:
      return store.make<btConeShapeX>(half.x(), 2 * half.y());
    case 1:
      return store.make<btConeShapeZ>(half.x(), 2 * half.y());
    default:
      return store.make<btConeShape>(half.x(), 2 * half.y());
  }
}

inline std::vector<ShapeKind> convexKinds() {
  std::vector<ShapeKind> kinds;
  kinds.push_back({"sphere", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     return store.make<btSphereShape>(halfExtents(random, size).x());
                   }});
  kinds.push_back({"box", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     return store.make<btBoxShape>(halfExtents(random, size));
                   }});
  kinds.push_back({"capsule", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     const btVector3 half = halfExtents(random, size) * btScalar(0.5);
                     if (random() % 2) return store.make<btCapsuleShapeX>(half.x(), 2 * half.y());
                     return store.make<btCapsuleShape>(half.x(), 2 * half.y());
                   }});
  kinds.push_back({"hull", makeHull});
  kinds.push_back({"featured hull", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     auto* hull = static_cast<btConvexHullShape*>(makeHull(store, random, size));
                     hull->initializePolyhedralFeatures();
                     return hull;
                   }});
  kinds.push_back({"cylinder", makeCylinder});
  kinds.push_back({"cone", makeCone});
  kinds.push_back({"multi-sphere", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     btVector3 at[4];
                     btScalar radii[4];
                     const bool even = random() % 3 == 0;  // all of one size
                     const int count = 1 + static_cast<int>(random() % 4);
                     const btScalar radius = scalarIn(random, 0.2, 0.5) * static_cast<btScalar>(size);
                     for (int i = 0; i < count; ++i) {
                       const btVector3 half = halfExtents(random, size);
                       at[i] = btVector3(random() % 2 ? half.x() : -half.x(), random() % 2 ? half.y() : -half.y(),
                                         half.z()) *
                               btScalar(0.5);
                       radii[i] = even ? radius : scalarIn(random, 0.2, 0.5) * static_cast<btScalar>(size);
                     }
                     return store.make<btMultiSphereShape>(at, radii, count);
                   }});
  kinds.push_back({"point cloud", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     // Of the same scale along all axes: else Bullet looks for the farthest point unscaled, which is
                     // another one (the line is commented out in localGetSupportingVertexWithoutMargin).
                     const btScalar scale = scalarIn(random, 0.8, 1.2);
                     auto* points = store.make<std::vector<btVector3>>(cornersOf(random, size, 14));
                     return store.make<btConvexPointCloudShape>(points->data(), static_cast<int>(points->size()),
                                                                btVector3(scale, scale, scale));
                   }});
  kinds.push_back({"convex mesh", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     auto* mesh = store.make<btTriangleMesh>();
                     const auto p = cornersOf(random, size, 9);
                     for (int i = 0; i < 3; ++i) {
                       const auto k = static_cast<size_t>(3 * i);
                       mesh->addTriangle(p[k], p[k + 1], p[k + 2]);
                     }
                     return store.make<btConvexTriangleMeshShape>(mesh);
                   }});
  kinds.push_back({"simplex", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     const auto p = cornersOf(random, 1.5 * size, 4);
                     return store.make<btBU_Simplex1to4>(p[0], p[1], p[2], p[3]);
                   }});
  kinds.push_back({"triangle", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     const auto p = cornersOf(random, 1.5 * size, 3);
                     return store.make<btTriangleShape>(p[0], p[1], p[2]);
                   }});
  kinds.push_back({"2D box", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     btVector3 half = halfExtents(random, size);
                     half.setZ(btScalar(0.04) + half.z() * btScalar(0.2));
                     return store.make<btBox2dShape>(half);
                   }});
  kinds.push_back(
      {"2D convex", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
         // The same all along z, as is meant: stock sees two of them along z, and we as they are.
         const btVector3 half = halfExtents(random, size);
         if (random() % 2) {
           return store.make<btConvex2dShape>(store.make<btCylinderShapeZ>(btVector3(half.x(), half.x(), half.z())));
         }
         auto* prism = store.make<btConvexHullShape>();
         const int sides = 3 + static_cast<int>(random() % 6);
         for (int k = 0; k < 2 * sides; ++k) {
           const btScalar angle = SIMD_2_PI * btScalar(k / 2) / btScalar(sides);
           prism->addPoint(btVector3(half.x() * btCos(angle), half.y() * btSin(angle), k % 2 ? half.z() : -half.z()));
         }
         return store.make<btConvex2dShape>(prism);
       }});
  kinds.push_back({"scaled", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     const btScalar by = scalarIn(random, 0.6, 1.6);
                     const double inner = size / double(by);
                     btConvexShape* child = nullptr;
                     switch (random() % 5) {
                       case 0:
                         child = store.make<btBoxShape>(halfExtents(random, inner));
                         break;
                       case 1:
                         child = store.make<btSphereShape>(halfExtents(random, inner).x());
                         break;
                       case 2:
                         child = makeCone(store, random, inner);
                         break;
                       case 3:
                         child = makeCylinder(store, random, inner);
                         break;
                       default:
                         child = makeHull(store, random, inner);
                     }
                     return store.make<btUniformScalingShape>(child, by);
                   }});
  kinds.push_back({"sum", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
                     btConvexShape* a = makeHull(store, random, 0.7 * size);
                     btConvexShape* b = store.make<btSphereShape>(halfExtents(random, 0.2 * size).x());
                     if (random() % 2) b = store.make<btBoxShape>(halfExtents(random, 0.3 * size));
                     auto* sum = store.make<btMinkowskiSumShape>(a, b);
                     const btVector3 about = halfExtents(random, 1).normalized();
                     sum->setTransformB(
                         btTransform(btQuaternion(about, scalarIn(random, 0, 3)), halfExtents(random, 0.1 * size)));
                     return sum;
                   }});
  kinds.push_back(
      {"round sum", [](ShapeStore& store, RandomSource& random, double size) -> btCollisionShape* {
         const auto shape = [&](double of) -> btConvexShape* {
           const btVector3 half = halfExtents(random, of);
           const btVector3 centres[] = {half * btScalar(0.4), half * btScalar(-0.3)};
           const btScalar radii[] = {half.x() * btScalar(0.6), half.y() * btScalar(0.4)};
           switch (random() % 4) {
             case 0:
               return store.make<btBoxShape>(half);
             case 1:
               return store.make<btMultiSphereShape>(centres, radii, 2);
             case 2:
               return store.make<btCapsuleShape>(half.x(), half.y());
             default:
               return makeHull(store, random, of);
           }
         };
         btConvexShape* round =
             random() % 2 ? makeCone(store, random, 0.5 * size) : makeCylinder(store, random, 0.5 * size);
         const btVector3 about = halfExtents(random, 1).normalized();
         const btTransform turned(btQuaternion(about, scalarIn(random, 0, 3)), halfExtents(random, 0.1 * size));
         if (random() % 3 == 0) {  // in another sum, scaled
           round = store.make<btUniformScalingShape>(
               store.make<btMinkowskiSumShape>(round, store.make<btBoxShape>(halfExtents(random, 0.1 * size))),
               scalarIn(random, 0.7, 1.1));
         }
         btConvexShape* other = shape(0.4 * size);
         const bool first = random() % 2;
         auto* sum = store.make<btMinkowskiSumShape>(first ? round : other, first ? other : round);
         sum->setTransformA(turned);
         return sum;
       }});
  return kinds;
}

}  // namespace btgpu::test
