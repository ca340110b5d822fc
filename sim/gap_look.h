// A car's window opening, and the pane before it with what lies on the edges.
#pragma once

#include "sim/gap_object.h"
#include "sim/look.h"

namespace zeropose {

class GapLook final : public Look {
 public:
  GapLook(const GapsObject& object, const Scene& scene, std::size_t camera);
  void paint(Canvas& canvas, const Moment& moment) const override;
  Illumination light() const override { return light_; }

 private:
  void paint_spot(Canvas& canvas, const GapSpot& spot, const Moment& moment) const;

  GapsObject object_;
  std::size_t camera_;
  double body_grey_, gap_grey_;
  Illumination light_;
  Sheet body_, flange_;  // in O: the surface, reaching over the opening, and what is seen through the gap
  Sheet glass_;          // in T, reaching beyond the pane
};

}  // namespace zeropose
