// The crossing of two edges, where four squares of a chessboard meet, by a fit to its grey levels. Internal
// to the room.
#pragma once

#include <Eigen/Core>

#include "measure/image.h"

namespace zeropose {

struct SaddleStart {
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d steps_px = Eigen::Matrix2d::Zero();  // columns: along the two edges, one square each
};

struct SaddleFit {
  bool converged = false;
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double step_grey =
      0;  // positive: the square between the two positive edges (and the opposite one) is bright
};

// Model: mean + g . x + step / 2 * erf(d1 / (sqrt 2 s)) * erf(d2 / (sqrt 2 s)), d1 and d2 the distances from
// the two edges: nine unknowns (crossing, two directions, blur, mean, gradient, step) over the pixels within
// 0.4 of a square, at most 12 px. Where the edges are not at right angles the blur is not quite a product,
// but the error is even about the crossing and does not move it. Covariance: inverse information times the
// residual variance, never below that of rounding. Not converged: too few pixels, or the crossing leaves its
// start by more than 2.5 px.
SaddleFit fit_saddle(const ImageView& image, const SaddleStart& start);

}  // namespace zeropose
