#include "calib/eccentricity.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// An ellipse in the plane of normalised coordinates: centre + d1 cos + d2 sin.
struct Outline {
  Vector2d centre;
  Vector2d d1, d2;  // conjugate half diameters
};

// From the dual conic r^2 (I - n n^T) - p p^T, scaled to -p_z^2 + ... = -1 in its last element; n zero: a
// ball.
bool outline_of(const Vector3d& p, const Vector3d& n, double radius, Outline& outline) {
  const double r2 = radius * radius;
  const double depth2 = p.z() * p.z() - r2 * (1 - n.z() * n.z());
  if (!(depth2 > 0)) return false;
  const Vector2d q = (p.z() * p.head<2>() + r2 * n.z() * n.head<2>()) / depth2;
  const Matrix2d shape = (r2 * (Matrix2d::Identity() - n.head<2>() * n.head<2>().transpose()) -
                          p.head<2>() * p.head<2>().transpose()) /
                             depth2 +
                         q * q.transpose();
  const double a = std::sqrt(shape(0, 0));
  const double rest = shape(1, 1) - shape(0, 1) * shape(0, 1) / shape(0, 0);
  if (!(a > 0) || !(rest >= 0)) return false;
  outline.centre = q;
  outline.d1 = Vector2d(a, shape(0, 1) / a);
  outline.d2 = Vector2d(0, std::sqrt(rest));
  return true;
}

// Second derivative of the projection at an outline's centre, along its half diameters, px.
struct Bend {
  Vector2d b11, b12, b22;
};

bool bend_of_lens(const CameraModel& camera, const Outline& outline, Bend& bend) {
  std::array<Eigen::Matrix2d, 4> slopes;
  const std::array<Vector2d, 4> steps{outline.d1, -outline.d1, outline.d2, -outline.d2};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const Vector2d at = outline.centre + steps[k];
    const auto projection = project_with_jacobian(camera, Vector3d(at.x(), at.y(), 1));
    if (!projection) return false;
    slopes[k] = projection->du_dp.leftCols<2>();
  }
  bend.b11 = 0.5 * (slopes[0] - slopes[1]) * outline.d1;
  bend.b12 = 0.5 * (slopes[0] - slopes[1]) * outline.d2;
  bend.b22 = 0.5 * (slopes[2] - slopes[3]) * outline.d2;
  return true;
}

// The bent outline is u(t) = c + e(t) + s(t), e odd and s even under half a turn. The centre of the best
// fitting ellipse moves by the least-squares solution of n . shift = n . s over the arc; the shape, even,
// drops out.
Vector2d shift_by_bend(const Vector2d& e1, const Vector2d& e2, const Bend& bend) {
  constexpr int points = 6;  // over half a turn; the integrand is smooth and periodic
  static const auto circle = [] {
    std::array<Vector2d, points> table;
    for (int k = 0; k < points; ++k) {
      const double angle = 3.14159265358979323846 * k / points;
      table[static_cast<std::size_t>(k)] = Vector2d(std::cos(angle), std::sin(angle));
    }
    return table;
  }();
  double nxx = 0, nxy = 0, nyy = 0, rx = 0, ry = 0;
  for (const Vector2d& cs : circle) {
    const double c = cs.x(), s = cs.y();
    const double tx = c * e2.x() - s * e1.x(), ty = c * e2.y() - s * e1.y();
    const double weight = 1 / std::sqrt(tx * tx + ty * ty + 1e-30);  // dl n n^T = (ty, -tx)(..)^T / |t|
    const double sx = 0.5 * (c * c * bend.b11.x() + 2 * c * s * bend.b12.x() + s * s * bend.b22.x());
    const double sy = 0.5 * (c * c * bend.b11.y() + 2 * c * s * bend.b12.y() + s * s * bend.b22.y());
    const double along = weight * (ty * sx - tx * sy);
    nxx += weight * ty * ty;
    nxy -= weight * ty * tx;
    nyy += weight * tx * tx;
    rx += along * ty;
    ry -= along * tx;
  }
  const double det = nxx * nyy - nxy * nxy;
  if (!(det > 1e-12 * nxx * nyy)) return Vector2d::Zero();  // seen edge-on
  return Vector2d(nyy * rx - nxy * ry, nxx * ry - nxy * rx) / det;
}

Vector2d offset_of(const CameraModel& camera, const Vector3d& p_CM_mm, const Vector3d& n, double radius_mm) {
  const auto mark = project(camera, p_CM_mm);
  Outline outline;
  if (!mark || !outline_of(p_CM_mm, n, radius_mm, outline)) return Vector2d::Zero();
  const auto centre = project_with_jacobian(camera, Vector3d(outline.centre.x(), outline.centre.y(), 1));
  Bend bend;
  if (!centre || !bend_of_lens(camera, outline, bend)) return Vector2d::Zero();
  const Matrix2d slope = centre->du_dp.leftCols<2>();
  return centre->u_px + shift_by_bend(slope * outline.d1, slope * outline.d2, bend) - *mark;
}

}  // namespace

Vector2d ellipse_centre_offset(const CameraModel& camera, const Vector3d& p_CM_mm, const Vector3d& normal_C,
                               double radius_mm) {
  const double length = normal_C.norm();
  if (!(length > 0) || !(radius_mm > 0)) return Vector2d::Zero();
  return offset_of(camera, p_CM_mm, normal_C / length, radius_mm);
}

Vector2d ball_centre_offset(const CameraModel& camera, const Vector3d& p_CM_mm, double radius_mm) {
  return radius_mm > 0 ? offset_of(camera, p_CM_mm, Vector3d::Zero(), radius_mm) : Vector2d::Zero();
}

}  // namespace zeropose
