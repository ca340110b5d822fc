// The cell file: everything an engineer decides about one cell, as plain values (spec 95).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "config/config_error.h"
#include "drivers/camera.h"
#include "measure/correction.h"
#include "measure/job.h"
#include "measure/references.h"
#include "protocol/link_options.h"

namespace zeropose {

struct RobotOptions {
  std::string name;
  LinkOptions link;
  Convention convention = Convention::generic;
  CorrectionFrame frame = CorrectionFrame::object_zero;
  Pose X_WR = Pose::Identity();    // on an axis: where the base was taught
  std::optional<LinearAxis> axis;  // that the base rides on; its position comes with Measure
  std::chrono::milliseconds validity{2000};
};

struct Cell {
  std::string name;
  bool simulated = false;
  std::vector<CameraOptions> cameras;
  std::filesystem::path calibration_file;           // empty when the cell was not read from files
  std::vector<CalibratedCamera> calibration;        // same order as cameras
  std::vector<std::optional<std::size_t>> hand_of;  // likewise: the robot that carries it; none: it is fixed
  std::vector<Job> jobs;
  References references;  // without points: no camera is checked
  std::vector<RobotOptions> robots;
  std::chrono::milliseconds deadline{500};  // command to answer, including the grab
  int zero_frames = 10;                     // averaged for a zero measurement
  std::chrono::milliseconds zero_deadline{10000};
  std::uint32_t config_hash = 0;       // first four bytes of SHA-256 over the cell file
  std::uint32_t calibration_hash = 0;  // ... over the calibration file
};

// Reads and validates the cell file and the calibration file that it names. Throws ConfigError with all
// mistakes at once.
Cell load_cell(const std::filesystem::path& path);

// Where the calibration of a cell lies, also when that file cannot be read. Throws ConfigError.
std::filesystem::path calibration_file_of(const std::filesystem::path& cell);

// The same from the bytes of both files; the names are for messages. For tools and tests that hold no files.
struct CellText {
  std::string cell, cell_name;
  std::string calibration, calibration_name;
};
Cell parse_cell(const CellText& text);

// The cameras that a job sees with, as View::camera counts them: the cell's, then those of each of the job's
// positions with the robot's hand at X_RH, one per position, by default where it was taught. A camera on a
// hand has no place in the world of its own.
std::vector<CalibratedCamera> cameras_for(const Cell& cell, const Job& job, std::span<const Pose> X_RH = {});

// The name of a view's camera.
std::string camera_name(const Cell& cell, const Job& job, std::size_t view_camera);

// Every key that a cell file may have, as "jobs[].marks[].name": what the loader asks for, to compare with
// config/cell.schema.json.
std::set<std::string> known_cell_keys();

}  // namespace zeropose
