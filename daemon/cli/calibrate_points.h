// What calibrate points does once the points are there, for the verbs that get them in another way.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration.h"
#include "daemon/cli/answer.h"

namespace zeropose::cli {

struct PointsOptions {
  std::string points, method = "auto", refine = "auto", residual = "reprojection", model, start, active, name;
  std::string output, report, report_json, angles = "deg";
  std::optional<std::string> origin;
  std::optional<double> tz_mm;
  std::vector<std::string> fix;
  int width_px = 0, height_px = 0;
  double reject_px = 0, reject_mm = 0, sigma_px = 0, robust = 0, pitch_mm = 0, frame_offset_z_mm = 0;
  bool search_origin = false, one_focal = false, replace = false, json = false;
};

// All but --points.
void add_points_options(CLI::App& verb, PointsOptions& options);

struct PointsAnswer {
  Answer answer;
  CalibrationResult result;
};

// Calibrates from these points, which PointsOptions::points is not read for, and writes the files.
// source: where they come from, for the report.
PointsAnswer calibrate_from(const PointsOptions& options, std::vector<CalibrationPoint> points,
                            const std::string& source);

}  // namespace zeropose::cli
