// The image origin by search (spec 30 C5): at every candidate the other parameters are calibrated anew by the
// linear method; the origin with the least residuals of (E1) is the one.
#pragma once

#include <Eigen/Core>

#include "calib/calibration.h"
#include "calib/point_layout.h"

namespace zeropose {

struct OriginProblem {
  std::span<const CalibrationPoint> points;
  Eigen::Vector2d start_px = Eigen::Vector2d::Zero();
  double aspect = 1;   // fx / fy, held where the points are coplanar
  double step_px = 8;  // of the first triangle
};

struct OriginResult {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();
  double rms_px = 0;  // of the residuals of (E1), undistorted pixels, per point
  int evaluations = 0;
};

// Needs points with depth; with those of one plane (`layout`) the origin follows from the distortion alone.
OriginResult search_origin(const OriginProblem& problem, const PointLayout& layout);

// Sum of the squared residuals of (E1) in undistorted pixels: fx (xd / (1 + K r2) - xc / zc) and the same for
// y. Infinite where a pixel has no ray or a point is behind the camera.
double residual_sum_e1(std::span<const CalibrationPoint> points, const CameraModel& camera, const Pose& X_WC);

}  // namespace zeropose
