// A frame from points that a measuring system found on it: the 3-2-1 rule, and least squares where there are
// more (the world frame of a cell in a laser tracker's frame T).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// What a point says of the frame W: it is the origin, lies on the positive x axis, or in the xy plane (the
// points there, taken together, on the side of positive y).
enum class FrameRole { origin, x_axis, xy_plane };

struct FramePoint {
  std::string name;
  FrameRole role = FrameRole::xy_plane;
  Eigen::Vector3d p_T_mm = Eigen::Vector3d::Zero();
};

enum class MeasuredFrameStatus {
  failed = 0,
  ok,
  wrong_problem,   // a number that is none
  too_few_points,  // a role without a point
  no_direction,    // the x points are at the origin, or the points of the plane on the x axis
  wrong_side,      // a point of the x axis on its negative side
  not_converged
};

struct MeasuredFrame {
  MeasuredFrameStatus status = MeasuredFrameStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  Pose X_TW = Pose::Identity();
  // Where the points are beside what their role says, axes of W; what a role leaves free is 0.
  std::vector<Eigen::Vector3d> residuals_W_mm;
  double sigma_mm = 0;  // of one coordinate: as given, or from the residuals; 0: nothing to estimate it from
  Matrix6 covariance = Matrix6::Zero();  // of the delta in moved(), scaled with sigma_mm
  int redundancy = 0;
};

// Least squares of the residuals. sigma_mm of a measured coordinate; 0: from the residuals.
MeasuredFrame measured_frame(std::span<const FramePoint> points, double sigma_mm);

}  // namespace zeropose
