#include "calib/line_fit.h"

#include <algorithm>
#include <cmath>

#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

constexpr double least_extent_mm = 1;

LineFitResult refused(LineFitStatus status) {
  LineFitResult result;
  result.status = status;
  return result;
}

bool finite(const AxisPoint& point) { return std::isfinite(point.position_mm) && point.p_W_mm.allFinite(); }

}  // namespace

LineFitResult fit_line(std::span<const AxisPoint> points) {
  if (points.size() < 3) return refused(LineFitStatus::too_few_points);
  if (!std::all_of(points.begin(), points.end(), finite)) return refused(LineFitStatus::not_finite);
  const double count = static_cast<double>(points.size());
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double middle_mm = 0;
  for (const AxisPoint& point : points) {
    centroid += point.p_W_mm / count;
    middle_mm += point.position_mm / count;
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d with_position = Eigen::Vector3d::Zero();
  double squares_mm2 = 0;
  for (const AxisPoint& point : points) {
    const Eigen::Vector3d p = point.p_W_mm - centroid;
    const double e = point.position_mm - middle_mm;
    spread += p * p.transpose();
    with_position += e * p;
    squares_mm2 += e * e;
  }
  const SymmetricEigen eigen = symmetric_eigen(spread);
  const double least_mm2 = count * least_extent_mm * least_extent_mm;
  if (!(squares_mm2 > least_mm2) || !(eigen.values(2) > least_mm2)) return refused(LineFitStatus::no_extent);

  LineFitResult result;
  result.status = LineFitStatus::ok;
  const Eigen::Vector3d direction = eigen.vectors.col(2);
  result.direction_W = direction.dot(with_position) < 0 ? Eigen::Vector3d(-direction) : direction;
  result.p_zero_W_mm = centroid - middle_mm * result.direction_W;
  result.scale = result.direction_W.dot(with_position) / squares_mm2;
  for (const AxisPoint& point : points)
    result.residuals_mm.emplace_back(point.p_W_mm - result.p_zero_W_mm -
                                     point.position_mm * result.direction_W);
  result.rms_across_mm = std::sqrt(std::max(0.0, eigen.values(0) + eigen.values(1)) / count);
  return result;
}

}  // namespace zeropose
