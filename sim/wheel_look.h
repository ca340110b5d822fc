// A wheel with the lines of the projector before a camera.
#pragma once

#include "sim/look.h"
#include "sim/wheel_object.h"

namespace zeropose {

class WheelLook final : public Look {
 public:
  WheelLook(const WheelObject& object, const Scene& scene, std::size_t camera);
  void paint(Canvas& canvas, const Moment& moment) const override;
  Illumination light() const override { return light_; }

 private:
  WheelObject object_;
  std::size_t camera_;
  double blur_sigma_px_;
  Illumination light_;
};

}  // namespace zeropose
