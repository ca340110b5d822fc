// The tables that a moved camera is found again from (spec 92, recalibrate).
#pragma once

#include <filesystem>
#include <vector>

#include "measure/recalibration.h"

namespace zeropose {

struct RecalibrationFiles {
  std::filesystem::path before, after;
  std::filesystem::path points;  // empty for arbitrary points
};

// before, after: columns point u_px v_px [group suu svv suv], the same points in both; group is required for
// groups. points: point x_mm y_mm z_mm [group]; without the column group a point is found by its name alone.
// Points in the order of `before`. Throws ConfigError with every mistake: points without a partner, twice, or
// unknown.
std::vector<RecalibrationPoint> load_recalibration_points(RecalibrationMethod method,
                                                          const RecalibrationFiles& files);

}  // namespace zeropose
