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
  bool has_pose = false;    // X_WC may be absent in the file of one camera, and is then the identity
};

// `name` chooses among several cameras and may be empty where there is one. Throws ConfigError.
CameraFile load_camera(const std::filesystem::path& path, std::string_view name = {});
CameraFile parse_camera(std::string_view text, const std::string& file, std::string_view name = {});

// {"model": ...} and a line end; with a name {"name": {"model": ...}}.
std::string camera_file_text(const CalibratedCamera& camera);

}  // namespace zeropose
