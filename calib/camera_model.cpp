#include "calib/camera_model.h"

#include <Eigen/LU>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

struct Bent {
  Vector2d d;     // distorted normalised coordinates
  Matrix2d d_du;  // derivative by the undistorted ones
};

// (E2): rd = 2 ru / (1 + sqrt(1 - 4 K ru^2)), as a factor on the undistorted point.
std::optional<Bent> distort(const Division& lens, const Vector2d& u) {
  const double square = 1 - 4 * lens.K * u.squaredNorm();
  if (!(square > 0)) return std::nullopt;
  const double root = std::sqrt(square);
  const double factor = 2 / (1 + root);
  const double factor_by_r2 = 4 * lens.K / (root * (1 + root) * (1 + root));
  return Bent{factor * u, factor * Matrix2d::Identity() + 2 * factor_by_r2 * u * u.transpose()};
}

std::optional<Bent> distort(const BrownConrady& lens, const Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double radial_by_r2 = lens.k1 + r2 * (2 * lens.k2 + r2 * 3 * lens.k3);
  // Beyond the radius where r * radial(r) turns back the picture folds over itself: no image.
  if (!(radial + 2 * r2 * radial_by_r2 > 0)) return std::nullopt;
  Bent bent;
  bent.d = radial * u + Vector2d(2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x),
                                 lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y);
  bent.d_du = radial * Matrix2d::Identity() + 2 * radial_by_r2 * u * u.transpose();
  bent.d_du(0, 0) += 2 * lens.p1 * y + 6 * lens.p2 * x;
  bent.d_du(0, 1) += 2 * lens.p1 * x + 2 * lens.p2 * y;
  bent.d_du(1, 0) += 2 * lens.p1 * x + 2 * lens.p2 * y;
  bent.d_du(1, 1) += 6 * lens.p1 * y + 2 * lens.p2 * x;
  return bent;
}

using LensJacobian = Eigen::Matrix<double, 2, 5>;

// Derivatives of the distorted point by K or k1 k2 p1 p2 k3; u has an image.
LensJacobian by_lens(const Division& lens, const Vector2d& u) {
  const double r2 = u.squaredNorm(), root = std::sqrt(1 - 4 * lens.K * r2);
  LensJacobian J = LensJacobian::Zero();
  J.col(0) = 4 * r2 / (root * (1 + root) * (1 + root)) * u;
  return J;
}

LensJacobian by_lens(const BrownConrady&, const Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  LensJacobian J;
  J << r2 * x, r2 * r2 * x, 2 * x * y, r2 + 2 * x * x, r2 * r2 * r2 * x,  //
      r2 * y, r2 * r2 * y, r2 + 2 * y * y, 2 * x * y, r2 * r2 * r2 * y;
  return J;
}

std::optional<Vector2d> undistort(const Division& lens, const Vector2d& d) {
  const double bend = lens.K * d.squaredNorm();
  if (!(1 + bend > 0) || !(bend < 1)) return std::nullopt;
  return d / (1 + bend);
}

// Newton on distort(u) = d. The plane is searched from the distorted point itself.
std::optional<Vector2d> undistort(const BrownConrady& lens, const Vector2d& d) {
  Vector2d u = d;
  for (int step = 0; step < 30; ++step) {
    const auto bent = distort(lens, u);
    if (!bent) return std::nullopt;
    const Vector2d change = bent->d_du.inverse() * (d - bent->d);
    u += change;
    if (!u.allFinite()) return std::nullopt;
    if (change.norm() < 1e-14) return u;
  }
  const auto bent = distort(lens, u);
  if (!bent || (bent->d - d).norm() > 1e-10) return std::nullopt;
  return u;
}

}  // namespace

CalibratedCamera virtual_camera(const CalibratedCamera& camera_in_hand, const Pose& X_RH) {
  CalibratedCamera camera = camera_in_hand;
  camera.X_WC = X_RH * camera_in_hand.X_WC;
  camera.on_hand = false;
  return camera;
}

