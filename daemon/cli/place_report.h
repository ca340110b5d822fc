// The report pages of zeropose calibrate pose and sensor, of results that are ok.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "calib/pose_only.h"
#include "config/fit_page.h"
#include "measure/sensor.h"

namespace zeropose::cli {

// active: X_WC in use.
FitReport pose_report(const PoseOnlyProblem& problem, const PoseOnlyResult& result,
                      const std::optional<Pose>& active, const std::string& source);

// pose: X_WS or X_HS; active: the one in use.
FitReport sensor_report(const SensorProblem& problem, const SensorResult& result, const std::string& pose,
                        const std::optional<Pose>& active, const std::string& source);

}  // namespace zeropose::cli
