#include "calib/comparison.h"

#include <algorithm>

namespace zeropose {

CameraComparison compare(const CalibratedCamera& active, const CalibratedCamera& fresh, double depth_mm) {
  CameraComparison comparison;
  const double left = -0.5, top = -0.5, right = active.model.width_px - 0.5,
               bottom = active.model.height_px - 0.5;
  const std::array<Eigen::Vector2d, 5> places{
      {{left, top}, {right, top}, {right, bottom}, {left, bottom}, {(left + right) / 2, (top + bottom) / 2}}};
  const Pose X_CfreshCactive = fresh.X_WC.inverse() * active.X_WC;
  for (std::size_t i = 0; i < places.size(); ++i) {
    PixelShift& shift = comparison.shifts[i];
    shift.at_px = places[i];
    const auto direction = ray(active.model, places[i]);
    if (!direction) continue;
    if (const auto u_px = project(fresh.model, *direction)) {
      shift.internals_px = *u_px - places[i];
      comparison.worst_internals_px = std::max(comparison.worst_internals_px, shift.internals_px->norm());
    }
    if (const auto u_px = project(fresh.model, X_CfreshCactive * (*direction * depth_mm))) {
      shift.camera_px = *u_px - places[i];
      comparison.worst_camera_px = std::max(comparison.worst_camera_px, shift.camera_px->norm());
    }
  }
  const Vector6 change = difference(active.X_WC, fresh.X_WC);
  comparison.moved_mm = change.head<3>().norm();
  comparison.turned_deg = change.tail<3>().norm() * degrees_per_radian;
  return comparison;
}

}  // namespace zeropose
