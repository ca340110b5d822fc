// The file of one camera: {"model": "division", ...}, or a file of cameras by name of which one is meant
// (spec 92).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/cameras.h"

namespace zeropose {

struct CameraFile {
  CalibratedCamera camera;  // the name is empty where the file has none
  bool has_pose = false;    // where X_WC (on a hand: X_HC) is absent it is the identity
};

// `name` chooses among several cameras and may be empty where there is one. Throws ConfigError.
CameraFile load_camera(const std::filesystem::path& path, std::string_view name = {});
CameraFile parse_camera(std::string_view text, const std::string& file, std::string_view name = {});

// {"model": ...} and a line end; with a name {"name": {"model": ...}}. X_WC is left out where there is none:
// a cell then refuses the camera instead of believing in a pose that nobody measured.
std::string camera_file_text(const CameraFile& file);

}  // namespace zeropose
