// One lens model in the place of the other, for exchange with systems that know only one (spec 20).
#pragma once

#include <optional>

#include "calib/camera_model.h"

namespace zeropose {

struct LensConversion {
  std::optional<CameraModel> model;  // nullopt: the model has no image in some part of the chip
  double worst_px = 0;               // largest distance over the image between the two models
  Eigen::Vector2d worst_at_px = Eigen::Vector2d::Zero();
  double rms_px = 0;  // over the image
};

// Focal lengths and origin stay; k1 k2 k3 are fitted to the division model by least squares over the image,
// p1 = p2 = 0. A Brown-Conrady model comes back as it is.
LensConversion to_brown(const CameraModel& camera);

// K is fitted likewise. p1 and p2 cannot be expressed and remain as residuals.
LensConversion to_division(const CameraModel& camera);

}  // namespace zeropose
