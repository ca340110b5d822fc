#include "sim/painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Direction in a sheet from which light falls on rims: above and left.
const Vector2d to_light(-0.6, -0.8);

// Where a camera's rays meet the plane z = 0 of S, in its coordinates.
class Plane {
 public:
  explicit Plane(const Pose& X_CS) : R_SC_(X_CS.linear().transpose()), p_SC_(-(R_SC_ * X_CS.translation())) {}

  Vector2d meet(const Eigen::Vector2f& ray) const {
    const Vector3d d = R_SC_ * Vector3d(ray.x(), ray.y(), 1);
    const double depth = -p_SC_.z() / d.z();
    return p_SC_.head<2>() + depth * d.head<2>();
  }

 private:
  Eigen::Matrix3d R_SC_;
  Vector3d p_SC_;
};

struct PixelBox {
  int u0 = 0, v0 = 0, u1 = -1, v1 = -1;  // inclusive
};

// The pixels that a thing can reach; empty when its centre has no image.
PixelBox reach_of(const Thing& thing, const Pose& X_CS, const CameraModel& camera, double edge_px) {
  const Vector3d p_C = X_CS * Vector3d(thing.shape.centre_mm.x(), thing.shape.centre_mm.y(), 0);
  const auto middle = project(camera, p_C);
  if (!middle) return {};
  constexpr double perspective = 1.3;  // nearer parts of a tilted thing are larger
  const double radius_mm = bounding_radius_mm(thing.shape) + 4 * thing.paint.softness_mm;
  const double radius = perspective * radius_mm * std::max(camera.fx_px, camera.fy_px) / p_C.z() + edge_px;
  const auto cut = [](double value, int size) {
    return static_cast<int>(std::clamp(value, -1.0, static_cast<double>(size)));
  };
  return {std::max(cut(middle->x() - radius, camera.width_px), 0),
          std::max(cut(middle->y() - radius, camera.height_px), 0),
          std::min(cut(middle->x() + radius, camera.width_px), camera.width_px - 1),
          std::min(cut(middle->y() + radius, camera.height_px), camera.height_px - 1)};
}

// -1..1, one value per lattice point.
float lattice(std::uint32_t x, std::uint32_t y) {
  std::uint32_t h = x * 0x9E3779B1U ^ y * 0x85EBCA77U;
  h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 13)) * 0x297A2D39U;
  return static_cast<float>(static_cast<std::int32_t>(h >> 8)) * 0x1p-23F - 1;
}

// Smooth irregular values between the lattice points (value noise). |p| < 1e5.
double value_noise(const Vector2d& p) {
  constexpr double positive = 1e5;  // truncation is then the floor
  const auto x = static_cast<std::int32_t>(p.x() + positive), y = static_cast<std::int32_t>(p.y() + positive);
  const auto s = static_cast<float>(p.x() + positive - x), t = static_cast<float>(p.y() + positive - y);
  const float a = s * s * (3 - 2 * s), b = t * t * (3 - 2 * t);
  const auto column = static_cast<std::uint32_t>(x), row = static_cast<std::uint32_t>(y);
  const float top = lattice(column, row) + a * (lattice(column + 1, row) - lattice(column, row));
  const float bottom =
      lattice(column, row + 1) + a * (lattice(column + 1, row + 1) - lattice(column, row + 1));
  return top + b * (bottom - top);
}

double rim_grey(const Thing& thing, const Vector2d& q_mm, double distance_mm) {
  const Paint& paint = thing.paint;
  if (paint.bevel_mm <= 0 || distance_mm <= -paint.bevel_mm) return 0;
  constexpr double step_mm = 0.5;
  const Vector2d outward(signed_distance_mm(thing.shape, q_mm + step_mm * Vector2d::UnitX()) - distance_mm,
                         signed_distance_mm(thing.shape, q_mm + step_mm * Vector2d::UnitY()) - distance_mm);
  const double roundness = std::min(1 + distance_mm / paint.bevel_mm, 1.0);
  return paint.bevel_grey * roundness * outward.dot(to_light) / step_mm;
}

double grey_of(const Thing& thing, const Vector2d& q_mm, double distance_mm) {
  const Paint& paint = thing.paint;
  double grey = paint.grey + rim_grey(thing, q_mm, distance_mm);
  if (paint.texture_grey > 0) grey += paint.texture_grey * value_noise(q_mm * (1 / paint.texture_mm));
  if (paint.shading_grey > 0) grey += paint.shading_grey * value_noise(q_mm * (1.0 / 140));
  return grey;
}

constexpr double edge_sigmas = 4;  // beyond, an edge is over

