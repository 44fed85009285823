// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Each shape that the device has by itself: rained on each ground, and thrown over it.
#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include "parts.h"

namespace scenes {
namespace {

// Half extents of a body.
struct Half {
  btScalar x, y, z;
  explicit Half(std::mt19937& random, double smallest = 0.4, double largest = 0.8) {
    std::uniform_real_distribution<double> size(smallest, largest);
    x = s(size(random));
    y = s(size(random));
    z = s(size(random));
  }
  operator btVector3() const { return btVector3(x, y, z); }
};

struct Kind {
  const char *name, *description;
  btCollisionShape* (*make)(Objects& o, std::mt19937& random, int number);
  // Of Bullet's 2D shapes, which are for worlds that move along x and y.
  bool flat = false;
};

btConvexHullShape* featuredHull(Objects& o, std::mt19937& random) {
  btConvexHullShape* hull = o.hull(randomHull(random, 12, Half(random)));
  hull->initializePolyhedralFeatures();
  return hull;
}

btCollisionShape* pointCloud(Objects& o, std::mt19937& random, int) {
  const auto points = randomHull(random, 14, Half(random));
  auto* kept = o.keep(std::make_unique<std::vector<btVector3>>(points));
  return o.shape<btConvexPointCloudShape>(kept->data(), static_cast<int>(kept->size()), btVector3(1, 1, 1));
}

btCollisionShape* convexMesh(Objects& o, std::mt19937& random, int) {
  const auto points = randomHull(random, 12, Half(random));
  auto* mesh = o.keep(std::make_unique<btTriangleMesh>());
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) mesh->addTriangle(points[i], points[i + 1], points[i + 2]);
  return o.shape<btConvexTriangleMeshShape>(mesh);
}

btCollisionShape* multiSphere(Objects& o, std::mt19937& random, int number) {
  const Half h(random);
  const btVector3 at[] = {btVector3(-h.x / 2, 0, 0), btVector3(h.x / 2, 0, 0), btVector3(0, 0, h.y / 2)};
  // Every other one with radii that are equal: then it is a triangle with a margin.
  const btScalar radii[] = {h.x / 2, number % 2 ? h.y / 2 : h.x / 2, number % 2 ? h.z / 2 : h.x / 2};
  return o.shape<btMultiSphereShape>(at, radii, 3);
}

btCollisionShape* scaled(Objects& o, std::mt19937& random, int number) {
  const Half h(random);
  const btVector3 half = btVector3(h) / 2;
  btConvexShape* child = nullptr;
  switch (number % 5) {
    case 0:
      child = o.box(half);
      break;
    case 1:
      child = o.sphere(half.x());
      break;
    case 2:
      child = o.shape<btCylinderShape>(btVector3(half.x(), half.y(), half.x()));
      break;
    case 3:
      child = o.shape<btConeShape>(half.x(), h.y);
      break;
    default:
      child = o.hull(randomHull(random, 12, half));
  }
  return o.shape<btUniformScalingShape>(child, s(1.5));
}

// Smaller than the others: turned in their plane, which half of the bodies share, they are not to begin in each other.
Half halfOfFlat(std::mt19937& random) { return Half(random, 0.25, 0.5); }

btCollisionShape* convex2d(Objects& o, std::mt19937& random, int number) {
  const Half h = halfOfFlat(random);
  if (number % 2) return o.shape<btConvex2dShape>(o.shape<btCylinderShapeZ>(btVector3(h.x, h.x, h.z)));
  std::vector<btVector3> points;
  for (const btVector3& p : prism(5 + number % 3, double(h.x), double(h.z))) {
    points.emplace_back(p.x(), p.z(), p.y());
  }
  return o.shape<btConvex2dShape>(o.hull(points));
}

btCollisionShape* sum(Objects& o, std::mt19937& random, int) {
  const btVector3 half = Half(random);
  btConvexShape* rounded = o.hull(randomHull(random, 10, half * s(0.7)));
  return o.shape<btMinkowskiSumShape>(rounded, o.box(half * s(0.3)));
}

const Kind kKinds[] = {
    {"box", "boxes", [](Objects& o, std::mt19937& random, int) -> btCollisionShape* { return o.box(Half(random)); }},
    {"sphere", "spheres",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* { return o.sphere(Half(random).x); }},
    {"capsule_x", "capsules along x",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btCapsuleShapeX>(h.x / 2, h.y);
     }},
    {"capsule_y", "capsules along y",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.capsule(h.x / 2, h.y);
     }},
    {"capsule_z", "capsules along z",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btCapsuleShapeZ>(h.x / 2, h.y);
     }},
    {"cylinder_x", "cylinders along x",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btCylinderShapeX>(btVector3(h.y, h.x, h.x));
     }},
    {"cylinder_y", "cylinders along y",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btCylinderShape>(btVector3(h.x, h.y, h.x));
     }},
    {"cylinder_z", "cylinders along z",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btCylinderShapeZ>(btVector3(h.x, h.x, h.y));
     }},
    {"cone_x", "cones along x",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btConeShapeX>(h.x, 2 * h.y);
     }},
    {"cone_y", "cones along y",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btConeShape>(h.x, 2 * h.y);
     }},
    {"cone_z", "cones along z",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const Half h(random);
       return o.shape<btConeShapeZ>(h.x, 2 * h.y);
     }},
    {"hull", "convex hulls",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       return o.hull(randomHull(random, 12, Half(random)));
     }},
    {"featured_hull", "convex hulls with polyhedral features",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* { return featuredHull(o, random); }},
    {"point_cloud", "point clouds", pointCloud},
    {"convex_mesh", "convex triangle meshes", convexMesh},
    {"multi_sphere", "multi-spheres", multiSphere},
    {"simplex", "tetrahedra",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const auto p = randomHull(random, 4, Half(random));
       return o.shape<btBU_Simplex1to4>(p[0], p[1], p[2], p[3]);
     }},
    {"triangle", "single triangles",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       const auto p = randomHull(random, 3, Half(random));
       return o.shape<btTriangleShape>(p[0], p[1], p[2]);
     }},
    {"scaled", "uniformly scaled shapes", scaled},
    {"sum", "Minkowski sums", sum},
    {"box_2d", "2D boxes",
     [](Objects& o, std::mt19937& random, int) -> btCollisionShape* {
       return o.shape<btBox2dShape>(halfOfFlat(random));
     },
     true},
    {"convex_2d", "other 2D shapes", convex2d, true},
    {"compound", "dumbbells, angles and jacks of several shapes",
     [](Objects& o, std::mt19937&, int number) {
       return number % 3 == 0 ? dumbbell(o) : number % 3 == 1 ? angle(o) : jack(o);
     }},
    {"nested_compound", "tables, whose legs are a compound of their own",
     [](Objects& o, std::mt19937&, int) { return table(o); }},
};

