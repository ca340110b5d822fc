// The report pages of zeropose calibrate views.
#pragma once

#include <string>

#include "calib/views.h"
#include "config/calibration_tables.h"

namespace zeropose {

// How the stage's axes lie against the board's and what the answer made of it.
std::string stage_text(const StageEstimate& stage);

// The page of one camera (config/calibration_page.h) from a result that is ok: its points in all views.
std::string page_of_camera(const CalibrationViews& input, const ViewsProblem& problem,
                           const ViewsResult& result, std::size_t camera, const std::string& source);

}  // namespace zeropose
