// The tables of a calibration body (spec 40 P3): its marks, and its control marks in world and body.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calib/best_fit.h"
#include "config/config_error.h"
#include "measure/body.h"

namespace zeropose {

// Columns mark x_mm y_mm z_mm [radius_mm nx ny nz], each mark once. Throws ConfigError with every mistake.
std::vector<BodyMark> load_body(const std::filesystem::path& path);

struct ControlMark {
  std::string name;  // its line's number where the table has no names
  PointPair pair;    // A: the frame of the measuring system, B: the body
};

// Columns [mark] xa ya za xb yb zb [weight], mm. Throws likewise.
std::vector<ControlMark> load_control_marks(const std::filesystem::path& path);

}  // namespace zeropose
