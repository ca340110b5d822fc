// Cameras from and to the files of OpenCV (cv::FileStorage YAML) and ROS (camera_info YAML). Both know the
// Brown-Conrady model only (calib/lens_conversion.h) and no pose. Their pixel (0, 0) is the centre of the
// top-left pixel, as ours (spec 10).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "calib/camera_model.h"
#include "config/config_error.h"

namespace zeropose {

enum class CameraFormat { zeropose, opencv, ros };
std::string_view name_of(CameraFormat format);
std::optional<CameraFormat> camera_format_named(std::string_view name);

// 0: not known
struct ImageSize {
  int width_px = 0, height_px = 0;
};

// A camera of either format. `size` is for files that do not state it; `file` names the text in messages.
// X_WC is the identity. Also reads the keys of OpenCV's calibration samples and a printed camera_info message
// (width, height, K, D) of the whole image in full resolution. Throws ConfigError: not YAML, keys missing, a
// skew, a model other than Brown-Conrady (fisheye, rational with k4 k5 k6, thin prism, tilt).
CalibratedCamera parse_yaml_camera(std::string_view text, const std::string& file, ImageSize size = {});

// Numbers read back exactly. Throws std::invalid_argument for a division model: convert it before.
std::string opencv_camera_text(const CameraModel& camera);
std::string ros_camera_text(const CameraModel& camera, const std::string& name);

}  // namespace zeropose
