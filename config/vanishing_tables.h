// The tables of calibrate vanishing (spec 92).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calib/vanishing.h"
#include "config/config_error.h"

namespace zeropose {

// Columns v1_u_px v1_v_px v2_u_px v2_v_px. Throws ConfigError with every mistake, as the next one.
std::vector<VanishingPair> load_vanishing_pairs(const std::filesystem::path& path);

struct RectangleImage {
  std::string name;
  RectangleCorners corners_px;
};

// Columns image corner u_px v_px; corner 1 to 4 is A to D, each once per image, rows in any order. Images in
// the order in which the file first mentions them.
std::vector<RectangleImage> load_rectangle_images(const std::filesystem::path& path);

}  // namespace zeropose
