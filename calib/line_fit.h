// The straight way of a robot's base on a linear axis, from points that a tracker measured along it (spec 50
// M7).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace zeropose {

// A point that rides on the axis, and what the axis showed.
struct AxisPoint {
  double position_mm = 0;
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
};

enum class LineFitStatus { failed = 0, ok, too_few_points, no_extent, not_finite };

// The line p_W(e) = p_zero_W + e * direction_W.
struct LineFitResult {
  LineFitStatus status = LineFitStatus::failed;
  Eigen::Vector3d direction_W = Eigen::Vector3d::Zero();  // unit vector, towards growing positions
  Eigen::Vector3d p_zero_W_mm = Eigen::Vector3d::Zero();  // where the point is at position 0
  double scale = 0;  // mm along the line for each mm that the axis shows: 1 unless its gauge is wrong
  std::vector<Eigen::Vector3d> residuals_mm;  // p_W - p_W(e), one per point
  double rms_across_mm = 0;                   // of the points about the line
};

// Total least squares: the line through the centroid along which the points spread most, so that errors count
// in every direction alike. Needs three points, and both points and positions that spread over 1 mm.
LineFitResult fit_line(std::span<const AxisPoint> points);

}  // namespace zeropose
