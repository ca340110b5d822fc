// Is this calibration good? In words, with the reasons (spec 40: every report says so).
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

enum class Quality { not_usable = 0, usable, good };
std::string_view name_of(Quality quality);

// How much of the image and of the depth the used points cover.
struct Coverage {
  static constexpr int columns = 8, rows = 6;
  std::array<int, columns * rows> counts{};   // used points per cell, row by row
  std::vector<Eigen::Vector2d> hull_px;       // their convex hull
  double area = 0;                            // of the hull, as a share of the image
  double reach = 0;                           // farthest point / farthest corner, seen from the origin
  double depth_min_mm = 0, depth_max_mm = 0;  // zc
  double depth_range() const { return depth_max_mm > 0 ? 1 - depth_min_mm / depth_max_mm : 0; }
};
Coverage coverage_of(const CalibrationProblem& problem, const CalibrationResult& result);

struct Finding {
  Quality quality = Quality::not_usable;  // what the calibration could be at best, were this all
  std::string text;
};

struct CalibrationVerdict {
  Quality quality = Quality::not_usable;  // the worst of the findings
  std::string summary;                    // one sentence
  std::vector<Finding> findings;          // worst first
};

// Compares residuals, coverage, sigma of the origin, redundancy, correlations and rejected points with the
// limits of docs/calibration.md. A good fit alone is not enough: a wrong camera can have small residuals.
// further_unknowns: estimated from the same points beside those in the result's uncertainty (poses of views).
CalibrationVerdict judge(const CalibrationProblem& problem, const CalibrationResult& result,
                         int further_unknowns = 0);

}  // namespace zeropose
