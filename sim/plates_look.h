// A car body with round marks on plates.
#pragma once

#include "sim/backdrop.h"
#include "sim/look.h"

namespace zeropose {

class PlatesLook final : public Look {
 public:
  PlatesLook(const Scene& scene, std::size_t camera);
  void paint(Canvas& canvas, const Moment& moment) const override;
  Illumination light() const override { return backdrop_.light; }

 private:
  Backdrop backdrop_;
};

}  // namespace zeropose
