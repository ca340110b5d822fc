// The wheel's plane and circle through the points of one profile (spec 70, wheel-alignment).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// The frame of a wheel: origin in the middle of the circle, z along the axis, x forward and y up. The turn
// about z is unknown, so rz = 0 in W: R = Ry(ry) Rx(rx).
Pose wheel_frame(const Eigen::Vector3d& centre_W_mm, const Eigen::Vector3d& axis_W);

// Turns of the axis against that of the zero wheel, about x (camber) and y (toe) of the latter's frame: rx
// and ry of the relative frame with rz = 0.
struct WheelAngles {
  double camber_rad = 0, toe_rad = 0;
};
WheelAngles wheel_angles(const Pose& X_WO0, const Pose& X_WO);

struct WheelPlanePoint {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;         // along the axis, > 0
  double sigma_radius_mm = 0;  // outwards, > 0
};

struct WheelPlaneProblem {
  std::span<const WheelPlanePoint> points;               // four and more; nine for three sensors
  Eigen::Vector3d towards_W = Eigen::Vector3d::UnitZ();  // the side of the plane to which its axis points
  // How uneven tyres are: sigma of a point along the axis and outwards, beside its own.
  double unevenness_mm = 0.15, out_of_round_mm = 0.3;
};

enum class WheelPlaneStatus {
  failed = 0,
  ok,
  wrong_problem,   // fewer than four points, a number that is none, a sigma that is not positive
  not_determined,  // the points lie on a line, or on a short arc
  contradiction    // a point is not in the plane, or not on the circle, of the others
};
std::string_view name_of(WheelPlaneStatus status);

struct WheelPlaneResult {
  WheelPlaneStatus status = WheelPlaneStatus::failed;
  std::string reason;            // one sentence with the numbers, empty when ok
  Pose X_WO = Pose::Identity();  // see wheel_frame()
  double radius_mm = 0;          // of the circle
  // Of turns about x and y of O, rad^2: from the points' sigmas, and together with the unevenness.
  Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d total_covariance_rad2 = Eigen::Matrix2d::Zero();
  std::vector<double> off_plane_mm, off_circle_mm;  // of each point: + along the axis, + outwards
  std::optional<std::size_t> wrong_point;           // contradiction: the one that fits worst
};

// Least squares by the points' total sigmas; then every point is tested by its residual over that residual's
// own sigma, 0.1 % false alarm for all points together. A wrong point is named and never left out or averaged
// in: the result then has no frame that counts.
WheelPlaneResult fit_wheel_plane(const WheelPlaneProblem& problem);

}  // namespace zeropose
