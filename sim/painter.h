// Painting flat things in space into the picture of one camera, one sample per pixel, edges as soft as the
// blur makes them. Good for everything that need not be exact; marks are rendered by coverage.h.
#pragma once

#include <cstddef>
#include <vector>

#include "calib/camera_model.h"
#include "sim/shapes.h"

namespace zeropose {

class Random;

// How a thing looks. Grey levels where the illumination is 1.
struct Paint {
  double grey = 0;
  double opacity = 1;
  double softness_mm = 0;   // one sigma of a blurred outline: shadows, stains, glints
  double bevel_mm = 0;      // width of a rounded rim ...
  double bevel_grey = 0;    // ... that is lighter towards the light and darker away from it by up to this
  double texture_grey = 0;  // amplitude of a fine irregular texture ...
  double texture_mm = 0;    // ... and its grain
  double shading_grey = 0;  // amplitude of a large smooth shading
};

struct Thing {
  Shape shape;
  Paint paint;
};

// Things in one plane: z = 0 of the frame S, painted in this order.
struct Sheet {
  Pose X_FS = Pose::Identity();  // in the frame F that it is fixed to
  std::vector<Thing> things;
};

// Light that changes linearly over the picture: 1 in its middle.
struct Illumination {
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d slope_per_px = Eigen::Vector2d::Zero();

  double at(double u, double v) const {
    return 1 + slope_per_px.x() * (u - middle_px.x()) + slope_per_px.y() * (v - middle_px.y());
  }
};

// Of a camera, changing by `gradient` over the picture's diagonal, in a direction that is drawn.
Illumination drawn_light(const CameraModel& camera, double gradient, Random& random);

// The direction vectors of all pixels of a camera, row by row; NaN where the model has none.
class PixelRays {
 public:
  explicit PixelRays(const CameraModel& camera);

  const CameraModel& camera() const { return camera_; }
  const Eigen::Vector2f& at(int u, int v) const {
    return xy_[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width_px) +
               static_cast<std::size_t>(u)];
  }

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector2f> xy_;
};

// Grey levels row by row, size as the rays' camera.
class Painter {
 public:
  Painter(const PixelRays& rays, double blur_sigma_px, std::vector<float>& picture);

  void paint(const Sheet& sheet, const Pose& X_CF);

  // Multiplies all that was painted by the light.
  void illuminate(const Illumination& light);

 private:
  void paint(const Thing& thing, const Pose& X_CS);

  const PixelRays& rays_;
  double edge_sigma_px_;
  std::vector<float>& picture_;
};

}  // namespace zeropose
