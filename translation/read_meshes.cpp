// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_meshes.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "convert.h"
#include "exact_type.h"
#include "hash.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// Four chains side by side, so that memory is what it waits for.
std::uint64_t hashOf(WatchedBytes bytes) {
  std::uint64_t chains[4] = {1, 2, 3, 4};
  std::size_t at = 0;
  for (; at + sizeof chains <= bytes.count; at += sizeof chains) {
    std::uint64_t words[4];
    std::memcpy(words, bytes.first + at, sizeof words);
    for (int k = 0; k < 4; ++k) mixWord(chains[k], words[k]);
  }
  for (; at < bytes.count; ++at) mixWord(chains[at % 4], bytes.first[at]);
  for (int k = 1; k < 4; ++k) mixWord(chains[0], chains[k]);
  return chains[0];
}

bool same(const std::vector<WatchedBytes>& a, const std::vector<WatchedBytes>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](WatchedBytes x, WatchedBytes y) { return x.first == y.first && x.count == y.count; });
}

std::size_t sizeOf(PHY_ScalarType type) {
  switch (type) {
    case PHY_DOUBLE:
      return 8;
    case PHY_FLOAT:
    case PHY_INTEGER:
      return 4;
    case PHY_SHORT:
      return 2;
    case PHY_UCHAR:
      return 1;
    default:
      return 0;
  }
}

// All but what a stride leaves out behind the last element.
WatchedBytes elementsOf(const unsigned char* first, int count, int stride, PHY_ScalarType type) {
  if (!first || count <= 0) return {nullptr, 0};
  return {first,
          static_cast<std::size_t>(count - 1) * static_cast<std::size_t>(std::max(0, stride)) + 3 * sizeOf(type)};
}

std::vector<WatchedBytes> memoryOf(const btStridingMeshInterface& mesh) {
  std::vector<WatchedBytes> memory;
  for (int part = 0; part < mesh.getNumSubParts(); ++part) {
    const unsigned char *vertices = nullptr, *indices = nullptr;
    int vertexCount = 0, vertexStride = 0, indexStride = 0, faceCount = 0;
    PHY_ScalarType vertexType = PHY_FLOAT, indexType = PHY_INTEGER;
    mesh.getLockedReadOnlyVertexIndexBase(&vertices, vertexCount, vertexType, vertexStride, &indices, indexStride,
                                          faceCount, indexType, part);
    memory.push_back(elementsOf(vertices, vertexCount, vertexStride, vertexType));
    memory.push_back(elementsOf(indices, faceCount, indexStride, indexType));
    mesh.unLockReadOnlyVertexBase(part);
  }
  return memory;
}

// Bullet keeps a height field's numbers protected; a derived class may name them.
struct Heights : btHeightfieldTerrainShape {
  static auto width() { return &Heights::m_heightStickWidth; }
  static auto length() { return &Heights::m_heightStickLength; }
  static auto type() { return &Heights::m_heightDataType; }
  static auto flipped() { return &Heights::m_flipQuadEdges; }
  static auto diamonds() { return &Heights::m_useDiamondSubdivision; }
  static auto zigzag() { return &Heights::m_useZigzagSubdivision; }
  static auto winding() { return &Heights::m_flipTriangleWinding; }
};

bool isFinite(const float4& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Takes the triangles down, scaled. Those with a corner that is not finite are none: nothing can touch them.
class Collector : public btTriangleCallback, public btInternalTriangleIndexCallback {
 public:
  explicit Collector(const btVector3& scaling) : m_scaling(scaling) {}
  void processTriangle(btVector3* corners, int part, int index) override { add(corners, part, index); }
  void internalProcessTriangleIndex(btVector3* corners, int part, int index) override { add(corners, part, index); }
  std::vector<MeshTriangle> triangles;

 private:
  void add(const btVector3* corners, int part, int index) {
    const MeshTriangle t = {toFloat4(corners[0] * m_scaling),
                            toFloat4(corners[1] * m_scaling),
                            toFloat4(corners[2] * m_scaling),
                            part,
                            index,
                            {0, 0}};
    if (isFinite(t.a) && isFinite(t.b) && isFinite(t.c)) triangles.push_back(t);
  }
  btVector3 m_scaling;
};

const btVector3 kOne(1, 1, 1);

}  // namespace

