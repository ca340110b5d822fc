// How the points of a calibration lie in space and in the image: what decides the method and names the
// degenerate inputs (spec 30).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

// Best-fit plane and extent of a set of points.
struct PointLayout {
  Pose X_WP = Pose::Identity();  // P: origin in the centroid, z along the direction of the least extent
  Eigen::Vector3d extent_mm = Eigen::Vector3d::Zero();  // root mean square along x, y, z of P, falling
  std::vector<std::size_t> in_plane;  // the 95 % nearest to their own best-fit plane (at least all but one)
  double thickness_mm = 0;            // largest distance of those from it
  bool collinear = false;
  bool coplanar = false;  // those 95 % lie in one plane (X_WP): "the majority eats the minority"
};

// Precondition: finite points. Below 1 % of the largest extent the depth is too thin to calibrate from.
PointLayout layout_of(std::span<const CalibrationPoint> points);

// What is wrong with the numbers as they stand: not finite, repeated, too few different ones, on a line, all
// in one spot of the image.
struct InputFault {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;
};
std::optional<InputFault> fault_of(const CalibrationProblem& problem);

// "point 7 (12.5, 0, 30)": counted from 1.
std::string name_of_point(std::span<const CalibrationPoint> points, std::size_t index);

}  // namespace zeropose
