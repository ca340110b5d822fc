// The camera model: internals, lens distortion, projection and rays (spec 20).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>

#include "calib/rigid.h"

namespace zeropose {

// One-parameter division model on the observed normalised coordinates (spec 20, E1): undistorted = distorted
// / (1 + K r^2).
struct Division {
  double K = 0;
};

// Brown-Conrady on the undistorted normalised coordinates, as in OpenCV: k1 k2 p1 p2 k3.
struct BrownConrady {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

using Distortion = std::variant<Division, BrownConrady>;

// Internal parameters. Pixel (0, 0) is the centre of the top-left pixel, so an image spans [-0.5, size -
// 0.5].
struct CameraModel {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0;
  double cx_px = 0, cy_px = 0;  // image origin (principal point)
  Distortion distortion = Division{};
};

// A camera as calibrated: what it is called, its internals and its pose in the world.
struct CalibratedCamera {
  std::string name;
  CameraModel model;
  Pose X_WC = Pose::Identity();
  bool on_hand = false;  // of a robot: X_WC is X_HC
};

// A camera on a robot's hand is another camera at each position of the robot: where the given one, calibrated
// in the hand's frame (its X_WC is X_HC), stands while the hand is at X_RH. Its pose is then X_RC = X_RH X_HC
// (spec 50 M3).
CalibratedCamera virtual_camera(const CalibratedCamera& camera_in_hand, const Pose& X_RH);

struct Projection {
  Eigen::Vector2d u_px;
  Eigen::Matrix<double, 2, 3> du_dp;  // px per mm of p_CQ
};

// The internals as numbers: fx fy cx cy and then K 0 0 0 0 (division) or k1 k2 p1 p2 k3 (Brown).
inline constexpr int internals_count = 9;
using Internals = Eigen::Matrix<double, internals_count, 1>;
Internals internals_of(const CameraModel& camera);
CameraModel with_internals(CameraModel camera, const Internals& internals);

struct FullProjection {
  Eigen::Vector2d u_px;
  Eigen::Matrix<double, 2, 3> du_dp;                // px per mm of p_CQ
  Eigen::Matrix<double, 2, internals_count> du_di;  // by the internals, zero where the lens has none
};

// The pixel of the point p_CQ (mm, camera frame), or nullopt where it has no image: behind the camera,
// outside the range in which the distortion is monotonic, or not finite. The pixel may lie outside the chip.
std::optional<Eigen::Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& p_CQ_mm);
std::optional<Projection> project_with_jacobian(const CameraModel& camera, const Eigen::Vector3d& p_CQ_mm);
std::optional<FullProjection> project_with_all_jacobians(const CameraModel& camera,
                                                         const Eigen::Vector3d& p_CQ_mm);

// The direction vector (x, y, 1) of a pixel in the camera frame, or nullopt outside the valid range of the
// model.
std::optional<Eigen::Vector3d> ray(const CameraModel& camera, const Eigen::Vector2d& u_px);

// True when the pixel lies on the chip.
bool in_image(const CameraModel& camera, const Eigen::Vector2d& u_px);

}  // namespace zeropose
