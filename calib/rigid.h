// Rigid poses: composition by letters, six numbers at the edges, averages on the manifold.
#pragma once

#include <Eigen/Geometry>
#include <span>

namespace zeropose {

// The pose X_AB of frame B in frame A: p_A = X_AB * p_B. Millimetres; the linear part is a rotation.
//
// Frames: W world, C camera, O object, O0 object at its zero position, R robot base, H robot hand,
// T tool, B calibration body or board (spec 10).
using Pose = Eigen::Isometry3d;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

inline constexpr double degrees_per_radian = 57.295779513082320877;

// A pose as files and screens show it: R = Rz(rz) * Ry(ry) * Rx(rx) (spec 10). For edges only.
struct SixNumbers {
  double x_mm = 0, y_mm = 0, z_mm = 0;
  double rx_deg = 0, ry_deg = 0, rz_deg = 0;
};

Pose from_six_numbers(const SixNumbers& six);

// At ry = +-90 deg only rz - rx (or rz + rx) is defined: rx is then 0 and the result still composes to X_AB.
SixNumbers to_six_numbers(const Pose& X_AB);

// Rotation by |phi| rad about phi (Rodrigues) and its inverse, |log| <= pi.
Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi_rad);
Eigen::Vector3d log_so3(const Eigen::Matrix3d& R);

// X_AB moved by delta = (translation mm, rotation rad), both along the axes of A, the rotation about B's
// origin: p <- p + delta_t, R <- exp(delta_r) * R. Every 6x6 covariance of a pose in this project is that of
// this delta.
Pose moved(const Pose& X_AB, const Vector6& delta);

// The delta with moved(X_AB, delta) = X_AB2.
Vector6 difference(const Pose& X_AB, const Pose& X_AB2);

// The pose with the least sum of squared differences to all (rotation: Karcher mean). Precondition: not
// empty, rotations within 90 deg of each other.
Pose average(std::span<const Pose> poses_AB);

// The rotation nearest to M in the Frobenius norm (spec 30 A1), det = +1.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);

// [v]x with [v]x * w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

}  // namespace zeropose
