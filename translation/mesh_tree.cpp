// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "mesh_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace btgpu {
namespace {

// Parts are no smaller, and a mesh has no more than about twice so many: work for a device, and little to look through.
constexpr std::size_t kLeastPart = 256, kParts = 64;

struct Box {
  std::array<float, 3> lower, upper;
};

Box merge(const Box& a, const Box& b) {
  Box m = a;
  for (std::size_t k = 0; k < 3; ++k) {
    m.lower[k] = std::min(a.lower[k], b.lower[k]);
    m.upper[k] = std::max(a.upper[k], b.upper[k]);
  }
  return m;
}

Box boxOf(const MeshTriangle& t) {
  const auto point = [](const float4& p) { return Box{{p.x, p.y, p.z}, {p.x, p.y, p.z}}; };
  return merge(point(t.a), merge(point(t.b), point(t.c)));
}

// Steps of the mesh's grid, so that a node's box covers what is in it.
class Grid {
 public:
  Grid(const Box& all, Mesh& mesh) {
    for (std::size_t k = 0; k < 3; ++k) {
      m_lower[k] = all.lower[k];
      const double extent = double(all.upper[k]) - all.lower[k];
      m_perStep[k] = extent > 0 ? std::min(double(MESH_GRID) / extent, 1e30) : 0;
    }
    mesh.lower = {all.lower[0], all.lower[1], all.lower[2], 0};
    mesh.perStep = {static_cast<float>(m_perStep[0]), static_cast<float>(m_perStep[1]),
                    static_cast<float>(m_perStep[2]), 0};
  }
  void write(const Box& box, MeshNode& node) const {
    node.x = range(box, 0);
    node.y = range(box, 1);
    node.z = range(box, 2);
  }

 private:
  uint range(const Box& box, std::size_t k) const {
    const double lower = std::floor((double(box.lower[k]) - m_lower[k]) * m_perStep[k]);
    const double upper = std::ceil((double(box.upper[k]) - m_lower[k]) * m_perStep[k]);
    const auto step = [](double v) { return static_cast<uint>(std::clamp(v, 0.0, double(MESH_GRID))); };
    return step(lower) | step(upper) << 16;
  }
  double m_lower[3], m_perStep[3];
};

class Builder {
 public:
  explicit Builder(std::vector<MeshTriangle> triangles) : m_triangles(std::move(triangles)) {
    for (const MeshTriangle& t : m_triangles) m_boxes.push_back(boxOf(t));
    m_order.resize(m_triangles.size());
    std::iota(m_order.begin(), m_order.end(), 0u);
    m_partSize = std::max(kLeastPart, m_triangles.size() / kParts);
  }

  MeshTree build() {
    m_tree.mesh.triangleCount = static_cast<int>(m_triangles.size());
    if (!m_triangles.empty()) add(0, m_triangles.size(), false);
    for (const uint i : m_order) m_tree.triangles.push_back(m_triangles[i]);
    m_tree.mesh.nodeCount = static_cast<int>(m_tree.nodes.size());
    m_tree.mesh.partCount = static_cast<int>(m_tree.parts.size());
    refitMeshTree(m_tree);
    return std::move(m_tree);
  }

 private:
  // The subtree over m_order[first, last), halved at the middle of the centres along the axis where they spread most.
  void add(std::size_t first, std::size_t last, bool inPart) {
    const std::size_t node = m_tree.nodes.size(), part = m_tree.parts.size();
    m_tree.nodes.push_back({});
    const bool beginsPart = !inPart && last - first <= m_partSize;
    if (beginsPart) m_tree.parts.push_back({static_cast<int>(node), 0});
    if (last - first == 1) {
      m_tree.nodes[node].link = static_cast<int>(first);
    } else {
      const std::size_t axis = widestAxis(first, last), middle = first + (last - first) / 2;
      const auto at = [&](std::size_t i) { return m_order.begin() + static_cast<std::ptrdiff_t>(i); };
      const auto centre = [&](uint i) { return m_boxes[i].lower[axis] + m_boxes[i].upper[axis]; };
      std::nth_element(at(first), at(middle), at(last),
                       [&](uint a, uint b) { return std::make_pair(centre(a), a) < std::make_pair(centre(b), b); });
      add(first, middle, inPart || beginsPart);
      add(middle, last, inPart || beginsPart);
      m_tree.nodes[node].link = -static_cast<int>(m_tree.nodes.size() - node);
    }
    if (beginsPart) m_tree.parts[part].nodeCount = static_cast<int>(m_tree.nodes.size() - node);
  }

  std::size_t widestAxis(std::size_t first, std::size_t last) const {
    std::size_t widest = 0;
    float most = -1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float lower = INFINITY, upper = -INFINITY;
      for (std::size_t i = first; i < last; ++i) {
        const float centre = m_boxes[m_order[i]].lower[axis] + m_boxes[m_order[i]].upper[axis];
        lower = std::min(lower, centre);
        upper = std::max(upper, centre);
      }
      if (!(upper - lower > most)) continue;
      most = upper - lower;
      widest = axis;
    }
    return widest;
  }

  std::vector<MeshTriangle> m_triangles;
  std::vector<Box> m_boxes;
  std::vector<uint> m_order;
  std::size_t m_partSize;
  MeshTree m_tree{};
};

}  // namespace

MeshTree makeMeshTree(std::vector<MeshTriangle> triangles) { return Builder(std::move(triangles)).build(); }

void refitMeshTree(MeshTree& tree) {
  tree.lower = tree.upper = {0, 0, 0, 0};
  tree.mesh.lower = tree.mesh.perStep = {0, 0, 0, 0};
  if (tree.triangles.empty()) return;
  // Children lie behind their parents, and a parent's second child where its first one ends.
  std::vector<Box> boxes(tree.nodes.size());
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {
    const int link = tree.nodes[i].link;
    if (link >= 0) {
      boxes[i] = boxOf(tree.triangles[static_cast<std::size_t>(link)]);
      continue;
    }
    const int firstLink = tree.nodes[i + 1].link;
    boxes[i] = merge(boxes[i + 1], boxes[i + 1 + (firstLink < 0 ? static_cast<std::size_t>(-firstLink) : 1)]);
  }
  const Box& all = boxes.front();
  tree.lower = {all.lower[0], all.lower[1], all.lower[2], 0};
  tree.upper = {all.upper[0], all.upper[1], all.upper[2], 0};
  const Grid grid(all, tree.mesh);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) grid.write(boxes[i], tree.nodes[i]);
}

int appendMesh(const MeshTree& tree, MeshArrays& to) {
  Mesh mesh = tree.mesh;
  mesh.firstTriangle = static_cast<int>(to.triangles.size());
  mesh.firstNode = static_cast<int>(to.nodes.size());
  mesh.firstPart = static_cast<int>(to.parts.size());
  to.triangles.insert(to.triangles.end(), tree.triangles.begin(), tree.triangles.end());
  to.nodes.insert(to.nodes.end(), tree.nodes.begin(), tree.nodes.end());
  to.parts.insert(to.parts.end(), tree.parts.begin(), tree.parts.end());
  to.meshes.push_back(mesh);
  to.changed = true;
  return static_cast<int>(to.meshes.size()) - 1;
}

}  // namespace btgpu
