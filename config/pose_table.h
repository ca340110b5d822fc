// Poses by name, as tables have them (spec 92).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/rigid.h"
#include "config/config_error.h"

namespace zeropose {

using NamedPoses = std::vector<std::pair<std::string, Pose>>;

// Columns x_mm y_mm z_mm rx_deg ry_deg rz_deg and a name in `column` ("view", "touch"), each once; where the
// column is not required and absent, names are 1, 2, ... Throws ConfigError with every mistake.
NamedPoses load_named_poses(const std::filesystem::path& path, std::string_view column = "view",
                            bool required = true);

}  // namespace zeropose