struct Ground {
  const char *name, *description;
  void (*add)(Objects& o, Size n);
  double lowest, lift;  // of the ground; of bodies that are not to begin in it
};

const Ground kGrounds[] = {
    {"plane", "a plane", [](Objects& o, Size) { addPlane(o); }, 0, 1},
    {"mesh", "a landscape of triangles", addMeshGround, kLowestGround, 2},
    {"heightfield", "a height field", addHeightFieldGround, kLowestGround, 2},
};

// Bullet gives triangles and sums no inertia: they get that of the box around them.
void giveInertia(btRigidBody& body) {
  if (!body.getInvInertiaDiagLocal().fuzzyZero()) return;
  btVector3 low, high, inertia;
  body.getCollisionShape()->getAabb(btTransform::getIdentity(), low, high);
  btBoxShape((high - low) / 2).calculateLocalInertia(1, inertia);
  body.setMassProps(1, inertia);
  body.updateInertiaTensor();
}

void keepInPlane(btRigidBody& body, const btTransform& at) {
  body.setLinearFactor(btVector3(1, 1, 0));
  body.setAngularFactor(btVector3(0, 0, 1));
  const btQuaternion turn(btVector3(0, 0, 1), at.getRotation().getAngle());
  body.setWorldTransform(btTransform(turn, at.getOrigin()));
  body.setInterpolationWorldTransform(body.getWorldTransform());
}

// Every other one without slip, if it is about as large as most are; the others slide.
void throwAlongX(btRigidBody& body, int number) {
  const btScalar speed = 3, radius = s(0.6);
  body.setLinearVelocity(btVector3(speed, 0, 0));
  if (number % 2) body.setAngularVelocity(btVector3(0, 0, -speed / radius));
}

void build(Objects& o, Size n, const Kind& kind, const Ground& ground, bool thrown) {
  ground.add(o, n);
  o.world().setGravity(kGravity);
  scatter(n, ground.lift + (thrown ? 0 : s(0.5)), [&](std::mt19937& random, int number, const btTransform& at) {
    btRigidBody* body = o.add(1, kind.make(o, random, number), at);
    giveInertia(*body);
    if (kind.flat) keepInPlane(*body, at);
    if (thrown) throwAlongX(*body, number);
    body->setFriction(s(0.6));
    // Without it spheres roll for ever on a plane, in stock too.
    body->setRollingFriction(thrown ? s(0.01) : s(0.1));
    body->setSpinningFriction(s(0.1));
  });
}

Scene sceneOf(const Kind& kind, const Ground& ground, bool thrown) {
  Scene scene;
  scene.name = std::string(thrown ? "roll_" : "rain_") + kind.name + "_on_" + ground.name;
  scene.description = std::string(kind.description) + (thrown ? " thrown over " : " rained on ") + ground.description;
  scene.size = thrown ? Size{4, 1, 4} : Size{4, 2, 4};
  scene.steps = thrown ? 240 : 600;  // until all lie still, as far as they do
  scene.timeStep = kStep;
  scene.expectations.comparableSteps = thrown ? 0 : 20;
  scene.expectations.groundHeight = ground.lowest;
  scene.expectations.comesToRest = thrown ? Rest::No : Rest::AsStock;
  scene.expectations.scattered = true;
  scene.build = [&kind, &ground, thrown](Objects& o, Size n) { build(o, n, kind, ground, thrown); };
  scene.benchmark = {thrown ? Size{32, 1, 32} : Size{14, 14, 14}, 240, thrown ? square : cube};
  return scene;
}

}  // namespace

std::vector<std::string> shapeNames() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

std::vector<std::string> groundNames() {
  std::vector<std::string> names;
  for (const Ground& ground : kGrounds) names.push_back(ground.name);
  return names;
}

std::vector<Scene> shapeScenes() {
  std::vector<Scene> scenes;
  for (const bool thrown : {false, true}) {
    for (const Kind& kind : kKinds) {
      for (const Ground& ground : kGrounds) scenes.push_back(sceneOf(kind, ground, thrown));
    }
  }
  return scenes;
}

}  // namespace scenes
