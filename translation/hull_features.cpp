// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "hull_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace btgpu {
namespace {

// Points are put on a grid as fine as float, so that on which side of a plane a point lies is decided exactly, and the
// hull has the shape of one whatever the rounding: coordinates of 24 bits and sign make determinants of 79.
__extension__ typedef __int128 Wide;
constexpr double kGrid = 8388608;  // steps from the middle to the end

// In proportion to the hull's size: what floats tell apart, and within how much of a plane points count as on it.
constexpr double kSame = 4e-7, kCoplanar = 2e-6;

struct Vec {
  double x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(Vec a) { return std::sqrt(dot(a, a)); }
Vec unit(Vec a) { return a * (1 / length(a)); }
Vec acrossTo(Vec u) {
  const Vec axis = std::fabs(u.x) < 0.6 ? Vec{1, 0, 0} : Vec{0, 1, 0};
  return unit(cross(u, axis));
}
float4 toFloat4(Vec v, double w = 0) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

class Builder {
 public:
  explicit Builder(const std::vector<float4>& points) {
    for (const float4& p : points) m_points.push_back({p.x, p.y, p.z});
  }
  HullFeatures build();

 private:
  struct Triangle {
    std::array<uint, 3> corners;  // anticlockwise from outside
    Vec normal;
    double at;
    bool gone = false;
    uint farthest = 0;  // point outside it
    Wide outside = 0;   // by this much: volume
  };
  using Side = std::pair<uint, uint>;

  uint farthestAlong(Vec direction) const;
  // Corner points of a first tetrahedron; fewer where the points lie on a plane, on a line or in one place.
  std::vector<uint> firstCorners() const;
  void addPoint(uint p);
  void addSegment(uint p, uint q);
  void addPolygon(Vec normal);
  void addPolyhedron(const std::array<uint, 4>& corners);
  void addTriangle(uint a, uint b, uint c);
  void putOnGrid();
  // Six times the volume of the tetrahedron: positive if d is in front of the triangle.
  Wide volume(uint a, uint b, uint c, uint d) const;
  void growBy(uint point, size_t seenFrom);
  std::vector<uint> groupTriangles() const;  // lowest triangle of the face that each belongs to
  void addFaces(const std::vector<uint>& group);

  uint vertexOf(uint point);
  void addFace(Vec normal, double at, const std::vector<uint>& corners);
  void addEdge(uint from, uint to, Vec normalA, Vec normalB);

  std::vector<Vec> m_points;
  double m_size = 0;
  std::vector<std::array<std::int64_t, 3>> m_grid;  // points
  std::vector<Triangle> m_triangles;
  std::map<Side, size_t> m_sides;   // directed side -> triangle
  std::map<uint, uint> m_vertices;  // point -> vertex of the result
  HullFeatures m_out;
};

uint Builder::farthestAlong(Vec direction) const {
  uint best = 0;
  for (uint i = 1; i < m_points.size(); ++i) {
    if (dot(m_points[i], direction) > dot(m_points[best], direction)) best = i;
  }
  return best;
}

std::vector<uint> Builder::firstCorners() const {
  const double tiny = kSame * m_size;
  // The two ends of the longest of three axes, then always the point farthest from what there is.
  uint a = 0, b = 0;
  for (const Vec axis : {Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}}) {
    const uint low = farthestAlong(axis * -1), high = farthestAlong(axis);
    if (length(m_points[high] - m_points[low]) > length(m_points[b] - m_points[a])) {
      a = low;
      b = high;
    }
  }
  if (length(m_points[b] - m_points[a]) <= tiny) return {a};
  const Vec u = unit(m_points[b] - m_points[a]);
  const auto offLine = [&](uint i) { return length(cross(u, m_points[i] - m_points[a])); };
  uint c = a;
  for (uint i = 0; i < m_points.size(); ++i) {
    if (offLine(i) > offLine(c)) c = i;
  }
  if (offLine(c) <= tiny) return {farthestAlong(u * -1), farthestAlong(u)};
  const Vec n = unit(cross(u, m_points[c] - m_points[a]));
  const auto offPlane = [&](uint i) { return std::fabs(dot(n, m_points[i] - m_points[a])); };
  uint d = a;
  for (uint i = 0; i < m_points.size(); ++i) {
    if (offPlane(i) > offPlane(d)) d = i;
  }
  // The plane through three points is no better than they are: of a narrow triangle it may tilt.
  if (offPlane(d) <= tiny * std::max(1.0, m_size / offLine(c) * 0.1)) return {a, b, c};
  return {a, b, c, d};
}

uint Builder::vertexOf(uint point) {
  const auto [it, isNew] = m_vertices.try_emplace(point, static_cast<uint>(m_out.vertices.size()));
  if (isNew) m_out.vertices.push_back(toFloat4(m_points[point]));
  return it->second;
}

void Builder::addFace(Vec normal, double at, const std::vector<uint>& corners) {
  HullFace face{};
  face.plane = toFloat4(normal, at);
  face.firstCorner = static_cast<int>(m_out.corners.size());
  face.cornerCount = static_cast<int>(corners.size());
  for (const uint c : corners) m_out.corners.push_back(vertexOf(c));
  m_out.faces.push_back(face);
}

void Builder::addEdge(uint from, uint to, Vec normalA, Vec normalB) {
  HullEdge edge{};
  edge.normalA = toFloat4(normalA);
  edge.normalB = toFloat4(normalB);
  edge.from = static_cast<int>(vertexOf(from));
  edge.to = static_cast<int>(vertexOf(to));
  m_out.edges.push_back(edge);
}

void Builder::addPoint(uint p) {
  for (const Vec axis : {Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}}) {
    for (const double sign : {1.0, -1.0}) addFace(axis * sign, dot(axis, m_points[p]) * sign, {p});
  }
}

