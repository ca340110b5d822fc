// What a new calibration changes against the active one, in px where it matters.
#pragma once

#include <array>
#include <optional>

#include "calib/camera_model.h"

namespace zeropose {

struct PixelShift {
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();  // in the active camera
  // Where the new internals see the same direction, minus at_px; nullopt: one of them has no image there.
  std::optional<Eigen::Vector2d> internals_px;
  // Where the new camera with its pose sees the same point at the depth, minus at_px.
  std::optional<Eigen::Vector2d> camera_px;
};

struct CameraComparison {
  std::array<PixelShift, 5> shifts;  // corners: top left, top right, bottom right, bottom left; centre
  double worst_internals_px = 0, worst_camera_px = 0;
  double moved_mm = 0, turned_deg = 0;  // the camera itself
};

// depth_mm: distance of the points along the active camera's z axis, > 0.
CameraComparison compare(const CalibratedCamera& active, const CalibratedCamera& fresh, double depth_mm);

}  // namespace zeropose
