// What reports show of points in an image: their plots, and their list.
#pragma once

#include <span>
#include <string>

#include "calib/calibration.h"
#include "config/report_sheet.h"

namespace zeropose {

// Quiver over the image, histogram, depths.
void draw_point_plots(ReportSheet& sheet, const CalibrationProblem& problem, const CalibrationResult& result);

// Every point in two columns, rejected ones in red; of very many the worst. Without names they are numbered.
ReportList list_of_points(const CalibrationProblem& problem, const CalibrationResult& result,
                          std::span<const std::string> names = {});

}  // namespace zeropose
