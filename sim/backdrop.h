// What stands and hangs around the marks in one camera's picture: plates, panels, beams, clutter.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/mark_plates.h"
#include "sim/painter.h"
#include "sim/scene.h"

namespace zeropose {

struct Backdrop {
  double hall_grey = 0;
  Illumination light;
  std::vector<Sheet> behind;     // standing, in the camera's frame
  std::vector<Sheet> on_object;  // in O
  std::vector<MarkPlate> plates;
  std::vector<Sheet> in_front;  // standing, in the camera's frame
};

// Of a car body with plates. Follows from the scene's seed and the camera's index alone. Clutter never is a
// round disc of a mark's size. No clutter comes nearer than 12 px to the outline of a mark while the object
// is within +-30 mm and +-0.2 deg (per component, at O's origin) of the nominal pose.
Backdrop make_backdrop(const Scene& scene, std::size_t camera);

}  // namespace zeropose
