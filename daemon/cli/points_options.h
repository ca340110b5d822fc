// What calibrate points and calibrate ball share: options, the calibration's problem and its answer.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration.h"
#include "daemon/cli/answer.h"
#include "daemon/cli/verb.h"

namespace zeropose::cli {

struct PointsOptions {
  std::string points, method = "auto", refine = "auto", residual = "reprojection", model, start, active, name;
  std::string output, report, report_json, angles = "deg";
  std::optional<std::string> origin;
  std::optional<double> tz_mm;
  std::vector<std::string> fix;
  int width_px = 0, height_px = 0;
  double reject_px = 0, reject_mm = 0, sigma_px = 0, robust = 0, pitch_mm = 0, frame_offset_z_mm = 0;
  bool on_hand = false;       // of a robot: the camera that is written has X_HC
  std::string pose = "X_WC";  // what the report calls the camera's pose
  bool search_origin = false, one_focal = false, replace = false, json = false;
};

// What calibrate() borrows, and the files beside it.
struct PointsInput {
  std::vector<CalibrationPoint> points;
  CalibrationProblem problem;
  std::optional<CalibratedCamera> active;
};

// Everything of the problem, which borrows the input's points.
std::unique_ptr<PointsInput> input_of(const PointsOptions& options, std::vector<CalibrationPoint> points);

// Throws std::invalid_argument where options exclude each other or a file would be overwritten.
void refuse_contradictions(const PointsOptions& options);

// Of a result that is ok; writes the files that the options ask for.
Answer answer_of(const PointsOptions& options, const PointsInput& input, const CalibrationResult& result,
                 const std::string& source);

void add_problem_options(cli::Verb verb, PointsOptions& options);  // but --points
void add_answer_options(cli::Verb verb, PointsOptions& options);

}  // namespace zeropose::cli
