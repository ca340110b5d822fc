// The tables that cameras are calibrated from (spec 92, calibrate points and calibrate views).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calib/calibration.h"
#include "calib/views.h"
#include "config/config_error.h"

namespace zeropose {

// Columns x_mm y_mm [z_mm] u_px v_px [suu svv suv] [radius_mm nx ny nz]; id, row, col and mark are allowed
// and not read.
//   z_mm           without the column 0: a board
//   suu svv suv    px^2, all or none; none: the identity, one pixel
//   radius_mm      of a flat disc, whose normal nx ny nz (any length) must then be given
// Throws ConfigError with every mistake.
std::vector<CalibrationPoint> load_calibration_points(const std::filesystem::path& path);

// What calibrate_views() needs. Names stand in the order in which the file first mentions them.
struct CalibrationViews {
  std::vector<std::string> cameras, views;
  std::vector<ViewPoint> points;
};

// The same columns with view and [camera]; without the column camera there is one, "camera". Coordinates are
// the board's; a disc without normal lies in its plane: 0 0 1. Throws ConfigError with every mistake.
CalibrationViews load_calibration_views(const std::filesystem::path& path);

}  // namespace zeropose
