// What stands and hangs around the marks in one camera's picture: plates, panels, beams, clutter.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sim/painter.h"
#include "sim/scene.h"

namespace zeropose {

// A mark on the object (a reference point: in the world), on its plate. The plate is flat, of one grey and
// free of everything for at least 16 mm round the mark.
struct MarkPlate {
  std::string name;
  Pose X_OM = Pose::Identity();  // M: origin in the mark's centre, z its normal
  double radius_mm = 0;
  double mark_grey = 0, surface_grey = 0;
  std::vector<Thing> things;  // the plate and what is fixed to it, in M
  std::vector<Thing> cover;   // what hides the mark, in M
};

struct Backdrop {
  double hall_grey = 0;
  Illumination light;
  std::vector<Sheet> behind;     // standing, in the camera's frame
  std::vector<Sheet> on_object;  // in O
  std::vector<MarkPlate> plates;
  std::vector<MarkPlate> fixed_plates;  // of the reference points, in W instead of O; nearer than the object
  std::vector<Sheet> in_front;          // standing, in the camera's frame
};

// Follows from the scene's seed and the camera's index alone. Clutter never is a round disc of a mark's size.
// No clutter comes nearer than 12 px to the outline of a mark while the object is within +-30 mm and +-0.2
// deg (per component, at O's origin) of the nominal pose.
Backdrop make_backdrop(const Scene& scene, std::size_t camera);

}  // namespace zeropose
