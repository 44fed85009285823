// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include "walker.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
constexpr double kSize = 0.5;  // half an extent of what moves

// A class of the application's own: its contacts are the host's.
class OwnBox : public btBoxShape {
 public:
  using btBoxShape::btBoxShape;
};

btTransform partPose(RandomSource& random, double spread) {
  const btVector3 at(scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1));
  return btTransform(btQuaternion(halfExtents(random, 1).normalized(), scalarIn(random, -3, 3)), at * s(spread));
}

btTriangleMesh* hills(ShapeStore& store, RandomSource& random) {
  constexpr int kCorners = 7;
  btVector3 points[kCorners][kCorners];
  for (int x = 0; x < kCorners; ++x) {
    for (int z = 0; z < kCorners; ++z) {
      points[x][z].setValue(s(x - kCorners / 2), scalarIn(random, -0.3, 0.3), s(z - kCorners / 2));
    }
  }
  auto* mesh = store.make<btTriangleMesh>();
  for (int x = 0; x + 1 < kCorners; ++x) {
    for (int z = 0; z + 1 < kCorners; ++z) {
      mesh->addTriangle(points[x][z], points[x][z + 1], points[x + 1][z]);
      mesh->addTriangle(points[x + 1][z], points[x][z + 1], points[x + 1][z + 1]);
    }
  }
  return mesh;
}

btCollisionShape* field(ShapeStore& store, RandomSource& random) {
  constexpr int kCorners = 7;
  auto* heights = store.make<std::vector<float>>();
  for (int i = 0; i < kCorners * kCorners; ++i) heights->push_back(float(uniformIn(random, -0.3, 0.3)));
  const auto* first = static_cast<const float*>(heights->data());
  return store.make<btHeightfieldTerrainShape>(kCorners, kCorners, first, s(-0.3), s(0.3), 1, random() % 2 == 0);
}

// Of parts that are shapes of their own, and may be convex, or compounds.
void makeCompound(WalkShape& out, RandomSource& random, bool nested) {
  auto* compound = out.store.make<btCompoundShape>(random() % 4 != 0);
  const int parts = 1 + static_cast<int>(random() % 3);
  const auto convex = static_cast<unsigned>(walkConvexKinds().size());
  for (int i = 0; i < parts; ++i) {
    const bool inner = nested && i == 0;
    auto part = inner ? std::make_shared<WalkShape>() : makeWalkShape(static_cast<int>(random() % convex), random);
    if (inner) makeCompound(*part, random, false);
    compound->addChildShape(partPose(random, 0.5), part->shape);
    out.parts.push_back(part);
  }
  out.shape = out.compound = compound;
}

struct OtherKind {
  const char* name;
  bool movable;
  void (*make)(WalkShape& out, RandomSource& random);
};

const OtherKind kOthers[] = {
    {"compound", true, [](WalkShape& out, RandomSource& random) { makeCompound(out, random, false); }},
    {"compound", true, [](WalkShape& out, RandomSource& random) { makeCompound(out, random, false); }},
    {"nested compound", true, [](WalkShape& out, RandomSource& random) { makeCompound(out, random, true); }},
    {"empty", false, [](WalkShape& out, RandomSource&) { out.shape = out.store.make<btEmptyShape>(); }},
    {"own box", true,
     [](WalkShape& out, RandomSource& random) { out.shape = out.store.make<OwnBox>(halfExtents(random, kSize)); }},
    {"mesh", false,
     [](WalkShape& out, RandomSource& random) {
       out.shape = out.store.make<btBvhTriangleMeshShape>(hills(out.store, random), random() % 2 == 0);
     }},
    {"scaled mesh", false,
     [](WalkShape& out, RandomSource& random) {
       auto* mesh = out.store.make<btBvhTriangleMeshShape>(hills(out.store, random), true);
       out.shape =
           out.store.make<btScaledBvhTriangleMeshShape>(mesh, btVector3(s(1.2), scalarIn(random, 0.5, 1.5), s(0.8)));
     }},
    {"multi-material mesh", false,
     [](WalkShape& out, RandomSource& random) {
       out.shape = out.store.make<btMultimaterialTriangleMeshShape>(hills(out.store, random), true);
     }},
    {"height field", false, [](WalkShape& out, RandomSource& random) { out.shape = field(out.store, random); }},
    {"plane", false,
     [](WalkShape& out, RandomSource& random) {
       const btVector3 normal(scalarIn(random, -0.1, 0.1), 1, scalarIn(random, -0.1, 0.1));
       out.shape = out.store.make<btStaticPlaneShape>(normal.normalized(), s(-1));
     }},
};

}  // namespace

// Bullet's 2D shapes are for worlds that move in a plane; where two of them meet otherwise, stock sees them along z and
// btgpu as they are (tests/convex/shape_kinds.h). Scenes rain_box_2d_on_... have them. A sum with a cone or cylinder in
// it has a larger AABB in btgpu than in stock (Shapes.BoundsAreBullets), which joins islands sooner.
const std::vector<ShapeKind>& walkConvexKinds() {
  static const std::vector<ShapeKind> kinds = [] {
    std::vector<ShapeKind> all = convexKinds();
    all.erase(std::remove_if(all.begin(), all.end(),
                             [](const ShapeKind& k) { return k.name.rfind("2D", 0) == 0 || k.name == "round sum"; }),
              all.end());
    return all;
  }();
  return kinds;
}

btVector3 inertiaOf(const btCollisionShape& shape, btScalar mass) {
  btVector3 inertia(0, 0, 0);
  shape.calculateLocalInertia(mass, inertia);
  for (int k = 0; k < 3; ++k) {
    if (!(inertia[k] > s(0))) inertia[k] = mass * s(0.1);
  }
  return inertia;
}

int walkShapeCount() { return static_cast<int>(walkConvexKinds().size() + std::size(kOthers)); }

std::shared_ptr<WalkShape> makeWalkShape(int which, RandomSource& random) {
  const std::vector<ShapeKind>& convex = walkConvexKinds();
  auto made = std::make_shared<WalkShape>();
  const auto index = static_cast<std::size_t>(which);
  if (index < convex.size()) {
    made->name = convex[index].name;
    made->shape = convex[index].make(made->store, random, kSize);
    return made;
  }
  if (index >= convex.size() + std::size(kOthers)) return nullptr;
  const OtherKind& kind = kOthers[index - convex.size()];
  made->name = kind.name;
  made->movable = kind.movable;
  kind.make(*made, random);
  return made;
}

}  // namespace btgpu::test
