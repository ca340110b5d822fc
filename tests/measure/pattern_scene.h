// A taught picture and one in which its pattern is searched, for the tests of patterns.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "measure/pattern_search.h"
#include "tests/support/texture_picture.h"

namespace zeropose::test {

inline constexpr double noise = 2;
inline constexpr int patch_px = 41, teach_size = 61, scene_size = 110;
inline const PixelWindow patch_window{10, 10, 50, 50};
inline const Eigen::Vector2d patch_middle(30, 30), scene_middle(54.5, 54.5);

// The picture that is taught and one in which the pattern is searched.
struct PatternScene {
  Texture texture;
  TextureLook taught, seen;

  Eigen::Vector2d truth(const Eigen::Vector2d& clicked_px) const {
    return seen.place_px + seen.linear * (clicked_px - taught.place_px);
  }
  Picture taught_picture() const { return paint_texture(texture, taught, teach_size, teach_size); }
  Picture seen_picture() const { return paint_texture(texture, seen, scene_size, scene_size); }
};

inline Eigen::Matrix2d turned(double angle, double scale = 1, double shear = 0) {
  Eigen::Matrix2d R, S;
  R << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  S << scale, shear, 0, scale;
  return R * S;
}

// +-2 degrees, +-2 % scale and shear, +-20 % gain, +-10 grey levels, +-spread px.
inline PatternScene random_scene(std::uint64_t seed, double spread_px = 5, double contrast = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  PatternScene scene{random_texture(34, seed, contrast), {}, {}};
  scene.taught.place_px = patch_middle + 0.5 * Eigen::Vector2d(unit(random), unit(random));
  scene.seen.place_px = scene_middle + spread_px * Eigen::Vector2d(unit(random), unit(random));
  const double angle = unit(random) * 2 * std::numbers::pi / 180;
  scene.seen.linear = turned(angle, 1 + 0.02 * unit(random), 0.02 * unit(random));
  scene.seen.gain = 1 + 0.2 * unit(random);
  scene.seen.offset_grey = 10 * unit(random);
  return scene;
}

inline Pattern teach(const Pixels& pixels, const Eigen::Vector2d& clicked_px = patch_middle) {
  return teach_pattern(pixels.view(), patch_window, clicked_px);
}

inline MarkSearch search_for(const Pattern& pattern, const Eigen::Vector2d& expected_px = scene_middle,
                             double half_px = 40) {
  MarkSearch search;
  search.kind = MarkKind::pattern;
  search.expected_px = expected_px;
  search.half_window_px = {half_px, half_px};
  search.min_contrast = 5;
  search.pattern = &pattern;
  return search;
}

inline MarkFinding find(const Pixels& pixels, const Pattern& pattern) {
  return find_pattern(pixels.view(), search_for(pattern));
}

inline Picture cut(const Picture& picture, int u0, int v0, int width, int height) {
  Picture part{width, height, {}};
  for (int v = v0; v < v0 + height; ++v) {
    for (int u = u0; u < u0 + width; ++u) {
      part.grey.push_back(picture.grey[static_cast<std::size_t>(v * picture.width_px + u)]);
    }
  }
  return part;
}

inline void fill(Picture& picture, double u0, double v0, double u1, double v1, double grey) {
  for (int v = 0; v < picture.height_px; ++v) {
    for (int u = 0; u < picture.width_px; ++u) {
      if (u < u0 || u > u1 || v < v0 || v > v1) continue;
      picture.grey[static_cast<std::size_t>(v * picture.width_px + u)] = grey;
    }
  }
}

inline void paste(const Picture& part, int u0, int v0, Picture& picture) {
  for (int v = 0; v < part.height_px; ++v) {
    for (int u = 0; u < part.width_px; ++u) {
      picture.grey[static_cast<std::size_t>((v0 + v) * picture.width_px + u0 + u)] =
          part.grey[static_cast<std::size_t>(v * part.width_px + u)];
    }
  }
}

}  // namespace zeropose::test
