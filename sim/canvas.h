// The picture of one camera while it is made. Grey levels are those where the illumination is 1.
#pragma once

#include <algorithm>
#include <vector>

#include "sim/coverage.h"
#include "sim/painter.h"

namespace zeropose {

class Canvas {
 public:
  // Keeps the rays. All of one grey.
  Canvas(const PixelRays& rays, double blur_sigma_px, double grey);

  const CameraModel& camera() const { return rays_.camera(); }
  const PixelRays& rays() const { return rays_; }
  Canvas like(double grey) const { return {rays_, blur_sigma_px_, grey}; }  // another one of the same camera
  void clear(double grey) { std::ranges::fill(picture_, static_cast<float>(grey)); }
  // What was made elsewhere: as many grey levels, row by row, blurred already.
  void show(std::vector<float> picture) { picture_ = std::move(picture); }

  // Things of a frame F that need not be exact.
  void paint(const Sheet& sheet, const Pose& X_CF);
  // What lies inside the outline, exact to 1e-4 px: of one grey, or as another canvas shows it.
  void fill(const FlatOutline& outline, const Pose& X_CM, double grey);
  void fill(const FlatOutline& outline, const Pose& X_CM, const Canvas& surface);

  void illuminate(const Illumination& light);
  std::vector<float> picture() && { return std::move(picture_); }  // grey levels row by row

 private:
  const PixelRays& rays_;
  double blur_sigma_px_;
  std::vector<float> picture_;
};

}  // namespace zeropose
