// What the daemon saw of a cell's reference points, for recalibrate.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/cell.h"
#include "measure/recalibration.h"

namespace zeropose::cli {

// The camera's reference points that `file`, an answer of `zeropose measure --json`, has before and after;
// those that were not found now are left out, and with `suited_only` those that the method cannot use. Throws
// std::invalid_argument where the file is another, has no points of this camera, was made before a zero
// measurement, or where the method needs coordinates that the cell file does not have.
std::vector<RecalibrationPoint> measured_references(const Cell& cell, RecalibrationMethod method,
                                                    bool suited_only, const std::string& camera,
                                                    const std::filesystem::path& file);

}  // namespace zeropose::cli
