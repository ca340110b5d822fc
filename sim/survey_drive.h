// The robot program of a ball grid (spec 40 P2): a robot carries a ball to 3 x 3 x 3 positions before one
// camera, says where its hand is, and tells a position again that was not taken. Where the daemon's survey
// has targets of its own it goes to those, inside its own space only.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "config/cell.h"
#include "sim/hand_errors.h"
#include "sim/scene.h"

namespace zeropose {

// From the truth file of a cell. The ball's centre is fixed in the hand, whose first position is X_RH_first;
// the others follow along the axes of the robot's base or of the hand.
struct SurveyDrive {
  std::string camera;     // that the grid is for
  std::size_t robot = 0;  // of the cell
  Eigen::Vector3d p_HT_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0, grey = 0;
  Pose X_RH_first = Pose::Identity();
  Eigen::Vector3d step_mm = Eigen::Vector3d::Zero();
  bool along_hand = false;
  RobotErrors errors;
};

// Goes where the daemon's survey says, or through its own grid where that says nothing. Returns the exit
// status: 0 when every position was taken. Waits for the survey to begin.
int drive_survey(const Cell& cell, const SurveyDrive& survey,
                 const std::function<void(const CarriedBall&)>& show, const std::atomic<bool>& stop);

}  // namespace zeropose
