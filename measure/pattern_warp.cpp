// What the numbers of a match say about the patch and its clicked point.
#include <Eigen/LU>
#include <cmath>

#include "measure/pattern_fit.h"

namespace zeropose {
namespace {

Eigen::Vector2d from_middle(const Pattern& pattern) {
  return pattern.clicked_px - 0.5 * Eigen::Vector2d(pattern.width_px - 1, pattern.height_px - 1);
}

}  // namespace

double rotation_of(const PatternWarp& warp) {
  return std::atan2(warp.linear(1, 0) - warp.linear(0, 1), warp.linear(0, 0) + warp.linear(1, 1));
}

double scale_of(const PatternWarp& warp) { return std::sqrt(std::abs(warp.linear.determinant())); }

double squeeze_of(const PatternWarp& warp) {
  const Eigen::Matrix2d& A = warp.linear;
  const double like = std::hypot(A(0, 0) + A(1, 1), A(1, 0) - A(0, 1));
  const double unlike = std::hypot(A(0, 0) - A(1, 1), A(1, 0) + A(0, 1));
  return like + unlike > 0 ? (like - unlike) / (like + unlike) : 0;
}

GreyField field_of(const Pattern& pattern) { return {pattern.width_px, pattern.height_px, pattern.greys}; }

Eigen::Vector2d clicked_place(const Pattern& pattern, const PatternFit& fit) {
  return fit.warp.middle_px + fit.warp.linear * from_middle(pattern);
}

Eigen::Matrix2d clicked_covariance(const Pattern& pattern, const PatternFit& fit) {
  const Eigen::Matrix<double, 2, match_unknowns> M = fit.warp.linear * motion_of(from_middle(pattern));
  const Eigen::Matrix2d C = M * fit.covariance * M.transpose();
  return 0.5 * (C + C.transpose());
}

}  // namespace zeropose
