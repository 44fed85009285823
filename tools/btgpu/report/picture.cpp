// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "picture.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "shape_mesh.h"

namespace btgpu::tool {
namespace {

constexpr int kSamples = 2;  // along each edge of a pixel
constexpr int kShadowSize = 2048;
constexpr double kDegree = 3.14159265358979 / 180;

btScalar s(double v) { return static_cast<btScalar>(v); }

bool isFinite(const btVector3& v) { return std::isfinite(v.x() + v.y() + v.z()); }

bool stands(const btCollisionObject& o) { return o.isStaticOrKinematicObject(); }

btVector3 upOf(const btDiscreteDynamicsWorld& world) {
  const btVector3 gravity = world.getGravity();
  return gravity.fuzzyZero() || !isFinite(gravity) ? btVector3(0, 1, 0) : -gravity.normalized();
}

struct Ball {
  btVector3 centre;
  btScalar radius;
};

std::vector<Ball> ballsOf(const std::vector<const btDiscreteDynamicsWorld*>& worlds, bool standing) {
  std::vector<Ball> balls;
  for (const btDiscreteDynamicsWorld* world : worlds) {
    for (int i = 0; i < world->getNumCollisionObjects(); ++i) {
      const btCollisionObject& o = *world->getCollisionObjectArray()[i];
      if (stands(o) != standing || o.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE) continue;
      Ball ball;
      o.getCollisionShape()->getBoundingSphere(ball.centre, ball.radius);
      ball.centre = o.getWorldTransform() * ball.centre;
      if (isFinite(ball.centre) && ball.radius < s(1e15)) balls.push_back(ball);
    }
  }
  return balls;
}

struct Range {
  btScalar lowest, highest;
  btScalar width() const { return highest - lowest; }
};

// Of all but the outermost 2 % on either side.
Range innerRange(const std::vector<Ball>& balls, const btVector3& axis) {
  std::vector<btScalar> at;
  for (const Ball& b : balls) at.push_back(b.centre.dot(axis));
  std::sort(at.begin(), at.end());
  const size_t cut = at.size() / 50;
  return {at[cut], at[at.size() - 1 - cut]};
}

// Without those that are further out than half the width of the others.
std::vector<Ball> withoutStrays(const std::vector<Ball>& balls, const btVector3 (&axes)[3]) {
  Range ranges[3];
  for (int k = 0; k < 3; ++k) ranges[k] = innerRange(balls, axes[k]);
  const btScalar largest = btMax(btMax(ranges[0].width(), ranges[1].width()), ranges[2].width());
  std::vector<Ball> kept;
  for (const Ball& b : balls) {
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const btScalar at = b.centre.dot(axes[k]), room = largest * s(0.5) + b.radius;
      inside = inside && at >= ranges[k].lowest - room && at <= ranges[k].highest + room;
    }
    if (inside) kept.push_back(b);
  }
  return kept;
}

// Depth buffer with what is nearest in each pixel. Nearness: anything that grows towards the viewer and is linear on
// the screen.
struct Screen {
  Screen(int w, int h) : width(w), height(h), nearness(static_cast<size_t>(w) * static_cast<size_t>(h), -HUGE_VALF) {}
  int width, height;
  std::vector<float> nearness;
};

struct ScreenCorner {
  double x, y, nearness;
};

// Calls put(pixel, weights of the corners) for each pixel in which the triangle is nearest so far.
template <typename Put>
void fillTriangle(Screen& screen, const ScreenCorner (&c)[3], Put put) {
  const double area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
  if (!(std::fabs(area) > 1e-9) || !std::isfinite(area)) return;
  const auto [left, right] = std::minmax({c[0].x, c[1].x, c[2].x});
  const auto [top, bottom] = std::minmax({c[0].y, c[1].y, c[2].y});
  // Triangles may lie far outside, where no int reaches.
  const int x0 = static_cast<int>(std::ceil(std::clamp<double>(left - 0.5, 0, screen.width)));
  const int x1 = static_cast<int>(std::floor(std::clamp<double>(right - 0.5, -1, screen.width - 1)));
  const int y0 = static_cast<int>(std::ceil(std::clamp<double>(top - 0.5, 0, screen.height)));
  const int y1 = static_cast<int>(std::floor(std::clamp<double>(bottom - 0.5, -1, screen.height - 1)));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double w1 = ((px - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (py - c[0].y)) / area;
      const double w2 = ((c[1].x - c[0].x) * (py - c[0].y) - (px - c[0].x) * (c[1].y - c[0].y)) / area;
      const double w0 = 1 - w1 - w2;
      if (w0 < 0 || w1 < 0 || w2 < 0) continue;
      const auto nearness = static_cast<float>(w0 * c[0].nearness + w1 * c[1].nearness + w2 * c[2].nearness);
      const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(screen.width) + static_cast<size_t>(x);
      if (nearness <= screen.nearness[pixel]) continue;
      screen.nearness[pixel] = nearness;
      put(pixel, s(w0), s(w1), s(w2));
    }
  }
}

