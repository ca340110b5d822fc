#include "tests/support/hard_corpus.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace zeropose::test {
namespace {

using Eigen::Vector2d;

constexpr double pi = std::numbers::pi;
constexpr int side_px = 220;

struct Mark {
  Vector2d centre_px;
  double diameter_px, axis_ratio, angle_rad, grey, ground;

  // Of the outline; t: 0..2 pi.
  Vector2d on_outline(double t) const {
    const double x = 0.5 * diameter_px * std::cos(t), y = 0.5 * diameter_px * axis_ratio * std::sin(t);
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    return centre_px + Vector2d(c * x - s * y, s * x + c * y);
  }
  double length_px() const { return pi * diameter_px * std::sqrt(0.5 * (1 + axis_ratio * axis_ratio)); }
};

struct Making {
  std::mt19937_64 random;
  HardScene scene;
  HardLens lens;
  HardSensor sensor;
  Mark mark;
  std::vector<Layer> above;  // laid over the mark
  double least_minor_px = 6;

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  int one_of(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); }
  double any_angle() { return between(0, 2 * pi); }
};

void set_up_camera(Making& m) {
  m.scene.width_px = m.scene.height_px = side_px;
  m.lens.first_zero_px = m.between(1.2, 2);
  m.lens.second_zero_px = 2.5, m.lens.second_share = m.between(0, 0.3);
  m.lens.veil_share = m.between(0, 0.04);
  m.lens.focal_px = 800;
  m.lens.axis_px = {m.between(-40, 260), m.between(-40, 260)};
  m.sensor.fill_factor = m.between(0.6, 1);
}

void set_up_mark(Making& m, bool bright) {
  const double ground = bright ? m.between(60, 130) : m.between(120, 190);
  const double contrast = m.between(50, 100);
  const double least = std::max(12.0, 1.2 * m.least_minor_px);
  const double diameter = least * std::pow(60 / least, m.between(0, 1));
  const double ratio = m.between(std::max(0.4, m.least_minor_px / diameter), 1);
  const Vector2d off(m.between(-20, 20), m.between(-20, 20));
  m.mark = {Vector2d::Constant(0.5 * (side_px - 1)) + off,
            diameter,
            ratio,
            m.between(0, pi),
            bright ? ground + contrast : std::max(ground - contrast, 8.0),
            ground};
  m.scene.ground_grey = ground;
}

// How much of the outline is under the layer.
double covered_share(const Mark& mark, const Layer& layer) {
  constexpr int points = 360;
  int inside = 0;
  for (int k = 0; k < points; ++k) {
    inside += layer.distance_px(mark.on_outline(2 * pi * k / points)) < 0 ? 1 : 0;
  }
  return double(inside) / points;
}

double cover_grey(Making& m) {
  const double low = std::min(m.mark.grey, m.mark.ground), high = std::max(m.mark.grey, m.mark.ground);
  const std::array<double, 4> greys{m.mark.grey, m.mark.ground, std::max(4.0, 0.4 * low),
                                    std::min(245.0, high + 40)};
  return greys[static_cast<std::size_t>(m.one_of(4))];
}

// Comes in from one side until it covers the share.
void add_cover(Making& m, bool round, double share) {
  const double angle = m.any_angle(), grey = cover_grey(m), half = round ? 0 : m.between(25, 50);
  const double radius = m.between(0.75, 1.2) * m.mark.diameter_px;  // too large for a mark itself
  const Vector2d from(std::cos(angle), std::sin(angle));
  const auto cover_at = [&](double off_px) {
    const Vector2d centre = m.mark.centre_px + off_px * from;
    return round ? disc_layer(centre, 2 * radius, 1, 0, grey) : bar_layer(centre, half, 300, angle, grey);
  };
  double near = 0, far = m.mark.diameter_px + std::max(half, radius);
  if (round) near = 0.5 * radius;
  for (int k = 0; k < 40; ++k) {
    const double middle = 0.5 * (near + far);
    (covered_share(m.mark, cover_at(middle)) > share ? near : far) = middle;
  }
  m.above.push_back(cover_at(0.5 * (near + far)));
}

void add_glint(Making& m, double share) {
  const double length = std::max(3.0, share * m.mark.length_px()), turn = m.any_angle();
  const double width = length * m.between(0.15, 0.6);
  const Vector2d along = m.mark.on_outline(turn + 0.01) - m.mark.on_outline(turn - 0.01);
  const double angle = std::atan2(along.y(), along.x()) + m.between(-0.6, 0.6);
  m.above.push_back(glint_layer(m.mark.on_outline(turn), length, width, angle, m.between(2, 6)));
}

