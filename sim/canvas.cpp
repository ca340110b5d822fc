#include "sim/canvas.h"

namespace zeropose {

Canvas::Canvas(const PixelRays& rays, double blur_sigma_px, double grey)
    : rays_(rays),
      blur_sigma_px_(blur_sigma_px),
      picture_(static_cast<std::size_t>(rays.camera().width_px) *
                   static_cast<std::size_t>(rays.camera().height_px),
               static_cast<float>(grey)) {}

void Canvas::paint(const Sheet& sheet, const Pose& X_CF) {
  Painter(rays_, blur_sigma_px_, picture_).paint(sheet, X_CF);
}

void Canvas::fill(const FlatOutline& outline, const Pose& X_CM, double grey) {
  cover(camera(), X_CM, outline, blur_sigma_px_, [&](std::size_t pixel, double share) {
    picture_[pixel] += static_cast<float>(share * (grey - picture_[pixel]));
  });
}

void Canvas::fill(const FlatOutline& outline, const Pose& X_CM, const Canvas& surface) {
  cover(camera(), X_CM, outline, blur_sigma_px_, [&](std::size_t pixel, double share) {
    picture_[pixel] += static_cast<float>(share) * (surface.picture_[pixel] - picture_[pixel]);
  });
}

void Canvas::illuminate(const Illumination& light) {
  Painter(rays_, blur_sigma_px_, picture_).illuminate(light);
}

}  // namespace zeropose
