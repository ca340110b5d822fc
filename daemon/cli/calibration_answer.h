// What the calibrations answer: for programs and for people.
#pragma once

#include <string>

#include "calib/uncertainty.h"
#include "config/calibration_page.h"
#include "daemon/cli/answer.h"

namespace zeropose::cli {

// By the parameters' names.
Json sigma_json(const ReportedUncertainty& uncertainty);
Json correlation_json(const ReportedUncertainty& uncertainty);

// The keys of spec 92 and more: X_CW, verdict, coverage, comparison. The result's status must be ok.
Json calibration_json(const CalibrationReport& report);
// CalibrationVerdict, warnings, parameters with sigmas, steps and the worst points. rad: angles in rad
// instead of degrees.
std::string calibration_text(const CalibrationReport& report, bool rad);
// Where there is no result.
Answer calibration_failure(const CalibrationResult& result);

}  // namespace zeropose::cli
