// The exact picture of a flat disc on a flat surface: lens model, perspective, blur and pixel area.
#pragma once

#include <vector>

#include "calib/camera_model.h"
#include "sim/painter.h"

namespace zeropose {

struct FlatDisc {
  Pose X_CM = Pose::Identity();  // M: origin in the disc's centre, z normal to its plane
  double radius_mm = 0;
  double grey = 0;          // where the illumination is 1
  double surface_grey = 0;  // of the plane round it
};

// Overwrites the pixels the disc's edge can reach. Every sample (a sixteenth of a pixel) goes through ray()
// to the disc's plane and gets the share of its square that lies inside the outline, seen as straight there,
// so that the edge is not quantised. Then come the Gaussian blur and the pixel's box at the sample
// resolution. The centre of gravity of the disc's darkness is that of its projected outline within 1e-4 px.
void render_disc(const CameraModel& camera, const FlatDisc& disc, const Illumination& light,
                 double blur_sigma_px, std::vector<float>& picture);

}  // namespace zeropose