bool MemoryWatch::changed(const std::vector<WatchedBytes>& memory) {
  const bool anew = m_hashes.empty() || !same(memory, m_memory);
  if (anew) {
    m_memory = memory;
    m_blocks.clear();
    for (const WatchedBytes& bytes : memory) {
      for (std::size_t at = 0; at < bytes.count; at += kBlock) {
        m_blocks.push_back({bytes.first + at, std::min(kBlock, bytes.count - at)});
      }
    }
    m_hashes.assign(m_blocks.size() + 1, 0);  // never empty
    m_next = 0;
  }
  const std::size_t all = m_blocks.size(), count = anew ? all : std::min(all, kAtOnce / kBlock), first = m_next;
  std::vector<unsigned char> differs(count, 0);
  constexpr std::size_t kGrain = 4;
  parallelFor(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t block = (first + i) % all;
      const std::uint64_t hash = hashOf(m_blocks[block]);
      differs[i] = m_hashes[block] != hash;
      m_hashes[block] = hash;
    }
  });
  if (all > 0) m_next = (first + count) % all;
  if (!anew && std::find(differs.begin(), differs.end(), 1) == differs.end()) return false;
  // What else has changed is to be read along with it.
  if (!anew && count < all) {
    parallelFor(all, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t block = begin; block < end; ++block) m_hashes[block] = hashOf(m_blocks[block]);
    });
  }
  return true;
}

bool MeshReader::Settings::operator==(const Settings& o) const {
  return from == o.from && std::memcmp(&scaling, &o.scaling, 3 * sizeof(btScalar)) == 0 &&
         std::memcmp(&inner, &o.inner, 3 * sizeof(btScalar)) == 0 &&
         std::memcmp(numbers, o.numbers, sizeof numbers) == 0;
}

// Where a shape's triangles come from.
struct MeshReader::Source {
  Settings settings;
  std::vector<WatchedBytes> memory;
  const btStridingMeshInterface* mesh = nullptr;
  const btHeightfieldTerrainShape* heights = nullptr;  // one of the two
};

bool MeshReader::open(const btCollisionShape& shape, Source& s) {
  if (isExactly<btHeightfieldTerrainShape>(shape)) {
    s.heights = static_cast<const btHeightfieldTerrainShape*>(&shape);
    const auto& h = *s.heights;
    const int width = h.*Heights::width(), length = h.*Heights::length(), type = h.*Heights::type();
    s.settings.from = h.getHeightfieldRawData();
    s.settings.scaling = h.getLocalScaling();
    const int numbers[] = {width,
                           length,
                           type,
                           h.*Heights::flipped(),
                           h.*Heights::diamonds(),
                           h.*Heights::zigzag(),
                           h.*Heights::winding(),
                           h.getUpAxis()};
    std::copy(std::begin(numbers), std::end(numbers), s.settings.numbers);
    s.memory = {{h.getHeightfieldRawData(), static_cast<std::size_t>(width) * static_cast<std::size_t>(length) *
                                                sizeOf(static_cast<PHY_ScalarType>(type))}};
    return true;
  }
  const btBvhTriangleMeshShape* mesh = nullptr;
  s.settings.scaling = kOne;
  if (isExactly<btScaledBvhTriangleMeshShape>(shape)) {
    const auto& scaled = static_cast<const btScaledBvhTriangleMeshShape&>(shape);
    mesh = scaled.getChildShape();
    s.settings.scaling = scaled.getLocalScaling();
  } else if (isExactly<btBvhTriangleMeshShape, btMultimaterialTriangleMeshShape>(shape)) {
    mesh = static_cast<const btBvhTriangleMeshShape*>(&shape);
  }
  if (!mesh || !isExactly<btBvhTriangleMeshShape, btMultimaterialTriangleMeshShape>(*mesh)) return false;
  s.mesh = mesh->getMeshInterface();
  s.settings.from = s.mesh;
  s.settings.inner = s.mesh->getScaling();
  s.memory = memoryOf(*s.mesh);
  return true;
}

