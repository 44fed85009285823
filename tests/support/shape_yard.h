// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world with shapes of every kind, for tests of batched queries.
#pragma once

#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <list>
#include <memory>
#include <random>

#include "tests/support/facade_world.h"

namespace btgpu::test {

inline btScalar s(double v) { return static_cast<btScalar>(v); }

struct Random {
  std::mt19937 engine{11};
  btScalar uniform(double a, double b) { return s(std::uniform_real_distribution<double>(a, b)(engine)); }
  btVector3 vector(double a) { return {uniform(-a, a), uniform(-a, a), uniform(-a, a)}; }
  btTransform pose(const btVector3& at) {
    return btTransform(btQuaternion(vector(1).normalized(), uniform(-3, 3)), at);
  }
};

// Batches of any size.
inline btGpuSettings onDevice() {
  btGpuSettings settings;
  settings.m_smallBatch = 0;
  return settings;
}

struct ShapeYard {
  explicit ShapeYard(const btGpuSettings& settings = onDevice()) : w(settings) {}

  // Kinds of shapes: those of which a step consists mostly, those with a test on the device, those of the host.
  static constexpr int kCommon = 6, kOnDevice = 25, kAll = 28;
  // Shapes of the first so many kinds, 4 units apart and turned.
  void fill(int count, int kinds) {
    w.world.setGravity(btVector3(0, -10, 0));
    add(0, w.objects.plane(btVector3(s(0.1), 1, 0).normalized(), s(-0.5)), btVector3(0, 0, 0));
    for (int i = 0; i < count; ++i) {
      const btVector3 at(s(4 * (i % 5)), s(2 + 3 * (i / 25)), s(4 * (i / 5 % 5)));
      add(i % 4 == 0 ? 0 : 1, shape(i % kinds), at);
    }
  }
  btCollisionShape* shape(int kind) {
    const btVector3 size(random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.2, 1));
    switch (kind) {
      case 0:
        return w.objects.sphere(random.uniform(0.3, 1));
      case 1:
        return w.objects.box(size);
      case 2:
        return w.objects.capsule(random.uniform(0.2, 0.6), random.uniform(0.3, 1));
      case 3:
        return hull(8);
      case 4:
        return hull(40);
      case 5:
        return compound(w.objects.box({s(0.3), s(0.6), s(0.4)}));
      case 6:
        return keep(new btCylinderShape(btVector3(s(0.5), s(0.8), s(0.5))));
      case 7:
        return compound(keep(new btConeShape(s(0.5), 1)));
      case 8:
        return keep(new btConeShapeX(s(0.6), 1));
      case 9:
        return mesh(false);
      case 10:
        return mesh(true);
      case 11:
        return keep(new btScaledBvhTriangleMeshShape(static_cast<btBvhTriangleMeshShape*>(mesh(false)),
                                                     btVector3(size.x(), s(-0.7), size.z())));
      case 12:
        return keep(new btMultimaterialTriangleMeshShape(heap(), true));
      case 13:
        return field(0, 1, false);
      case 14:
        return field(1, 2, true);
      case 15:
        return keep(new btCylinderShapeZ(size));
      case 16:
        return spheres();
      case 17:
        return scaled(kind % 2 ? w.objects.box(size) : hull(12));
      case 18:
        return scaled(keep(new btCylinderShapeX(size)));
      case 19:
        return keep(new btBox2dShape(size));
      case 20:
        return keep(new btConvex2dShape(static_cast<btConvexShape*>(hull(6))));
      case 21:
        return cloud();
      case 22:
        return keep(new btConvexTriangleMeshShape(heap()));
      case 23:
        return keep(random.uniform(0, 1) < s(0.5)
                        ? static_cast<btCollisionShape*>(
                              new btTriangleShape(random.vector(1), random.vector(1), random.vector(1)))
                        : new btBU_Simplex1to4(random.vector(1), random.vector(1), random.vector(1), random.vector(1)));
      case 24: {
        auto* sum = new btMinkowskiSumShape(static_cast<btConvexShape*>(hull(5)),
                                            static_cast<btConvexShape*>(w.objects.box({s(0.2), s(0.2), s(0.3)})));
        sum->setTransformB(btTransform(btQuaternion(s(0.1), s(0.2), s(0.3))));
        return keep(sum);
      }
      case 25:
        return field(2, 1, false);  // diamonds
      case 26:
        return field(0, 0, false);
      default: {
        auto* inner = compound(w.objects.sphere(s(0.5)));
        return compound(inner);  // nested
      }
    }
  }
  btCollisionShape* hull(int points) {
    std::vector<btVector3> p;
    for (int i = 0; i < points; ++i) p.push_back(random.vector(1));
    return w.objects.hull(p);
  }
  btCollisionShape* compound(btCollisionShape* child) {
    auto* shape = static_cast<btCompoundShape*>(keep(new btCompoundShape));
    for (int i = 0; i < 3; ++i) {
      shape->addChildShape(
          btTransform(btQuaternion(random.vector(1).normalized(), random.uniform(-3, 3)), random.vector(0.6)),
          i == 1 ? w.objects.sphere(s(0.4)) : child);
    }
    return shape;
  }
  btTriangleMesh* heap() {
    meshes.push_back(std::make_unique<btTriangleMesh>());
    for (int i = 0; i < 12; ++i) meshes.back()->addTriangle(random.vector(1), random.vector(1), random.vector(1));
    return meshes.back().get();
  }
  // Or a grid of 200 triangles, one of them without area.
  btCollisionShape* mesh(bool isGrid) {
    if (!isGrid) return keep(new btBvhTriangleMeshShape(heap(), true));
    meshes.push_back(std::make_unique<btTriangleMesh>());
    btVector3 points[11][11];
    for (int x = 0; x < 11; ++x) {
      for (int z = 0; z < 11; ++z) points[x][z].setValue(s(0.3 * x - 1.5), random.uniform(-0.1, 0.1), s(0.3 * z - 1.5));
    }
    for (int x = 0; x < 10; ++x) {
      for (int z = 0; z < 10; ++z) {
        meshes.back()->addTriangle(points[x][z], points[x][z + 1], points[x + 1][z]);
        meshes.back()->addTriangle(points[x + 1][z], points[x][z + 1], points[x + 1][z + 1]);
      }
    }
    meshes.back()->addTriangle(points[0][0], points[0][0], points[10][10]);
    return keep(new btBvhTriangleMeshShape(meshes.back().get(), random.uniform(0, 1) < s(0.5)));
  }
  btCollisionShape* field(int pattern, int up, bool flipped) {
    heights.emplace_back();
    for (int i = 0; i < 9 * 7; ++i) heights.back().push_back(float(random.uniform(0, 2)));
    auto* shape =
        new btHeightfieldTerrainShape(9, 7, static_cast<const float*>(heights.back().data()), s(0), s(2), up, flipped);
    shape->setUseDiamondSubdivision(pattern == 2);
    shape->setFlipTriangleWinding(pattern == 1);
    btVector3 scaling(s(0.4), s(0.3), s(0.5));
    std::swap(scaling[1], scaling[up]);
    shape->setLocalScaling(scaling);
    return keep(shape);
  }
  btCollisionShape* spheres() {
    btVector3 centres[4];
    btScalar radii[4];
    for (int i = 0; i < 4; ++i) {
      centres[i] = random.vector(0.7);
      radii[i] = random.uniform(0.2, 0.6);
    }
    if (++spheresMade % 3 == 0) radii[1] = radii[2] = radii[3] = radii[0];
    auto* shape = new btMultiSphereShape(centres, radii, spheresMade % 4 + 1);
    if (spheresMade % 2) shape->setLocalScaling(btVector3(s(0.7), s(1.2), 1));
    return keep(shape);
  }
  btCollisionShape* scaled(btCollisionShape* inner) {
    return keep(new btUniformScalingShape(static_cast<btConvexShape*>(inner), random.uniform(0.5, 1.5)));
  }
  btCollisionShape* cloud() {
    clouds.emplace_back();
    for (int i = 0; i < 20; ++i) clouds.back().push_back(random.vector(1));
    return keep(new btConvexPointCloudShape(clouds.back().data(), 20, btVector3(s(0.8), s(0.8), s(0.8))));
  }
  btCollisionShape* keep(btCollisionShape* shape) {
    shapes.emplace_back(shape);
    return shape;
  }
  btRigidBody* add(btScalar mass, btCollisionShape* shape, const btVector3& at) {
    const btTransform pose = random.pose(at);
    const bool isPlane = shape->getShapeType() == STATIC_PLANE_PROXYTYPE;
    const bool isMesh = shape->isConcave();
    return w.objects.add(isMesh ? s(0) : mass, shape, isPlane ? btTransform::getIdentity() : pose);
  }

  GpuWorld w;
  Random random;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btTriangleMesh>> meshes;
  std::list<std::vector<float>> heights;
  std::list<std::vector<btVector3>> clouds;
  int spheresMade = 0;
};

}  // namespace btgpu::test
