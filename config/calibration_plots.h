// The plots of a calibration report.
#pragma once

#include "calib/calibration.h"
#include "calib/verdict.h"
#include "config/plot_parts.h"
#include "config/svg.h"

namespace zeropose {

// The frame of the image's shape inside the given one.
PlotFrame image_frame(const PlotFrame& frame, const CalibrationProblem& problem);

// Deviations over the image, found minus projected, enlarged; rejected points in red.
void draw_quiver(Svg& svg, const PlotFrame& frame, const CalibrationProblem& problem,
                 const CalibrationResult& result);
// Both components of the used points' deviations with the normal curve of the same RMS.
void draw_histogram(Svg& svg, const PlotFrame& frame, const CalibrationResult& result);
// Distances of the used points from the camera.
void draw_depths(Svg& svg, const PlotFrame& frame, const CalibrationResult& result);
// Used points per cell of the image, and their hull.
void draw_coverage(Svg& svg, const PlotFrame& frame, const CalibrationProblem& problem,
                   const Coverage& coverage);

}  // namespace zeropose