Internals internals_of(const CameraModel& camera) {
  Internals internals = Internals::Zero();
  internals.head<4>() << camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px;
  if (const auto* brown = std::get_if<BrownConrady>(&camera.distortion))
    internals.tail<5>() << brown->k1, brown->k2, brown->p1, brown->p2, brown->k3;
  else
    internals[4] = std::get<Division>(camera.distortion).K;
  return internals;
}

CameraModel with_internals(CameraModel camera, const Internals& i) {
  camera.fx_px = i[0], camera.fy_px = i[1], camera.cx_px = i[2], camera.cy_px = i[3];
  if (std::holds_alternative<BrownConrady>(camera.distortion))
    camera.distortion = BrownConrady{i[4], i[5], i[6], i[7], i[8]};
  else
    camera.distortion = Division{i[4]};
  return camera;
}

std::optional<Projection> project_with_jacobian(const CameraModel& camera, const Eigen::Vector3d& p_CQ_mm) {
  if (!p_CQ_mm.allFinite() || !(p_CQ_mm.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / p_CQ_mm.z();
  const Vector2d u = p_CQ_mm.head<2>() * inverse_z;
  const auto bent = std::visit([&u](const auto& lens) { return distort(lens, u); }, camera.distortion);
  if (!bent || !bent->d.allFinite()) return std::nullopt;
  Eigen::Matrix<double, 2, 3> du_dp;
  du_dp << inverse_z, 0, -u.x() * inverse_z, 0, inverse_z, -u.y() * inverse_z;
  const Vector2d focal(camera.fx_px, camera.fy_px);
  Projection projection;
  projection.u_px = focal.cwiseProduct(bent->d) + Vector2d(camera.cx_px, camera.cy_px);
  projection.du_dp = focal.asDiagonal() * (bent->d_du * du_dp);
  return projection;
}

std::optional<FullProjection> project_with_all_jacobians(const CameraModel& camera,
                                                         const Eigen::Vector3d& p_CQ_mm) {
  if (!p_CQ_mm.allFinite() || !(p_CQ_mm.z() > 0)) return std::nullopt;
  const double inverse_z = 1 / p_CQ_mm.z();
  const Vector2d u = p_CQ_mm.head<2>() * inverse_z;
  const auto bent = std::visit([&u](const auto& lens) { return distort(lens, u); }, camera.distortion);
  if (!bent || !bent->d.allFinite()) return std::nullopt;
  const Vector2d focal(camera.fx_px, camera.fy_px);
  FullProjection projection;
  projection.u_px = focal.cwiseProduct(bent->d) + Vector2d(camera.cx_px, camera.cy_px);
  projection.du_dp.leftCols<2>() = inverse_z * (focal.asDiagonal() * bent->d_du);
  projection.du_dp.col(2) = -(projection.du_dp.leftCols<2>() * u);
  projection.du_di.leftCols<4>() << bent->d.x(), 0, 1, 0, 0, bent->d.y(), 0, 1;
  projection.du_di.rightCols<5>() =
      focal.asDiagonal() * std::visit([&u](const auto& lens) { return by_lens(lens, u); }, camera.distortion);
  return projection;
}

std::optional<Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& p_CQ_mm) {
  const auto projection = project_with_jacobian(camera, p_CQ_mm);
  if (!projection) return std::nullopt;
  return projection->u_px;
}

std::optional<Eigen::Vector3d> ray(const CameraModel& camera, const Vector2d& u_px) {
  if (!u_px.allFinite()) return std::nullopt;
  const Vector2d d((u_px.x() - camera.cx_px) / camera.fx_px, (u_px.y() - camera.cy_px) / camera.fy_px);
  const auto u = std::visit([&d](const auto& lens) { return undistort(lens, d); }, camera.distortion);
  if (!u) return std::nullopt;
  return Eigen::Vector3d(u->x(), u->y(), 1);
}

bool in_image(const CameraModel& camera, const Vector2d& u_px) {
  return u_px.x() >= -0.5 && u_px.y() >= -0.5 && u_px.x() <= camera.width_px - 0.5 &&
         u_px.y() <= camera.height_px - 0.5;
}

}  // namespace zeropose