void add_dirt(Making& m, double specks) {
  for (int k = 0; k < static_cast<int>(specks); ++k) {
    const double far = m.between(0.2, 1.5), turn = m.any_angle();
    const Vector2d at = m.mark.centre_px + far * (m.mark.on_outline(turn) - m.mark.centre_px);
    m.above.push_back(splash_layer(at, std::max(0.4, m.between(0.01, 0.04) * m.mark.diameter_px),
                                   m.between(15, 60), m.random));
  }
  if (specks < 10) return;
  const double radius = std::max(1.5, m.between(0.05, 0.12) * m.mark.diameter_px);
  m.above.push_back(splash_layer(m.mark.on_outline(m.any_angle()), radius, m.between(15, 60), m.random));
}

void add_oil(Making& m, double drops) {
  for (int k = 0; k < static_cast<int>(drops); ++k) {
    const double radius = std::max(2.5, m.between(0.12, 0.3) * m.mark.diameter_px);
    const Vector2d at =
        m.mark.centre_px + m.between(0.8, 1.2) * (m.mark.on_outline(m.any_angle()) - m.mark.centre_px);
    for (const Layer& layer : drop_layers(at, radius, m.between(0.15, 0.4))) m.above.push_back(layer);
  }
}

// Beams, plates, bolts where a hexagon can be told from a disc, round things of another size.
Layer thing(Making& m, const Vector2d& at, double& reach_px) {
  const double size = m.mark.diameter_px, angle = m.any_angle(), grey = m.between(20, 230);
  reach_px = 1.2 * size;
  switch (m.one_of(6)) {
    case 0:
      return bar_layer(at, reach_px = m.between(40, 120), m.between(3, 12), angle, grey);
    case 1:
      return polygon_layer(at, reach_px = std::max(13.0, 0.55 * size), 6, angle, grey);
    case 2:
      return polygon_layer(at, reach_px = m.between(0.6, 1.2) * size, 4, angle, grey);
    case 3:
      return disc_layer(at, reach_px = 0.5 * size, 1, 0, grey);
    case 4:
      return disc_layer(at, reach_px = 1.8 * size, 1, 0, grey);
    default:
      return polygon_layer(at, reach_px = m.between(0.6, 1.4) * size, 3, angle, grey);
  }
}

void add_things(Making& m, double count, double clear_px) {
  int left = static_cast<int>(count);
  for (int trial = 0; trial < 200 && left > 0; ++trial) {
    double reach_px = 0;
    const Vector2d at(m.between(0, side_px), m.between(0, side_px));
    const Layer layer = thing(m, at, reach_px);
    if (clear_px > 0) {
      if (covered_share({m.mark.centre_px, m.mark.diameter_px + 2 * clear_px, 1, 0, 0, 0}, layer) > 0)
        continue;
      if (layer.distance_px(m.mark.centre_px) < 0) continue;
      if ((at - m.mark.centre_px).norm() < 0.5 * m.mark.diameter_px + clear_px) continue;
    }
    m.scene.layers.push_back(layer);
    --left;
  }
}

void hide(Making& m) {
  const double size = m.mark.diameter_px, angle = m.any_angle(), grey = cover_grey(m);
  switch (m.one_of(3)) {
    case 0:
      m.above.push_back(bar_layer(m.mark.centre_px, 300, m.between(0.55, 1) * size, angle, grey));
      break;
    case 1:
      m.above.push_back(polygon_layer(m.mark.centre_px, m.between(1.15, 1.5) * size, 3, angle, grey));
      break;
    default:
      m.above.push_back(polygon_layer(m.mark.centre_px, m.between(0.8, 1.2) * size, 4, angle, grey));
  }
}

void set_contrast(Making& m, double contrast) {
  m.mark.grey = m.mark.ground + (m.mark.grey > m.mark.ground ? contrast : -contrast);
}

void set_motion(Making& m, double length_px) {
  const double angle = m.any_angle();
  m.lens.motion_px = length_px * Vector2d(std::cos(angle), std::sin(angle));
}

void set_light(Making& m, double ratio) {
  m.scene.light_ratio = ratio;
  m.scene.light_direction_rad = m.any_angle();
  // The camera is set so that the bright side is not white.
  const double most = 230 * 0.5 * (1 + 1 / ratio), highest = std::max(m.mark.grey, m.mark.ground);
  if (highest <= most) return;
  m.mark.grey *= most / highest, m.mark.ground *= most / highest;
  m.scene.ground_grey = m.mark.ground;
}

