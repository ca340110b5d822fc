// Points for calibrations: published ones and a synthetic camera's.
#pragma once

#include <string>
#include <vector>

#include "calib/calibration.h"
#include "tests/support/csv.h"

namespace zeropose::test {

// The 27 ball positions of table 4.2; pixels as printed are relative to the image centre (384, 286).
inline const Eigen::Vector2d ball_centre_px(384, 286);

inline std::vector<CalibrationPoint> ball_27() {
  const CsvTable table("tests/golden/ball-27.csv");
  std::vector<CalibrationPoint> points(table.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_W_mm = {table.number(i, "x_mm"), table.number(i, "y_mm"), table.number(i, "z_mm")};
    points[i].u_px = ball_centre_px + Eigen::Vector2d(table.number(i, "u_from_centre_px"),
                                                      table.number(i, "v_from_centre_px"));
  }
  return points;
}

// Columns x_mm y_mm z_mm u_px v_px.
inline std::vector<CalibrationPoint> calibration_points(const std::string& file) {
  const CsvTable table(file);
  std::vector<CalibrationPoint> points(table.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_W_mm = {table.number(i, "x_mm"), table.number(i, "y_mm"), table.number(i, "z_mm")};
    points[i].u_px = {table.number(i, "u_px"), table.number(i, "v_px")};
  }
  return points;
}

}  // namespace zeropose::test
