// Calibration by linear equations: the start of every refinement, and an answer by itself (spec 30 C1..C3).
// Each is one overdetermined homogeneous system for the rotation and translation, solved with centred and
// scaled coordinates, so that a world origin on an axis of the camera or in its plane does no harm; then one
// for focal length, distortion and distance.
#pragma once

#include <optional>
#include <string>

#include "calib/calibration.h"

namespace zeropose {

struct LinearProblem {
  std::span<const CalibrationPoint> points;
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();  // held (C1, C2)
  double aspect = 1;                                    // fx / fy, held (C1)
  // What tells the distance of a board parallel to the chip (C1): it, or the focal length.
  std::optional<double> tz_mm;  // depth of the points' centroid
  std::optional<double> fy_px;
};

struct LinearResult {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;
  CameraModel model;  // division; width and height are not set
  Pose X_WC = Pose::Identity();
  double condition = 0;  // of the least well conditioned system, columns scaled
};

// C1, Tsai 1987: points in one plane (any: X_WP, whose x and y axes span it), at least 5. Gives fx = aspect *
// fy, K, pose. A board parallel to the chip: parallel_to_chip, with the ratios in the reason, unless tz_mm is
// given.
LinearResult calibrate_coplanar(const LinearProblem& problem, const Pose& X_WP);

// C2, Tsai 1987: points with depth, at least 7. Gives fx, fy, K, pose.
LinearResult calibrate_noncoplanar(const LinearProblem& problem);

// C3, direct linear transformation without distortion: points with depth, at least 6. Gives fx, fy, cx, cy,
// pose.
LinearResult calibrate_linear(const LinearProblem& problem);

}  // namespace zeropose
