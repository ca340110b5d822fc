// The robot program of a cell that evens gaps: car after car stops not quite where it was taught, the robot
// asks, moves the pane as it is told, and asks again until the gaps are even; the truth says whether they
// are.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "config/cell.h"
#include "sim/gap_object.h"
#include "sim/hand_errors.h"

namespace zeropose {

// How cars come and how well the robot moves; the truth file of a cell says it. Six numbers are x y z in mm,
// rx ry rz in degrees.
struct GapDriveOptions {
  std::optional<int> parts;         // none: until stopped
  std::uint64_t seed = 1;           // of everything that is drawn
  Vector6 shift = Vector6::Zero();  // each component of X_O0O of a car uniform within +- this
  double gain_error = 0;            // the robot does each component of a motion by up to this share too much
                                    // or too little, drawn for every car
  RobotErrors robot;                // what it does not repeat: drawn anew wherever it stands
  double even_within_mm = 0.1;      // by the truth: half of the difference between widest and narrowest
  int most_motions = 10;            // then it gives up
  int spoilt_every = 0;             // every so many cars has something over an edge; 0: none
  double robot_max_mm = 20, robot_max_deg = 5;  // the robot's own limits of a motion
  double ready_within_s = 60;                   // from the start to the robot's first "ready"
};

// What the drive moves; both return when every camera shows it so.
struct GapDriven {
  std::function<void(const Pose& X_WO, const std::set<std::string>& covered)> show;  // a car
  std::function<void(std::size_t robot, const Pose& X_RH)> move_hand;                // cameras and pane
};

// Drives the robot that carries the pane. Prints a line for each car and a summary. Returns the exit status:
// 0 when the gaps of every car were even by the truth once the daemon said so, but for cars with something
// over an edge, which may be refused as well, with a code that says so.
int drive_gaps(const Cell& cell, const GapsObject& object, const GapDriven& driven,
               const GapDriveOptions& options, const std::atomic<bool>& stop);

}  // namespace zeropose
