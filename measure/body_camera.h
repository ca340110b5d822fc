// The rough camera that a numbering of a calibration body implies. Internal to the room: it tells marks from
// clutter; the camera is calibrated elsewhere.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "calib/camera_model.h"

namespace zeropose {

struct BodyPair {
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
};

// What is believed of the internals before, and how firmly.
struct RoughInternals {
  CameraModel model;
  double sigma_focal = 0.2;     // of the focal length's logarithm
  double sigma_aspect = 0.02;   // of the logarithm of fy / fx
  double sigma_origin_px = 20;  // of cx and cy
  double sigma_bend = 0.05;     // what the lens does at the image's corner, relative; division model only
};

struct RoughCamera {
  CameraModel model;
  Pose X_CB = Pose::Identity();
  double cost = 0;  // robust, in units of one pixel's variance
};

// The pose of a plane from how it is stretched at one of its places: du/dplace there. Columns of axes_B: the
// plane's x, y and normal. Two, for the tilt's sign is open.
std::array<Pose, 2> poses_of_plane(const CameraModel& model, const Eigen::Vector3d& p_B_mm,
                                   const Eigen::Matrix3d& axes_B, const Eigen::Vector2d& u_px,
                                   const Eigen::Matrix2d& stretch);

// Maximum a posteriori of pose, focal lengths, origin and lens, with Cauchy's loss from scale_px on. Nothing
// where it does not converge in front of the camera.
std::optional<RoughCamera> fit_rough_camera(const RoughInternals& before, const RoughCamera& start,
                                            std::span<const BodyPair> pairs, double scale_px);

}  // namespace zeropose
