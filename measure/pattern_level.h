// A pattern made ready for matching at one size: what does not depend on the image. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/grey_field.h"

namespace zeropose {

// Unknowns of a match: shift (2) and change of the linear part (4, row by row), both times the gain, then
// gain and offset.
inline constexpr int match_unknowns = 8;
using MatchMatrix = Eigen::Matrix<double, match_unknowns, match_unknowns>;
using MatchVector = Eigen::Matrix<double, match_unknowns, 1>;

// The pixels of the patch but its outermost ones, whose slopes lean on one side. Rows are filled up to a
// multiple of lanes with pixels that do not count.
struct PatternLevel {
  static constexpr int lanes = 8;

  explicit PatternLevel(const GreyField& patch);

  std::size_t size() const { return grey.size(); }
  double area() const { return double(width) * height; }
  double down(int j) const { return j - 0.5 * (height - 1); }

  int width = 0, height = 0, stride = 0;
  std::vector<float> across;  // of one row: distance from the middle, px
  std::vector<float> grey, slope_u, slope_v;
  std::vector<float> counts;  // 1, or 0 for filling
  Eigen::Vector2d middle_px;  // of the pixels, in the patch
  double mean_grey = 0, variance_grey2 = 0;
};

// Sums of the products of the derivatives over the pixels by weight (one per pixel, as PatternLevel::counts).
MatchMatrix information_of(const PatternLevel& level, const std::vector<float>& weights);

// What noise of variance 1 in the pixels of the patch adds to it, for weights of 1.
MatchMatrix slope_noise_of(const PatternLevel& level);

// Sums of the derivatives times the residuals.
MatchVector gradient_of(const PatternLevel& level, const std::vector<float>& weighted_residuals);

// How the place of a point, given from the middle of the level, moves with the unknowns (gain 1, linear part
// 1).
Eigen::Matrix<double, 2, match_unknowns> motion_of(const Eigen::Vector2d& point_px);

}  // namespace zeropose