void Builder::addSegment(uint p, uint q) {
  const Vec u = unit(m_points[q] - m_points[p]), v = acrossTo(u), w = cross(u, v);
  const Vec around[] = {v, w, v * -1, w * -1};
  addFace(u, dot(u, m_points[q]), {q});
  addFace(u * -1, -dot(u, m_points[p]), {p});
  for (int k = 0; k < 4; ++k) {
    const Vec normal = around[k], next = around[(k + 1) % 4];
    addFace(normal, dot(normal, m_points[p]), {p, q});
    // Its direction is next x normal = -u.
    addEdge(q, p, normal, next);
  }
}

// All points on one plane: the polygon around them, by Andrew's monotone chain.
void Builder::addPolygon(Vec normal) {
  const Vec u = acrossTo(normal), v = cross(normal, u);
  std::vector<uint> order(m_points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto at = [&](uint i) { return std::make_pair(dot(u, m_points[i]), dot(v, m_points[i])); };
  std::sort(order.begin(), order.end(),
            [&](uint a, uint b) { return std::make_pair(at(a), a) < std::make_pair(at(b), b); });
  // How far p lies to the left of the line from a to b.
  const auto left = [&](uint a, uint b, uint p) {
    const double x = at(b).first - at(a).first, y = at(b).second - at(a).second;
    return (x * (at(p).second - at(a).second) - y * (at(p).first - at(a).first)) / std::max(1e-300, std::hypot(x, y));
  };
  std::vector<uint> loop;
  const auto walk = [&](size_t keep) {
    for (const uint p : order) {
      if (loop.size() > keep && length(m_points[p] - m_points[loop.back()]) <= kSame * m_size) continue;
      while (loop.size() >= keep + 2 && left(loop[loop.size() - 2], loop.back(), p) <= kSame * m_size) loop.pop_back();
      loop.push_back(p);
    }
    loop.pop_back();  // the next walk begins there
  };
  walk(0);
  std::reverse(order.begin(), order.end());
  walk(loop.size());
  const double plane = dot(normal, m_points[loop[0]]);
  addFace(normal, plane, loop);
  for (size_t k = 0; k < loop.size(); ++k) {
    const uint p = loop[k], q = loop[(k + 1) % loop.size()];
    const Vec outward = unit(cross(m_points[q] - m_points[p], normal));
    // Directions outward x normal and -normal x outward: both against the loop's.
    addEdge(q, p, normal, outward);
    addEdge(q, p, outward, normal * -1);
  }
  std::reverse(loop.begin(), loop.end());
  addFace(normal * -1, -plane, loop);
}

void Builder::addTriangle(uint a, uint b, uint c) {
  Triangle t;
  t.corners = {a, b, c};
  t.normal = cross(m_points[b] - m_points[a], m_points[c] - m_points[a]);
  const double twiceArea = length(t.normal);
  t.normal = twiceArea > 0 ? t.normal * (1 / twiceArea) : Vec{0, 0, 0};
  t.at = dot(t.normal, m_points[a]);
  for (uint i = 0; i < m_points.size(); ++i) {
    const Wide outside = volume(a, b, c, i);
    if (outside <= t.outside) continue;
    t.outside = outside;
    t.farthest = i;
  }
  const size_t index = m_triangles.size();
  m_triangles.push_back(t);
  for (int k = 0; k < 3; ++k)
    m_sides[{t.corners[static_cast<size_t>(k)], t.corners[static_cast<size_t>((k + 1) % 3)]}] = index;
}

void Builder::putOnGrid() {
  Vec lower = m_points[0], upper = m_points[0];
  for (const Vec& p : m_points) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
  const Vec middle = (lower + upper) * 0.5, reach = (upper - lower) * 0.5;
  const double scale = kGrid / std::max({reach.x, reach.y, reach.z});
  for (const Vec& p : m_points) {
    const Vec at = (p - middle) * scale;
    m_grid.push_back({std::llround(at.x), std::llround(at.y), std::llround(at.z)});
  }
}

Wide Builder::volume(uint a, uint b, uint c, uint d) const {
  std::array<std::int64_t, 3> u, v, w;
  for (size_t k = 0; k < 3; ++k) {
    u[k] = m_grid[b][k] - m_grid[a][k];
    v[k] = m_grid[c][k] - m_grid[a][k];
    w[k] = m_grid[d][k] - m_grid[a][k];
  }
  return Wide(u[1] * v[2] - u[2] * v[1]) * w[0] + Wide(u[2] * v[0] - u[0] * v[2]) * w[1] +
         Wide(u[0] * v[1] - u[1] * v[0]) * w[2];
}

// Replaces the triangles that the point sees, found from one of them, by those between their border and the point.
void Builder::growBy(uint point, size_t seenFrom) {
  std::vector<size_t> seen = {seenFrom};
  m_triangles[seenFrom].gone = true;
  std::vector<Side> border;
  for (size_t n = 0; n < seen.size(); ++n) {
    const std::array<uint, 3> corners = m_triangles[seen[n]].corners;
    for (size_t k = 0; k < 3; ++k) {
      const Side side = {corners[k], corners[(k + 1) % 3]};
      const size_t other = m_sides.at({side.second, side.first});
      Triangle& neighbour = m_triangles[other];
      if (neighbour.gone) continue;
      if (volume(neighbour.corners[0], neighbour.corners[1], neighbour.corners[2], point) > 0) {
        neighbour.gone = true;
        seen.push_back(other);
      }
    }
  }
  for (const size_t t : seen) {
    const std::array<uint, 3> corners = m_triangles[t].corners;
    for (size_t k = 0; k < 3; ++k) {
      const Side side = {corners[k], corners[(k + 1) % 3]};
      if (!m_triangles[m_sides.at({side.second, side.first})].gone) border.push_back(side);
    }
  }
  for (const Side& side : border) addTriangle(side.first, side.second, point);
}

std::vector<uint> Builder::groupTriangles() const {
  std::vector<uint> group(m_triangles.size());
  std::iota(group.begin(), group.end(), 0u);
  const auto rootOf = [&](uint t) {
    while (group[t] != t) t = group[t];
    return t;
  };
  const auto areaOf = [&](const Triangle& t) {
    return length(
        cross(m_points[t.corners[1]] - m_points[t.corners[0]], m_points[t.corners[2]] - m_points[t.corners[0]]));
  };
  // The largest first: each gathers its neighbours that lie in its plane, with all their corners.
  std::vector<uint> order;
  for (uint t = 0; t < m_triangles.size(); ++t) {
    if (!m_triangles[t].gone) order.push_back(t);
  }
  std::vector<double> areas(m_triangles.size());
  for (const uint t : order) areas[t] = areaOf(m_triangles[t]);
  std::stable_sort(order.begin(), order.end(), [&](uint a, uint b) { return areas[a] > areas[b]; });
  std::vector<bool> taken(m_triangles.size(), false);
  for (const uint largest : order) {
    if (taken[largest]) continue;
    taken[largest] = true;
    std::vector<uint> members = {largest};
    const Triangle& face = m_triangles[largest];
    for (size_t n = 0; n < members.size(); ++n) {
      const std::array<uint, 3> corners = m_triangles[members[n]].corners;
      for (size_t k = 0; k < 3; ++k) {
        const auto other = static_cast<uint>(m_sides.at({corners[(k + 1) % 3], corners[k]}));
        if (taken[other]) continue;
        bool inPlane = true;
        for (const uint c : m_triangles[other].corners) {
          inPlane = inPlane && std::fabs(dot(face.normal, m_points[c]) - face.at) <= kCoplanar * m_size;
        }
        // A sliver is in every plane around it, a face is not.
        if (!inPlane || (areas[other] > 1e-5 * m_size * m_size && dot(face.normal, m_triangles[other].normal) < 0.99)) {
          continue;
        }
        taken[other] = true;
        group[other] = rootOf(largest);
        members.push_back(other);
      }
    }
  }
  return group;
}

void Builder::addFaces(const std::vector<uint>& group) {
  // The border of each face, as a map from a corner to the next; and the faces around each point.
  std::map<uint, std::map<uint, uint>> next;
  std::map<uint, std::set<uint>> around;
  for (const auto& [side, triangle] : m_sides) {
    if (m_triangles[triangle].gone) continue;
    const uint face = group[triangle];
    around[side.first].insert(face);
    const size_t other = m_sides.at({side.second, side.first});
    if (group[other] != face) next[face][side.first] = side.second;
  }
  std::map<uint, Vec> normals;
  for (const auto& [face, border] : next) normals[face] = m_triangles[face].normal;
  std::map<std::pair<uint, uint>, uint> faceOfSide;  // directed side between corners that stay -> face
  for (const auto& [face, border] : next) {
    std::vector<uint> loop;
    uint at = border.begin()->first;
    for (size_t n = 0; n < border.size(); ++n) {
      // A point in the middle of a straight edge is no corner.
      if (around[at].size() >= 3) loop.push_back(at);
      const auto step = border.find(at);
      if (step == border.end()) break;
      at = step->second;
    }
    double plane = -1e300;
    for (const Vec& p : m_points) plane = std::max(plane, dot(normals[face], p));
    if (loop.empty()) loop.push_back(border.begin()->first);
    addFace(normals[face], plane, loop);
    for (size_t k = 0; k < loop.size(); ++k) faceOfSide[{loop[k], loop[(k + 1) % loop.size()]}] = face;
  }
  for (const auto& [side, face] : faceOfSide) {
    const auto other = faceOfSide.find({side.second, side.first});
    // Listed once; a side without a partner, which rounding could leave, has its own face's normal on both ends.
    if (other == faceOfSide.end()) {
      addEdge(side.second, side.first, normals[face], normals[face]);
    } else if (face < other->second) {
      addEdge(side.second, side.first, normals[face], normals[other->second]);
    }
  }
}

void Builder::addPolyhedron(const std::array<uint, 4>& c) {
  const bool inFront = volume(c[0], c[1], c[2], c[3]) > 0;
  const uint a = c[0], b = inFront ? c[2] : c[1], d = inFront ? c[1] : c[2], top = c[3];
  addTriangle(a, b, d);
  addTriangle(b, a, top);
  addTriangle(d, b, top);
  addTriangle(a, d, top);
  for (size_t t = 0; t < m_triangles.size(); ++t) {
    if (!m_triangles[t].gone && m_triangles[t].outside > 0) growBy(m_triangles[t].farthest, t);
  }
  addFaces(groupTriangles());
}

HullFeatures Builder::build() {
  for (const Vec& p : m_points) m_size = std::max({m_size, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
  std::vector<uint> corners = firstCorners();
  if (corners.size() == 4) {
    putOnGrid();
    if (volume(corners[0], corners[1], corners[2], corners[3]) == 0) corners.pop_back();
  }
  if (corners.size() == 1) addPoint(corners[0]);
  if (corners.size() == 2) addSegment(corners[0], corners[1]);
  if (corners.size() == 3) {
    addPolygon(unit(cross(m_points[corners[1]] - m_points[corners[0]], m_points[corners[2]] - m_points[corners[0]])));
  }
  if (corners.size() == 4) addPolyhedron({corners[0], corners[1], corners[2], corners[3]});
  return std::move(m_out);
}

}  // namespace

HullFeatures makeHullFeatures(const std::vector<float4>& points) { return Builder(points).build(); }

Shape appendHull(const HullFeatures& f, HullArrays& to) {
  Shape place{};
  place.firstVertex = static_cast<int>(to.vertices.size());
  place.vertexCount = static_cast<int>(f.vertices.size());
  place.firstFace = static_cast<int>(to.faces.size());
  place.faceCount = static_cast<int>(f.faces.size());
  place.firstEdge = static_cast<int>(to.edges.size());
  place.edgeCount = static_cast<int>(f.edges.size());
  const int firstCorner = static_cast<int>(to.corners.size());
  to.vertices.insert(to.vertices.end(), f.vertices.begin(), f.vertices.end());
  to.corners.insert(to.corners.end(), f.corners.begin(), f.corners.end());
  to.edges.insert(to.edges.end(), f.edges.begin(), f.edges.end());
  for (HullFace face : f.faces) {
    face.firstCorner += firstCorner;
    to.faces.push_back(face);
  }
  to.changed = true;
  return place;
}

}  // namespace btgpu
