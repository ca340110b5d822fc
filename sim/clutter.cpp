#include "sim/clutter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace zeropose {
namespace {

using Eigen::Vector2d;

std::vector<Thing> slot(double, double angle, Random& random) {
  const Vector2d half(random.uniform(24, 34), random.uniform(5, 6.5));
  return {{rounded_box(Vector2d::Zero(), angle, half, half.y()),
           {.grey = random.uniform(28, 42), .bevel_mm = 2, .bevel_grey = -25}}};
}

std::vector<Thing> square(double, double angle, Random& random) {
  const double half = random.uniform(8, 11);
  return {{rounded_box(Vector2d::Zero(), angle, Vector2d::Constant(half), 1),
           {.grey = random.uniform(35, 50), .bevel_mm = 1.5, .bevel_grey = -20}}};
}

std::vector<Thing> half_moon(double, double angle, Random& random) {
  return {{half_disc(Vector2d::Zero(), angle, random.uniform(13, 17)), {.grey = random.uniform(35, 48)}}};
}

std::vector<Thing> bolt_head(double base_grey, double angle, Random& random) {
  const double inner = random.uniform(5, 6.5);
  return {
      {hexagon({1.5, 2}, angle, inner + 3), {.grey = 0.45 * base_grey, .opacity = 0.6, .softness_mm = 1.5}},
      {disc(Vector2d::Zero(), inner + 2.5), {.grey = 1.15 * base_grey, .bevel_mm = 1.5, .bevel_grey = 30}},
      {hexagon(Vector2d::Zero(), angle, inner), {.grey = 1.45 * base_grey, .bevel_mm = 2, .bevel_grey = 60}}};
}

std::vector<Thing> scratches(double base_grey, double angle, Random& random) {
  std::vector<Thing> lines;
  for (int line = 0; line < 3; ++line) {
    const Vector2d place(random.uniform(-8, 8), random.uniform(-6, 6));
    lines.push_back({rounded_box(place, angle + random.uniform(-0.3, 0.3),
                                 {random.uniform(10, 35), random.uniform(0.25, 0.6)}, 0.2),
                     {.grey = 2 * base_grey, .opacity = random.uniform(0.3, 0.7)}});
  }
  return lines;
}

std::vector<Thing> glint(double, double angle, Random& random) {
  return {{rounded_box(Vector2d::Zero(), angle, {random.uniform(2, 9), 1.2}, 1.2),
           {.grey = 250, .opacity = 0.9, .softness_mm = random.uniform(0.8, 2.2)}}};
}

std::vector<Thing> small_hole(double, double, Random& random) {
  return {{disc(Vector2d::Zero(), random.uniform(2, 2.9)), {.grey = 22, .bevel_mm = 1, .bevel_grey = -20}}};
}

std::vector<Thing> stain(double base_grey, double angle, Random& random) {
  return {{rounded_box(Vector2d::Zero(), angle, {random.uniform(18, 30), random.uniform(7, 10)}, 6),
           {.grey = 0.5 * base_grey, .opacity = 0.6, .softness_mm = 6}}};
}

}  // namespace

std::vector<Thing> make_clutter(int kind, double base_grey, Random& random) {
  const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
  switch (kind % 8) {
    case 0:
      return slot(base_grey, angle, random);
    case 1:
      return square(base_grey, angle, random);
    case 2:
      return half_moon(base_grey, angle, random);
    case 3:
      return bolt_head(base_grey, angle, random);
    case 4:
      return scratches(base_grey, angle, random);
    case 5:
      return glint(base_grey, angle, random);
    case 6:
      return small_hole(base_grey, angle, random);
    default:
      return stain(base_grey, angle, random);
  }
}

double reach_mm(const std::vector<Thing>& things) {
  double reach = 0;
  for (const Thing& thing : things)
    reach = std::max(
        reach, thing.shape.centre_mm.norm() + bounding_radius_mm(thing.shape) + 4 * thing.paint.softness_mm);
  return reach;
}

void move(std::vector<Thing>& things, const Vector2d& by_mm) {
  for (Thing& thing : things) thing.shape.centre_mm += by_mm;
}

std::optional<Vector2d> free_place(const CameraModel& camera, double radius_px,
                                   const std::vector<Taken>& taken, Random& random) {
  for (int draw = 0; draw < 300; ++draw) {
    const Vector2d place(random.uniform(0, camera.width_px), random.uniform(0, camera.height_px));
    const auto touches = [&](const Taken& other) {
      return (other.centre_px - place).norm() < other.radius_px + radius_px;
    };
    if (std::ranges::none_of(taken, touches)) return place;
  }
  return std::nullopt;
}

}  // namespace zeropose
