// Points of steepest slope in a window. Internal to the room.
#pragma once

#include <vector>

#include "measure/contour_fit.h"

namespace zeropose {

// Column and row in the window, to a tenth of a pixel where the noise allows; slope in grey levels per px
// with its direction from dark to bright as a unit vector.
struct SlopePoint {
  float x, y, slope, nx, ny;
};

// Slopes below least_slope, or like those of the noise, are left out.
std::vector<SlopePoint> find_edge_points(const GreyWindow& window, double least_slope);

}  // namespace zeropose