std::vector<MeshTriangle> MeshReader::trianglesOf(const Source& source) {
  const btVector3 large(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  if (source.heights) {
    Collector collector(kOne);
    source.heights->processAllTriangles(&collector, -large, large);
    return std::move(collector.triangles);
  }
  Collector collector(source.settings.scaling);
  source.mesh->InternalProcessAllTriangles(&collector, -large, large);
  return std::move(collector.triangles);
}

bool MeshReader::convert(const btCollisionShape& shape, std::uint32_t index, MeshArrays& meshes, Shape& out,
                         const char*& why) {
  Source source;
  if (!open(shape, source)) {
    drop(index);
    return false;
  }
  const auto known = m_entries.find(index);
  const bool settingsSame = known != m_entries.end() && known->second.settings == source.settings;
  Entry& entry = m_entries[index];
  if (entry.watch.changed(source.memory) || !settingsSame) {
    m_dead += entry.tree.triangles.size();
    std::vector<MeshTriangle> triangles = trianglesOf(source);
    if (triangles.size() > MESH_MAX_TRIANGLES) {
      drop(index);
      why = "more than 16,777,215 triangles: contacts by Bullet's own algorithm on the CPU";
      return false;
    }
    entry.settings = source.settings;
    entry.tree = makeMeshTree(std::move(triangles));
    entry.place = appendMesh(entry.tree, meshes);
  }
  out = Shape{};
  out.type = SHAPE_MESH;
  out.margin = static_cast<float>(shape.getMargin());
  out.firstVertex = entry.place;
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  out.centre = toFloat4((upper + lower) * btScalar(0.5));
  if (isFinite(out.extents) && isFinite(out.centre)) return true;
  // Bullet's box has a corner that is not finite in it. Ours is that of the triangles that there are.
  const float4 &a = entry.tree.lower, &b = entry.tree.upper;
  out.extents = {(b.x - a.x) * 0.5f + out.margin, (b.y - a.y) * 0.5f + out.margin, (b.z - a.z) * 0.5f + out.margin, 0};
  out.centre = {(a.x + b.x) * 0.5f, (a.y + b.y) * 0.5f, (a.z + b.z) * 0.5f, 0};
  return true;
}

void MeshReader::drop(std::uint32_t index) {
  const auto it = m_entries.find(index);
  if (it == m_entries.end()) return;
  m_dead += it->second.tree.triangles.size();
  m_entries.erase(it);
}

bool MeshReader::reclaim(MeshArrays& meshes) {
  constexpr std::size_t kDead = 4096;  // triangles that are not worth it
  if (m_dead < meshes.triangles.size() / 2 + kDead) return false;
  meshes = MeshArrays{};
  meshes.changed = true;
  m_dead = 0;
  for (auto& [index, entry] : m_entries) entry.place = appendMesh(entry.tree, meshes);
  return true;
}

// For rays Bullet halves a cell of a diamond or zigzag field along its other diagonal, or as if it were none, winds its
// triangles by how it is halved alone, and walks over a field whose x axis points up as if that were level.
HeightFieldRays raysThrough(const btHeightfieldTerrainShape& heights) {
  const bool flipped = heights.*Heights::flipped();
  const bool patterned = heights.*Heights::diamonds() || heights.*Heights::zigzag();
  return {heights.getUpAxis() != 0 && (flipped || !patterned), flipped != heights.*Heights::winding()};
}

void MeshReader::clear() {
  m_entries.clear();
  m_dead = 0;
}

BTGPU_TRANSLATION_END
