// The robot program of a calibration (spec 40 P1 to P3): a robot shows a target to one camera, or its hand's
// camera a target, from several positions, says where its hand is, and tells a position again that was not
// taken.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "config/cell.h"
#include "sim/carried.h"
#include "sim/hand_errors.h"

namespace zeropose {

struct BallInHand {
  Eigen::Vector3d p_HT_mm = Eigen::Vector3d::Zero();  // its centre
  double radius_mm = 0, grey = 0;
};

// A ball that stands still; the hand carries the cameras.
struct BallInWorld {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0, grey = 0;
};

// The object of a job where it stands ideally; the hand carries the cameras.
struct StandingObject {
  std::string job;
};

// A board or body on the hand; without X_HB it stands still and the hand carries the camera.
struct ShownBody {
  std::filesystem::path table;     // of a body's marks; empty: a board
  std::vector<PrintedMark> marks;  // of a body not before load_marks()
  std::optional<Pose> X_HB;
  Pose X_WB = Pose::Identity();
};

// A tool's end that touches a tip which stands still; no camera looks.
struct TouchedTip {
  Eigen::Vector3d p_HT_mm = Eigen::Vector3d::Zero();  // the end
  Eigen::Vector3d p_R_mm = Eigen::Vector3d::Zero();   // the tip
  double miss_mm = 0;                                 // of each touch and axis, one sigma
};

// From the truth file of a cell.
struct SurveyDrive {
  std::string name;       // that of the camera, where it has no other
  std::string camera;     // that it is for; none: it has a name
  std::size_t robot = 0;  // of the cell
  std::variant<BallInHand, BallInWorld, ShownBody, StandingObject, TouchedTip> target;
  std::vector<Pose> places;  // X_RH of the robot's own program
  RobotErrors errors;
};

// What the robot moves; all return when every camera shows it so.
struct SurveyedCell {
  std::function<void(const Carried& target)> show;
  std::function<void(std::size_t job)> show_object;                    // where it stands ideally
  std::function<void(std::size_t robot, const Pose& X_RH)> move_hand;  // what a robot carries
};

// Goes where the daemon's survey says, inside the robot's own space only, or through its own places where
// that says nothing. Returns the exit status: 0 when every position was taken. Waits for the survey to begin.
int drive_survey(const Cell& cell, const SurveyDrive& survey, const SurveyedCell& surveyed,
                 const std::atomic<bool>& stop);

}  // namespace zeropose
