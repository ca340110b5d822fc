// What the pictures of each camera say about lens and light, from measurement to measurement.
#pragma once

#include <span>
#include <vector>

#include "config/cell.h"
#include "measure/measurement.h"

namespace zeropose {

// Of a camera's last picture, and how it has changed since the first five measurements after the zero
// measurement, the selection of the job or the start.
struct CameraHealth {
  PictureHealth picture;
  bool seen = false;         // a picture was measured
  HealthTrend focus, noise;  // focus: the blur of the found marks, sigma in px; noise: grey levels
};

// Takes a measurement over, and logs once where a figure of a camera changes. `images` are those that were
// measured, `job` is theirs, `health` is by camera of the cell.
void follow_health(std::vector<CameraHealth>& health, std::span<const CameraImage> images,
                   const Measurement& measurement, const Job& job, const Cell& cell);

}  // namespace zeropose
