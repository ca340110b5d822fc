// The robot program of the demo: part after part stops not quite where it was taught, the robot asks for its
// correction, checks it, and the truth says how good it was.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "config/cell.h"
#include "sim/hand_errors.h"
#include "sim/robot.h"

namespace zeropose {

// How parts come and how wrong their corrections may be; the truth file of a cell says it. Six numbers are
// x y z in mm, rx ry rz in degrees.
struct DriveOptions {
  std::optional<int> parts;         // none: until stopped
  std::uint64_t seed = 1;           // of the shifts
  Vector6 shift = Vector6::Zero();  // each component of X_O0O uniform within +- this ...
  std::vector<Pose> poses;          // ... or these X_O0O, one after the other, again and again
  int beyond_every = 0;             // every so many parts stands beyond one of the job's limits; 0: none does
  Vector6 max_error = Vector6::Zero();            // of each component of X_O0O, for each part
  double max_error_at_points_mm = 0;              // at every application point; 0: any
  double max_mounted_mm = 0;                      // of two jobs' objects, once one is mounted in the other
  double robot_max_mm = 100, robot_max_deg = 10;  // the robot's own limits of a correction
  RobotErrors robot;                              // of the hand that carries a camera
  double ready_within_s = 60;                     // from the start to the robot's first "ready"
};

// The robot program's side of a robot's link, which must be a Modbus TCP server.
SimulatedRobotOptions robot_options(const Cell& cell, std::size_t robot);

// Tries until it is done (true), the time is up, or it shall stop.
bool done_within(double seconds, const std::atomic<bool>& stop, const std::function<bool()>& done);

// What the drive moves; both return when every camera shows it so.
struct DrivenCell {
  std::function<void(std::size_t job, const Pose& X_WO)> show;         // the job's object
  std::function<void(std::size_t robot, const Pose& X_RH)> move_hand;  // what a robot carries
};

// Drives the first robot of the cell, and after it those on CAN whose bus there is on this machine; the
// objects stand at X_WO0 (one per job) when the zero measurement is taken. Prints a line for each part and a
// summary. Where a job has positions for cameras on the robot's hand, the robot goes through them for every
// part, and takes the zero measurements itself before the first. It goes through the cell's jobs one after
// the other; of two it takes the second one's object and mounts it into the first one's so that their frames
// coincide, and what is left is told at the application points. Returns the exit status: 0 when every robot
// got its corrections within the figures, and those beyond a limit the code of that limit instead.
int drive(const Cell& cell, const std::vector<Pose>& X_WO0, const DrivenCell& driven,
          const DriveOptions& options, const std::atomic<bool>& stop);

}  // namespace zeropose