// Share of a blurred half plane at the signed distance in sigmas, from a table: for looks, not for marks.
double blurred_step(double distance_in_sigmas) {
  constexpr int steps_per_sigma = 32;
  constexpr auto size = static_cast<std::size_t>(2 * edge_sigmas * steps_per_sigma + 2);
  static const std::array<double, size> table = [] {
    std::array<double, size> shares{};
    for (std::size_t i = 0; i < size; ++i)
      shares[i] =
          0.5 * std::erfc((static_cast<double>(i) / steps_per_sigma - edge_sigmas) / std::numbers::sqrt2);
    return shares;
  }();
  if (distance_in_sigmas >= edge_sigmas) return 0;
  if (distance_in_sigmas <= -edge_sigmas) return 1;
  const double place = (distance_in_sigmas + edge_sigmas) * steps_per_sigma;
  const auto i = static_cast<std::size_t>(place);
  return table[i] + (place - static_cast<double>(i)) * (table[i + 1] - table[i]);
}

// How many steps of a pixel a point can go before it has gone `distance_mm`, with a margin for tilted planes.
int steps_within(double distance_mm, double mm_per_px) {
  constexpr double tilt = 2, most = 1e4;
  return distance_mm > 0 ? static_cast<int>(std::min(distance_mm / (tilt * mm_per_px), most)) : 0;
}

}  // namespace

Illumination drawn_light(const CameraModel& camera, double gradient, Random& random) {
  const Vector2d size(camera.width_px, camera.height_px);
  const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
  return {size / 2, gradient / size.norm() * Vector2d(std::cos(angle), std::sin(angle))};
}

PixelRays::PixelRays(const CameraModel& camera) : camera_(camera) {
  xy_.reserve(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const auto d = ray(camera, Vector2d(u, v));
      xy_.push_back(d ? Eigen::Vector2f(d->head<2>().cast<float>()) : Eigen::Vector2f(none, none));
    }
  }
}

// A pixel's box adds the variance 1/12 to that of the blur.
Painter::Painter(const PixelRays& rays, double blur_sigma_px, std::vector<float>& picture)
    : rays_(rays), edge_sigma_px_(std::sqrt(blur_sigma_px * blur_sigma_px + 1.0 / 12)), picture_(picture) {}

void Painter::paint(const Sheet& sheet, const Pose& X_CF) {
  const Pose X_CS = X_CF * sheet.X_FS;
  for (const Thing& thing : sheet.things) paint(thing, X_CS);
}

// Distances change by no more than the way gone: pixels known to be far outside are left out, those known to
// be deep inside need no distance.
void Painter::paint(const Thing& thing, const Pose& X_CS) {
  const Plane plane(X_CS);
  const CameraModel& camera = rays_.camera();
  const PixelBox box = reach_of(thing, X_CS, camera, edge_sigmas * edge_sigma_px_);
  const Vector3d middle_C_mm = X_CS * Vector3d(thing.shape.centre_mm.x(), thing.shape.centre_mm.y(), 0);
  const double mm_per_px = middle_C_mm.z() / camera.fx_px;  // above 0 where the box is not empty
  const double sigma_mm = std::hypot(edge_sigma_px_ * mm_per_px, thing.paint.softness_mm);
  const double edge_mm = edge_sigmas * sigma_mm;
  const double deep_mm = std::max(edge_mm, thing.paint.bevel_mm);
  for (int v = box.v0; v <= box.v1; ++v) {
    float* row = picture_.data() + static_cast<std::ptrdiff_t>(v) * camera.width_px;
    int known_deep = 0;
    for (int u = box.u0; u <= box.u1; ++u) {
      const Vector2d q = plane.meet(rays_.at(u, v));
      const double distance = known_deep > 0 ? -deep_mm : signed_distance_mm(thing.shape, q);
      if (!(distance < edge_mm)) {  // also where there is no ray
        u += steps_within(distance - edge_mm, mm_per_px);
        continue;
      }
      const bool deep = known_deep > 0;
      known_deep = deep ? known_deep - 1 : steps_within(-distance - deep_mm, mm_per_px);
      const double share = thing.paint.opacity * (deep ? 1 : blurred_step(distance / sigma_mm));
      row[u] += static_cast<float>(share * (grey_of(thing, q, distance) - row[u]));
    }
  }
}

void Painter::illuminate(const Illumination& light) {
  const int width = rays_.camera().width_px, height = rays_.camera().height_px;
  for (int v = 0; v < height; ++v) {
    float* row = picture_.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int u = 0; u < width; ++u) row[u] *= static_cast<float>(light.at(u, v));
  }
}

}  // namespace zeropose
