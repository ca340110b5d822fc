// Calibrated cameras as files: {"camera1": {"model": "division", ...}, ...} (spec 92).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "config/config_error.h"

namespace zeropose {

class JsonObject;

// The cameras in the order of the file. Throws ConfigError with all mistakes.
std::vector<CalibratedCamera> load_cameras(const std::filesystem::path& path);
// The same from the text of a file; `file` names it in messages.
std::vector<CalibratedCamera> parse_cameras(std::string_view text, const std::string& file);

// The members of an object as cameras by name: for files that hold cameras beside other things.
std::vector<CalibratedCamera> read_cameras(JsonObject& cameras);
// One camera without its name.
CalibratedCamera read_camera(JsonObject& camera);
// Its internals only.
CameraModel read_model(JsonObject& camera);

// The text of such a file. Internals round-trip exactly, poses to 1e-9 mm and 1e-12 rad (six numbers).
std::string cameras_text(const std::vector<CalibratedCamera>& cameras);
// One camera of such a file, without its name: "Camera JSON" of spec 92. Without its pose no cell takes it.
std::string camera_text(const CalibratedCamera& camera, bool with_pose = true);
// Writes it atomically and keeps the previous file as path.previous. Throws std::system_error.
void save_cameras(const std::filesystem::path& path, const std::vector<CalibratedCamera>& cameras);

}  // namespace zeropose
