// Where the end of a robot's tool is: from touches of one fixed point in several orientations (spec 40 P2).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/robot_poses.h"

namespace zeropose {

struct ToolProblem {
  std::span<const Pose> X_RH;  // one per touch
  double sigma_mm = 0;         // of one coordinate of a touch, scales the covariance; 0: from the residuals
  bool reject_wrong_touches = true;
};

enum class ToolStatus {
  failed = 0,
  ok,
  wrong_problem,     // a sigma or a number that is none
  too_few_touches,   // fewer than 3
  rotation_missing,  // the touches leave the tool's end open along a direction
  contradiction      // the touches contradict each other and it is open which one is wrong
};
std::string_view name_of(ToolStatus status);

struct ToolResult {
  ToolStatus status = ToolStatus::failed;
  std::string reason;  // one sentence with the numbers, empty when ok
  Eigen::Vector3d p_HT_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_RT_mm = Eigen::Vector3d::Zero();  // the fixed point
  // mm^2, along the axes of H and of R. Where sigma is from few residuals the covariances are enlarged so
  // that their 95 % ellipsoids hold (few_data_factor()).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero(), covariance_RT = Eigen::Matrix3d::Zero();
  double sigma_mm = 0;  // of one coordinate of a touch: as given, or from the residuals
  double rms_mm = 0;    // root of the mean squared distance, over the touches used
  int redundancy = 0;
  HandTurns turns;
  std::vector<Eigen::Vector3d>
      residuals_mm;                   // R_RH p_HT + t_RH - p_RT, one per touch where there is an estimate
  std::vector<std::size_t> removed;   // touches that contradict the others, worst first
  std::vector<std::size_t> suspects;  // contradiction: one of these
  std::vector<std::string> warnings;
};

// R_RHi p_HT + t_RHi = p_RT for all touches, by least squares. A wrong touch is taken out only if no other
// one explains the contradiction, as in remove_wrong_points(), and if the others still determine the tool.
ToolResult calibrate_tool(const ToolProblem& problem);

}  // namespace zeropose
