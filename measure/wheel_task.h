// What a job measures that looks at a wheel instead of at marks (spec 70, wheel-alignment).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "measure/line_array.h"

namespace zeropose {

// What is known of the tyre before it is measured.
struct ExpectedTyre {
  double min_radius_mm = 0, max_radius_mm = 0;         // the side wall, 0 < min < max
  double unevenness_mm = 0.15, out_of_round_mm = 0.3;  // see WheelPlaneProblem
  std::optional<double> profile_radius_mm{};           // take the profile next to this radius, as at zero
};

// One of the three stereo sensors, with its cameras of the cell: left and right as seen from behind the
// sensor with the wheel's rim below.
struct WheelEyes {
  std::string name;
  double angle_rad = 0;  // of its middle radial line, about z of the wheel from x to y
  std::size_t left = 0, right = 0;
};

struct WheelTask {
  std::vector<WheelEyes> sensors;  // three
  LineLayout layout;
  LightLineSearch search;
  ExpectedTyre tyre;
  double max_sigma_rad = 0.001;  // of camber and of toe
};

}  // namespace zeropose
