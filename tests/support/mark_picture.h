// Pictures of ellipses and polygons with known truth, made without any code or model of the estimators: the
// area of the exact outline, in fine strips, under a numerically integrated Gaussian lens blur and
// square pixels.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "measure/image.h"

namespace zeropose::test {

// Convex figure: an ellipse (half axes a, b > 0; a along angle) or, if corners are given, a polygon.
struct Figure {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double a_px = 0, b_px = 0;
  double angle_rad = 0;
  std::vector<Eigen::Vector2d> corners_px;  // convex, absolute
  double grey = 0;
};

// What the lens shows: figures painted one over the other on a background, times linear shading, noise, 8
// bit.
struct Drawing {
  int width_px = 0, height_px = 0;
  double background = 160;
  std::vector<Figure> figures;
  double blur_sigma_px = 0.7;
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();  // relative, about the picture's middle
  int fineness = 6;                                          // strips per pixel
};

// Grey levels as real numbers, row by row.
struct Picture {
  int width_px = 0, height_px = 0;
  std::vector<double> grey;
};

struct Pixels {
  int width_px = 0, height_px = 0;
  std::ptrdiff_t stride_bytes = 0;
  std::vector<std::uint8_t> grey;

  ImageView view() const { return {grey.data(), width_px, height_px, stride_bytes}; }
};

Picture paint(const Drawing& drawing);

Figure ellipse(const Eigen::Vector2d& centre_px, double diameter_px, double axis_ratio, double angle_rad,
               double grey);

// What stands round marks in a works: beams across the picture, plates with holes' edges, hexagonal bolts,
// round blobs outside the range of sizes (min..max diameter), slots and scratches, some lighter and some
// darker than the background. Nothing in it is a round disc within the range. keep_clear: left free round the
// middle, px.
void add_clutter(Drawing& drawing, double min_diameter_px, double max_diameter_px, double keep_clear_px,
                 std::mt19937_64& random);

// One exposure: Gaussian noise, clipped and rounded to 8 bit. sigma 0: rounding only.
Pixels expose(const Picture& picture, double noise_sigma, std::mt19937_64& random);

}  // namespace zeropose::test