// The part of a triangle in front of the camera: up to four corners. Positions in the camera's space, z forward.
int clipNear(const Corner (&triangle)[3], btScalar nearest, Corner (&result)[4]) {
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const Corner &a = triangle[k], &b = triangle[(k + 1) % 3];
    const btScalar da = a.position.z() - nearest, db = b.position.z() - nearest;
    if (da >= 0) result[count++] = a;
    if ((da >= 0) != (db >= 0)) {
      const btScalar t = da / (da - db);
      result[count++] = {a.position.lerp(b.position, t), a.normal.lerp(b.normal, t)};
    }
  }
  return count;
}

btVector3 colourOf(int body) {
  static const btVector3 kColours[] = {{s(0.17), s(0.36), s(0.60)}, {s(0.85), s(0.42), s(0.16)},
                                       {s(0.20), s(0.52), s(0.43)}, {s(0.87), s(0.66), s(0.24)},
                                       {s(0.62), s(0.26), s(0.33)}, {s(0.45), s(0.40), s(0.66)},
                                       {s(0.43), s(0.62), s(0.74)}, {s(0.72), s(0.70), s(0.62)}};
  const unsigned mixed = static_cast<unsigned>(body) * 2654435761u;
  const btVector3& c = kColours[mixed >> 29];
  const auto linear = [](btScalar v) { return s(std::pow(double(v), 1.5)); };
  return btVector3(linear(c.x()), linear(c.y()), linear(c.z()));
}

