// The report pages of zeropose recalibrate and calibrate vanishing, of results that are ok.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/vanishing.h"
#include "config/fit_page.h"
#include "measure/recalibration.h"

namespace zeropose::cli {

FitReport recalibration_report(const RecalibrationProblem& problem, const RecalibrationResult& result,
                               const std::string& camera, const std::string& source);

// A rectangle's image by its name, and where the result puts it; skipped ones have a reason.
struct RectangleLine {
  std::string name, skipped;
  double ratio_seen = 0, rms_px = 0;  // 0: no pose was asked for
};

FitReport vanishing_report(const VanishingResult& result, std::span<const RectangleLine> images,
                           const std::string& source);

}  // namespace zeropose::cli
