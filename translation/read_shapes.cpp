// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_shapes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <typeinfo>

#include "convert.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// False if the device has no such shape. A class derived from Bullet's counts as another shape, since it may
// override anything.
bool convertShape(const btCollisionShape& shape, Shape& out) {
  const std::type_info& type = typeid(shape);
  out = Shape{};
  if (type == typeid(btSphereShape)) {
    const auto& sphere = static_cast<const btSphereShape&>(shape);
    out.type = SHAPE_SPHERE;
    out.extents.x = static_cast<float>(sphere.getRadius());
  } else if (type == typeid(btBoxShape)) {
    const auto& box = static_cast<const btBoxShape&>(shape);
    out.type = SHAPE_BOX;
    out.extents = toFloat4(box.getHalfExtentsWithMargin());
  } else if (type == typeid(btStaticPlaneShape)) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    out.type = SHAPE_PLANE;
    out.extents = toFloat4(plane.getPlaneNormal(), static_cast<float>(plane.getPlaneConstant()));
  } else {
    return false;
  }
  out.margin = static_cast<float>(shape.getMargin());
  return true;
}

bool isFiniteShape(const Shape& s) {
  return std::isfinite(s.extents.x) && std::isfinite(s.extents.y) && std::isfinite(s.extents.z) &&
         std::isfinite(s.extents.w) && std::isfinite(s.margin) && std::isfinite(s.breakingThreshold);
}

std::uint32_t takeIndex(std::vector<std::uint32_t>& unused, Tracked<Shape>& shapes) {
  if (!unused.empty()) {
    const std::uint32_t index = unused.back();
    unused.pop_back();
    return index;
  }
  shapes.values.push_back({});
  return static_cast<std::uint32_t>(shapes.values.size() - 1);
}

}  // namespace

void ShapeReader::begin(btScalar threshold, bool relative) {
  ++m_stamp;
  m_used = 0;
  m_threshold = threshold;
  m_relative = relative;
  m_lastShape = nullptr;
}

int ShapeReader::read(const btCollisionShape* shape, Tracked<Shape>& shapes, FallbackList& missing,
                      FallbackList& shares) {
  if (shape == m_lastShape) return m_lastEntry.supported ? static_cast<int>(m_lastEntry.index) : -1;
  auto [it, isNew] = m_entries.try_emplace(shape, Entry{0, m_stamp - 1, false});
  Entry& entry = it->second;
  if (isNew) {
    entry.index = takeIndex(m_free, shapes);
    shapes.values[entry.index] = Shape{};
    shapes.changed.push_back(entry.index);
  }
  if (entry.stamp != m_stamp) {
    entry.stamp = m_stamp;
    ++m_used;
    const std::string name = std::string(shape->getName()) + " shape";
    Shape read;
    if (convertShape(*shape, read)) {
      read.breakingThreshold =
          static_cast<float>(m_relative ? shape->getContactBreakingThreshold(m_threshold) : m_threshold);
    } else {
      read = Shape{};
      read.type = SHAPE_HOST;
      shares.addShare(name, "contacts by Bullet's own algorithm on the CPU");
    }
    entry.supported = isFiniteShape(read);
    if (!entry.supported) {
      missing.add(name, "its size is not finite");
    } else if (std::memcmp(&shapes.values[entry.index], &read, sizeof read) != 0) {
      shapes.values[entry.index] = read;
      if (!isNew) shapes.changed.push_back(entry.index);
    }
  }
  m_lastShape = shape;
  m_lastEntry = entry;
  return entry.supported ? static_cast<int>(entry.index) : -1;
}

void ShapeReader::end() {
  constexpr std::size_t kUnused = 64;  // not worth a walk over the table
  if (m_entries.size() < 2 * m_used + kUnused) return;
  for (auto it = m_entries.begin(); it != m_entries.end();) {
    if (it->second.stamp == m_stamp) {
      ++it;
    } else {
      m_free.push_back(it->second.index);
      it = m_entries.erase(it);
    }
  }
  // Hash order is no order: the next new shape gets the lowest free index.
  std::sort(m_free.begin(), m_free.end(), std::greater<>());
}

void ShapeReader::clear() {
  m_entries.clear();
  m_free.clear();
  m_lastShape = nullptr;
}

BTGPU_TRANSLATION_END
