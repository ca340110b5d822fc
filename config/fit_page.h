// The page of a calibration that is a fit of poses or places: robot's tool, hand-eye, stereo sensor, pose of
// a camera (spec 40). One SVG file that needs no other.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/calibration.h"
#include "config/fit_plots.h"
#include "config/report_sheet.h"

namespace zeropose {

struct ValueTable {
  std::string title;
  std::vector<ValueRow> rows;
  std::string note;
};

// Points that a camera saw, beside where the result puts them.
struct ImageFit {
  std::string camera;  // its name, where there are several
  CameraModel model;
  std::vector<CalibrationPoint> points;
  std::vector<CalibrationDeviation> deviations;  // one per point
  std::vector<std::string> names;                // one per point; empty: numbered
};

struct ErrorPlot {
  std::string title;  // with the unit
  std::vector<ErrorBar> bars;
};

// What is empty is not drawn.
struct FitReport {
  std::string title, source;
  std::string summary;
  std::vector<Finding> findings;  // the worst gives the summary its colour
  ValueTable result, beside;
  std::vector<std::pair<std::string, std::string>> facts;
  std::vector<ErrorPlot> errors;
  std::vector<HandTurn> turns;
  ReportList list;
  std::vector<ImageFit> images;
};

std::string fit_page(const FitReport& report);

// Of six numbers, the covariance that of the delta in moved().
std::vector<ValueRow> pose_rows(const Pose& X_AB, const Matrix6& covariance,
                                const std::optional<Pose>& active = std::nullopt);
std::vector<ValueRow> place_rows(const Eigen::Vector3d& p_mm, const Eigen::Matrix3d& covariance_mm2,
                                 const std::optional<Eigen::Vector3d>& active_mm = std::nullopt);

// "moved", "turned": how far two poses are apart.
std::vector<std::pair<std::string, std::string>> change_facts(const Pose& X_AB,
                                                              const std::optional<Pose>& active);

// Good where nothing was left out and nothing is warned of.
void add_warnings(FitReport& report, const std::vector<std::string>& warnings);

}  // namespace zeropose