double least_minor_px(const HardCase& given) {
  switch (given.fault) {
    case Fault::motion:
      return std::max(6.0, 2 * given.strength);
    case Fault::defocus:
      return std::max(6.0, 5 * given.strength);
    default:
      return 6;
  }
}

void apply(Making& m, const HardCase& given);

void combine(Making& m, int count) {
  std::vector<HardCase> kinds{
      {Fault::gradient, 2}, {Fault::low_contrast, 40}, {Fault::glint, 0.08},         {Fault::dirt, 6},
      {Fault::motion, 2},   {Fault::oil, 1},           {Fault::straight_cover, 0.1}, {Fault::defocus, 1},
      {Fault::clutter, 4},  {Fault::compression, 85}};
  std::shuffle(kinds.begin(), kinds.end(), m.random);
  kinds.resize(static_cast<std::size_t>(count));
  // Contrast and light first: what lies over the mark takes its greys from them.
  std::sort(kinds.begin(), kinds.end(),
            [](const HardCase& a, const HardCase& b) { return a.fault < b.fault; });
  for (const HardCase& kind : kinds) apply(m, kind);
}

void apply(Making& m, const HardCase& given) {
  switch (given.fault) {
    case Fault::none:
      return;
    case Fault::gradient:
      return set_light(m, given.strength);
    case Fault::low_contrast:
      return set_contrast(m, given.strength);
    case Fault::glint:
      return add_glint(m, given.strength);
    case Fault::dirt:
      return add_dirt(m, given.strength);
    case Fault::straight_cover:
      return add_cover(m, false, given.strength);
    case Fault::round_cover:
      return add_cover(m, true, given.strength);
    case Fault::motion:
      return set_motion(m, given.strength);
    case Fault::oil:
      return add_oil(m, given.strength);
    case Fault::defocus:
      m.lens.defocus_px = 2 * given.strength;
      return;
    case Fault::clutter:
      return add_things(m, given.strength, 4);
    case Fault::compression:
      m.sensor.quality = static_cast<int>(given.strength);
      return;
    case Fault::gamma:
      m.sensor.gamma = given.strength;
      return;
    case Fault::deep_pixels:
      m.sensor.white = (1 << static_cast<int>(given.strength)) - 1;
      return;
    case Fault::combined:
      return combine(m, static_cast<int>(given.strength));
    case Fault::hidden:
      add_things(m, given.strength, 4);
      return hide(m);
    case Fault::absent:
      return add_things(m, given.strength, 0);
  }
}

MarkSearch search_for(const Mark& mark) {
  MarkSearch search;
  search.bright = mark.grey > mark.ground;
  search.expected_px = Vector2d::Constant(0.5 * (side_px - 1));
  search.half_window_px = {100, 100};
  search.min_diameter_px = 0.75 * mark.diameter_px;
  search.max_diameter_px = 1.3 * mark.diameter_px;
  search.min_axis_ratio = 0.35;
  return search;
}

}  // namespace

std::string name_of(Fault fault) {
  constexpr std::array<const char*, 17> names{
      "none",        "gradient",    "low contrast", "glint",   "dirt",    "straight cover",
      "round cover", "motion",      "oil",          "defocus", "clutter", "compression",
      "gamma",       "deep pixels", "combined",     "hidden",  "absent"};
  return names[static_cast<std::size_t>(fault)];
}

HardFrame hard_frame(const HardCase& given, unsigned seed) {
  Making m{std::mt19937_64(1000 * static_cast<unsigned>(given.fault) + seed), {}, {}, {}, {}, {}, 6};
  m.least_minor_px = least_minor_px(given);
  set_up_camera(m);
  set_up_mark(m, seed % 2 == 1);
  apply(m, given);
  const bool present = given.fault != Fault::absent;
  if (present) {
    const Mark& mark = m.mark;
    m.scene.layers.push_back(
        disc_layer(mark.centre_px, mark.diameter_px, mark.axis_ratio, mark.angle_rad, mark.grey));
  }
  m.scene.layers.insert(m.scene.layers.end(), m.above.begin(), m.above.end());
  HardFrame frame;
  frame.shot = shoot(expose_scene(m.scene, m.lens, m.sensor), m.sensor, m.random);
  frame.search = search_for(m.mark);
  frame.visible = present && given.fault != Fault::hidden;
  frame.centre_px = m.mark.centre_px;
  return frame;
}

}  // namespace zeropose::test
