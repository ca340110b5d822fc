// The robot program of the demo: car after car stops not quite where it was taught, the robot asks for its
// correction, checks it, and the truth says how good it was.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>

#include "config/cell.h"

namespace zeropose {

struct DriveOptions {
  std::optional<int> cars;                           // none: until stopped
  std::uint64_t seed = 1;                            // of the shifts
  double shift_mm = 30, turn_deg = 0.2;              // each component uniform within +- this
  double max_error_mm = 0.4, max_error_deg = 0.012;  // of each component of X_O0O, for each car
  double ready_within_s = 60;                        // from the start to the robot's first "ready"
};

// Moves the object to X_WO and returns when every camera shows it there.
using ShowObject = std::function<void(const Pose& X_WO)>;

// Drives the first robot of the cell, whose object stands at X_WO0 when the zero measurement is taken. Prints
// a line for each car and a summary. Returns the exit status: 0 when every car was corrected within the
// figures.
int drive(const Cell& cell, const Pose& X_WO0, const ShowObject& show, const DriveOptions& options,
          const std::atomic<bool>& stop);

}  // namespace zeropose
