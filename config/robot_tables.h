// The tables of a robot's calibrations: poses of its hand, and what was seen at them (spec 92, calibrate
// tool, hand-eye and ball).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calib/calibration.h"
#include "calib/hand_eye.h"
#include "config/config_error.h"

namespace zeropose {

struct HandPose {
  std::string name;
  Pose X_RH = Pose::Identity();
};

// X_RH by name, as load_named_poses(). All throw ConfigError with every mistake.
std::vector<HandPose> load_hand_poses(const std::filesystem::path& path, std::string_view column,
                                      bool required);

// robot: as above with view; points: view x_mm y_mm [z_mm] u_px v_px and more as of calibrate views, one
// camera. A view of the points that the robot's table does not have is a mistake, the other way round it has
// no points.
std::vector<HandEyeView> load_hand_eye_views(const std::filesystem::path& robot,
                                             const std::filesystem::path& points);

// One pixel per view, with its covariance. Columns view u_px v_px [suu svv suv].
struct ViewPixel {
  std::string view;
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
};
// A view that is not among the poses is a mistake.
std::vector<ViewPixel> load_view_pixels(const std::filesystem::path& path, std::span<const HandPose> poses);

}  // namespace zeropose
