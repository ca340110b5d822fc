// The file CELL.sim.json: what is true about a simulated cell, as plain values.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/camera_model.h"
#include "sim/drive.h"
#include "sim/gap_drive.h"
#include "sim/scene.h"
#include "sim/survey_drive.h"

namespace zeropose {

struct SimFile {
  std::vector<CalibratedCamera> cameras;  // in the order of the file
  ObjectTruth object;
  PictureSettings picture;
  std::optional<DriveOptions> drive;
  std::optional<GapDriveOptions> gap_drive;
  std::vector<SurveyDrive> surveys;
};

// JSON with comments. Throws ConfigError with all mistakes: unreadable file, unknown or missing keys, wrong
// types, values out of range.
SimFile load_sim_file(const std::filesystem::path& path);

// Reads the table of the body that a survey shows; nothing to do for others. Throws ConfigError: also for
// marks without a radius or a normal.
void load_marks(SurveyDrive& survey);

// A calibration file of these cameras with `comment` as its first line.
std::string calibration_text(std::span<const CalibratedCamera> cameras, std::string_view comment);

}  // namespace zeropose
