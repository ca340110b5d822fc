#include "calib/rigid.h"

#include <Eigen/SVD>
#include <cassert>
#include <cmath>

namespace zeropose {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Pose from_six_numbers(const SixNumbers& six) {
  const Vector3d angles_rad = Vector3d(six.rx_deg, six.ry_deg, six.rz_deg) / degrees_per_radian;
  Pose X_AB = Pose::Identity();
  X_AB.linear() = (Eigen::AngleAxisd(angles_rad.z(), Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(angles_rad.y(), Vector3d::UnitY()) *
                   Eigen::AngleAxisd(angles_rad.x(), Vector3d::UnitX()))
                      .toRotationMatrix();
  X_AB.translation() = Vector3d(six.x_mm, six.y_mm, six.z_mm);
  return X_AB;
}

SixNumbers to_six_numbers(const Pose& X_AB) {
  const Matrix3d R = X_AB.linear();
  const double cos_ry = std::hypot(R(0, 0), R(1, 0));
  const double ry = std::atan2(-R(2, 0), cos_ry);
  double rx = 0, rz = 0;
  if (cos_ry > 1e-9) {
    rx = std::atan2(R(2, 1), R(2, 2));
    rz = std::atan2(R(1, 0), R(0, 0));
  } else {
    rz = std::atan2(-R(0, 1), R(1, 1));
  }
  const Vector3d p = X_AB.translation();
  return {p.x(), p.y(), p.z(), rx * degrees_per_radian, ry * degrees_per_radian, rz * degrees_per_radian};
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d M;
  M << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return M;
}

Matrix3d exp_so3(const Vector3d& phi_rad) {
  const double angle = phi_rad.norm();
  const Matrix3d K = cross_matrix(phi_rad);
  // sin(a)/a and (1 - cos a)/a^2, by series where the quotient loses digits.
  const double a = angle < 1e-4 ? 1 - angle * angle / 6 : std::sin(angle) / angle;
  const double half = std::sin(angle / 2);
  const double b = angle < 1e-4 ? 0.5 - angle * angle / 24 : 2 * half * half / (angle * angle);
  return Matrix3d::Identity() + a * K + b * K * K;
}

Vector3d log_so3(const Matrix3d& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * q.vec();
  return 2 * std::atan2(sine, q.w()) / sine * q.vec();
}

Pose moved(const Pose& X_AB, const Vector6& delta) {
  Pose X_AB2 = X_AB;
  X_AB2.translation() += delta.head<3>();
  X_AB2.linear() = exp_so3(delta.tail<3>()) * X_AB.linear();
  return X_AB2;
}

Vector6 difference(const Pose& X_AB, const Pose& X_AB2) {
  Vector6 delta;
  delta << X_AB2.translation() - X_AB.translation(), log_so3(X_AB2.linear() * X_AB.linear().transpose());
  return delta;
}

Pose average(std::span<const Pose> poses_AB) {
  assert(!poses_AB.empty());
  Pose mean = poses_AB.front();
  for (int round = 0; round < 20; ++round) {
    Vector6 delta = Vector6::Zero();
    for (const Pose& X_AB : poses_AB) delta += difference(mean, X_AB);
    delta /= static_cast<double>(poses_AB.size());
    mean = moved(mean, delta);
    if (delta.norm() < 1e-13) break;
  }
  mean.linear() = nearest_rotation(mean.linear());
  return mean;
}

Matrix3d nearest_rotation(const Matrix3d& M) {
  const Eigen::JacobiSVD<Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d sign = Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

}  // namespace zeropose
