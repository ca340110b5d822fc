#include "sim/plane_view.h"

namespace zeropose {

using Eigen::Vector2d;
using Eigen::Vector3d;

PlaneView::PlaneView(const CameraModel& camera, const Pose& X_CM)
    : camera_(camera),
      X_CM_(X_CM),
      R_MC_(X_CM.linear().transpose()),
      p_MC_mm_(-(R_MC_ * X_CM.translation())) {}

std::optional<Vector2d> PlaneView::meet(const Vector2d& u_px) const {
  const auto d_C = ray(camera_, u_px);
  if (!d_C) return std::nullopt;
  const Vector3d d_M = R_MC_ * *d_C;
  const double depth = -p_MC_mm_.z() / d_M.z();
  if (!(depth > 0) || !std::isfinite(depth)) return std::nullopt;
  return p_MC_mm_.head<2>() + depth * d_M.head<2>();
}

std::optional<Eigen::Matrix2d> PlaneView::px_per_mm(const Vector2d& q_mm) const {
  const auto projection = project_with_jacobian(camera_, X_CM_ * Vector3d(q_mm.x(), q_mm.y(), 0));
  if (!projection) return std::nullopt;
  return projection->du_dp * X_CM_.linear().leftCols<2>();
}

}  // namespace zeropose