double smoothStep(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// 1, 2 or 5 times a power of ten.
double roundSpacing(double wanted) {
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  return wanted / power < 2 ? power : wanted / power < 5 ? 2 * power : 5 * power;
}

class Painter {
 public:
  Painter(const btDiscreteDynamicsWorld& world, const Camera& camera, int width, int height)
      : m_world(world),
        m_camera(camera),
        m_up(upOf(world)),
        m_light((m_up - camera.right * s(0.55) - camera.forward * s(0.3)).normalized()),
        m_screen(width * kSamples, height * kSamples),
        m_shadow(kShadowSize, kShadowSize),
        m_owner(m_screen.nearness.size(), -1),
        m_normal(m_screen.nearness.size()) {
    btPlaneSpace1(m_light, m_lightX, m_lightY);
    const double wanted = double(camera.radius) / 5;
    m_gridSpacing = roundSpacing(wanted > 0 ? wanted : 1);
  }

  Image draw() {
    for (int i = 0; i < m_world.getNumCollisionObjects(); ++i) addBody(i);
    Image image{m_screen.width / kSamples, m_screen.height / kSamples, {}};
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) resolve(x, y, image.rgba);
    }
    return image;
  }

 private:
  struct Shade {
    btVector3 colour;
    double alpha;
  };

  void addBody(int body) {
    const btCollisionObject& o = *m_world.getCollisionObjectArray()[body];
    const btTransform& at = o.getWorldTransform();
    const bool plane = o.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
    const std::vector<Corner>* mesh = &m_meshes[o.getCollisionShape()];
    std::vector<Corner> own;
    if (plane) {
      own = meshOf(*o.getCollisionShape(), 1, m_camera.radius * 20, at.invXform(m_camera.focus));
      mesh = &own;
    } else if (mesh->empty()) {
      const int moving = m_world.getNumCollisionObjects();
      const int fineness = moving < 500 ? 4 : moving < 3000 ? 3 : 2;
      m_meshes[o.getCollisionShape()] = meshOf(*o.getCollisionShape(), fineness, 0, btVector3(0, 0, 0));
    }
    for (size_t k = 0; k + 2 < mesh->size(); k += 3) {
      Corner triangle[3];
      for (size_t j = 0; j < 3; ++j) {
        triangle[j] = {at * (*mesh)[k + j].position, at.getBasis() * (*mesh)[k + j].normal};
      }
      addToScreen(body, triangle);
      if (!plane) addToShadow(triangle);
    }
  }

  void addToScreen(int body, const Corner (&world)[3]) {
    Corner seen[3], front[4];
    for (int k = 0; k < 3; ++k) {
      const btVector3 d = world[k].position - m_camera.eye;
      seen[k] = {btVector3(d.dot(m_camera.right), d.dot(m_camera.up), d.dot(m_camera.forward)), world[k].normal};
    }
    const int count = clipNear(seen, m_camera.radius * s(0.05), front);
    for (int k = 1; k + 1 < count; ++k) {
      const Corner* fan[3] = {&front[0], &front[k], &front[k + 1]};
      ScreenCorner corners[3];
      for (int j = 0; j < 3; ++j) corners[j] = project(fan[j]->position);
      fillTriangle(m_screen, corners, [&](size_t pixel, btScalar w0, btScalar w1, btScalar w2) {
        m_owner[pixel] = body;
        m_normal[pixel] = fan[0]->normal * w0 + fan[1]->normal * w1 + fan[2]->normal * w2;
      });
    }
  }

  ScreenCorner project(const btVector3& p) const {
    const double z = double(p.z());
    return {(0.5 + 0.5 * double(p.x()) / (z * double(m_camera.tangentX))) * m_screen.width,
            (0.5 - 0.5 * double(p.y()) / (z * double(m_camera.tangentY))) * m_screen.height, 1 / z};
  }

  ScreenCorner onShadowMap(const btVector3& p) const {
    const btVector3 d = p - m_camera.focus;
    const double scale = 0.5 * kShadowSize / (1.5 * double(m_camera.radius));
    return {0.5 * kShadowSize + scale * double(d.dot(m_lightX)), 0.5 * kShadowSize + scale * double(d.dot(m_lightY)),
            double(d.dot(m_light))};
  }

  void addToShadow(const Corner (&world)[3]) {
    const ScreenCorner corners[3] = {onShadowMap(world[0].position), onShadowMap(world[1].position),
                                     onShadowMap(world[2].position)};
    fillTriangle(m_shadow, corners, [](size_t, btScalar, btScalar, btScalar) {});
  }

  // Share of the light that reaches a point: four samples of the shadow map around it.
  double lightAt(const btVector3& p, const btVector3& normal) const {
    const double texel = 3 * double(m_camera.radius) / kShadowSize;
    const ScreenCorner c = onShadowMap(p + normal * s(2 * texel));
    double lit = 0;
    for (const double dx : {-0.7, 0.7}) {
      for (const double dy : {-0.7, 0.7}) {
        const double x = c.x + dx, y = c.y + dy;
        const bool inside = x >= 0 && y >= 0 && x < kShadowSize && y < kShadowSize;
        const size_t at = inside ? static_cast<size_t>(y) * kShadowSize + static_cast<size_t>(x) : 0;
        lit += !inside || double(m_shadow.nearness[at]) < c.nearness + texel ? 0.25 : 0;
      }
    }
    return lit;
  }

  // Lines across what stands still, along the two axes that its surface is closest to.
  double gridAt(const btVector3& p, const btVector3& normal, double footprint) const {
    const int across = normal.absolute().maxAxis();
    double line = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis == across) continue;
      const double cell = double(p[axis]) / m_gridSpacing;
      const double distance = std::fabs(cell - std::round(cell)) * m_gridSpacing;
      const double width = std::max(0.012 * m_gridSpacing, 0.7 * footprint);
      line =
          std::max(line, (1 - smoothStep(0.4 * width, width, distance)) * std::min(1.0, 0.03 * m_gridSpacing / width));
    }
    return line;
  }

  Shade shade(size_t pixel, double x, double y) const {
    const int body = m_owner[pixel];
    if (body < 0) return {btVector3(0, 0, 0), 0};
    const btVector3 ray = m_camera.forward +
                          m_camera.right * s((2 * x / m_screen.width - 1) * double(m_camera.tangentX)) +
                          m_camera.up * s((1 - 2 * y / m_screen.height) * double(m_camera.tangentY));
    const double z = 1 / double(m_screen.nearness[pixel]);
    const btVector3 p = m_camera.eye + ray * s(z);
    btVector3 normal = m_normal[pixel].normalized();
    if (normal.dot(ray) > 0) normal = -normal;

    const bool standing = stands(*m_world.getCollisionObjectArray()[body]);
    btVector3 colour = standing ? btVector3(s(0.62), s(0.64), s(0.67)) : colourOf(body);
    double alpha = 1;
    if (standing) {
      const double footprint = 2 * z * double(m_camera.tangentX) / m_screen.width /
                               std::max(0.05, std::fabs(double(normal.dot(ray.normalized()))));
      colour *= s(1 - 0.45 * gridAt(p, normal, footprint));
      alpha = 1 - smoothStep(0.9, 2.4, double((p - m_camera.focus).length()) / double(m_camera.radius));
    }
    const double sun = std::max(0.0, double(normal.dot(m_light))) * lightAt(p, normal);
    const double sky = 0.30 + 0.14 * double(normal.dot(m_up)) + 0.08 * double(-normal.dot(m_camera.forward));
    return {colour * s(sky + 0.85 * sun), alpha};
  }

  // Dark where one body ends and another begins.
  bool onOutline(size_t pixel, int x, int y) const {
    const int body = m_owner[pixel];
    const auto other = [&](size_t neighbour) {
      return m_owner[neighbour] != body && m_screen.nearness[neighbour] < m_screen.nearness[pixel];
    };
    const auto row = static_cast<size_t>(m_screen.width);
    return (x > 0 && other(pixel - 1)) || (x + 1 < m_screen.width && other(pixel + 1)) ||
           (y > 0 && other(pixel - row)) || (y + 1 < m_screen.height && other(pixel + row));
  }

  // The mean of a pixel's samples.
  void resolve(int px, int py, std::vector<std::uint8_t>& rgba) const {
    btVector3 sum(0, 0, 0);
    double alpha = 0;
    for (int k = 0; k < kSamples * kSamples; ++k) {
      const int x = px * kSamples + k % kSamples, y = py * kSamples + k / kSamples;
      const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(m_screen.width) + static_cast<size_t>(x);
      Shade sample = shade(pixel, x + 0.5, y + 0.5);
      if (sample.alpha > 0 && onOutline(pixel, x, y)) sample.colour *= s(0.6);
      sum += sample.colour * s(sample.alpha);
      alpha += sample.alpha;
    }
    for (int channel = 0; channel < 3; ++channel) {
      const double linear = alpha > 0 ? double(sum[channel]) / alpha : 0;
      rgba.push_back(static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(linear, 0.0, 1.0), 1 / 2.2))));
    }
    rgba.push_back(static_cast<std::uint8_t>(std::lround(255 * alpha / (kSamples * kSamples))));
  }

  const btDiscreteDynamicsWorld& m_world;
  const Camera& m_camera;
  btVector3 m_up, m_light, m_lightX, m_lightY;  // light: towards it
  double m_gridSpacing;
  Screen m_screen, m_shadow;
  std::vector<int> m_owner;         // index of the nearest body, -1: none
  std::vector<btVector3> m_normal;  // of its surface
  std::map<const btCollisionShape*, std::vector<Corner>> m_meshes;
};

