// Files that verbs write.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "config/atomic_file.h"
#include "config/camera_file.h"
#include "config/fit_page.h"
#include "config/text.h"
#include "daemon/cli/answer.h"

namespace zeropose::cli {

// A file in use is never overwritten silently. Throws std::invalid_argument when it exists and nobody said
// --replace.
inline void refuse_existing(const std::filesystem::path& path, bool replace) {
  std::error_code ignored;
  if (!replace && std::filesystem::exists(path, ignored))
    throw std::invalid_argument(
        concat({path.string(), ": the file exists; another name, or --replace (the old one is kept as ",
                path.string(), ".previous)"}));
}

// The camera with another pose in the world, ready for `zeropose calibration activate`.
inline void write_moved_camera(const std::filesystem::path& path, CameraFile camera, const Pose& X_WC) {
  camera.has_pose = true;
  camera.camera.on_hand = false;
  camera.camera.X_WC = X_WC;
  replace_file(path, camera_file_text(camera));
}

// The page of a report.
inline void write_page(const std::filesystem::path& path, const FitReport& report, Answer& answer) {
  replace_file(path, fit_page(report));
  answer.text += concat({"written: ", path.string(), "\n"});
}

}  // namespace zeropose::cli
