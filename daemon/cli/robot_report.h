// The report pages of zeropose calibrate tool and hand-eye, of results that are ok.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/hand_eye.h"
#include "calib/tool.h"
#include "config/fit_page.h"
#include "config/robot_tables.h"

namespace zeropose::cli {

// active_mm: the end that the robot uses now.
FitReport tool_report(std::span<const HandPose> touches, const ToolResult& result,
                      const std::optional<Eigen::Vector3d>& active_mm, const std::string& source);

// active: X_HC or X_RC in use.
FitReport hand_eye_report(const HandEyeProblem& problem, const HandEyeResult& result,
                          const std::optional<Pose>& active, const std::string& source);

}  // namespace zeropose::cli
