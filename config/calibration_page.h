// The page of a calibration report (spec 40): one SVG file that needs no other.
#pragma once

#include <optional>
#include <string>

#include "calib/calibration.h"

namespace zeropose {

// Borrows problem and result, whose status must be ok.
struct CalibrationReport {
  const CalibrationProblem& problem;
  const CalibrationResult& result;
  std::string name;    // of the camera, may be empty
  std::string source;  // where the points come from
  double sy_mm = 0;    // pixel pitch for the data-sheet form; 0: not known
  double frame_offset_z_mm = 0;
  std::optional<CalibratedCamera> active;  // the calibration in use, to compare with
  int further_unknowns = 0;                // see judge()
  std::string pose = "X_WC";               // what the camera's pose is: X_RC without a world, X_HC on a hand
};

// Parameters with sigmas, data-sheet form, verdict, deviations as quiver plot, histogram and list, coverage
// of image and depth, steps, warnings, rejected points, difference to the active calibration. A4 wide; the
// list of points makes it longer.
std::string calibration_page(const CalibrationReport& report);

}  // namespace zeropose