// Puts the eye where it sees all balls around `middle`; returns the middle of what it then sees.
btVector3 stepBack(Camera& camera, const std::vector<Ball>& balls, const btVector3& middle) {
  btScalar distance = 0;
  for (const Ball& b : balls) {
    const btVector3 d = b.centre - middle;
    const btScalar across = (btFabs(d.dot(camera.right)) + b.radius) / camera.tangentX;
    const btScalar along = (btFabs(d.dot(camera.up)) + b.radius) / camera.tangentY;
    distance = btMax(distance, btMax(across, along) - d.dot(camera.forward));
  }
  distance *= s(1.08);
  camera.eye = middle - camera.forward * distance;
  btVector3 shift(0, 0, 0);
  for (const btVector3& axis : {camera.right, camera.up}) {
    btScalar least = s(1e30), most = s(-1e30);
    for (const Ball& b : balls) {
      const btVector3 d = b.centre - camera.eye;
      least = btMin(least, (d.dot(axis) - b.radius) / d.dot(camera.forward));
      most = btMax(most, (d.dot(axis) + b.radius) / d.dot(camera.forward));
    }
    shift += axis * ((least + most) / 2 * distance);
  }
  return middle + shift;
}

}  // namespace

Camera cameraFor(const std::vector<const btDiscreteDynamicsWorld*>& worlds, int width, int height) {
  const btVector3 up = upOf(*worlds.front());
  btVector3 axes[3] = {btVector3(0, 0, 0), btVector3(0, 0, 0), up};
  btPlaneSpace1(up, axes[0], axes[1]);
  std::vector<Ball> balls = ballsOf(worlds, false);
  if (balls.empty()) balls = ballsOf(worlds, true);
  if (balls.empty()) balls.push_back({btVector3(0, 0, 0), 1});
  balls = withoutStrays(balls, axes);
  if (innerRange(balls, axes[1]).width() > innerRange(balls, axes[0]).width()) std::swap(axes[0], axes[1]);

  Camera camera;
  const auto sine = [](double degrees) { return s(std::sin(degrees * kDegree)); };
  const auto cosine = [](double degrees) { return s(std::cos(degrees * kDegree)); };
  const btVector3 towards = (axes[1] * cosine(30) + axes[0] * sine(30)) * cosine(24) + up * sine(24);
  camera.forward = -towards;
  camera.right = camera.forward.cross(up).normalized();
  camera.up = camera.right.cross(camera.forward);
  camera.tangentY = s(std::tan(15 * kDegree));
  camera.tangentX = camera.tangentY * s(width) / s(height);

  btVector3 lower = balls.front().centre, upper = lower;
  for (const Ball& b : balls) {
    lower.setMin(b.centre);
    upper.setMax(b.centre);
  }
  camera.focus = (lower + upper) / 2;
  camera.radius = s(1e-6);
  for (const Ball& b : balls) camera.radius = btMax(camera.radius, (b.centre - camera.focus).length() + b.radius);
  btVector3 middle = camera.focus;
  for (int round = 0; round < 3; ++round) middle = stepBack(camera, balls, middle);
  return camera;
}

Image drawWorld(const btDiscreteDynamicsWorld& world, const Camera& camera, int width, int height) {
  return Painter(world, camera, width, height).draw();
}

}  // namespace btgpu::tool
