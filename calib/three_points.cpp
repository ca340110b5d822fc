#include "calib/three_points.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <limits>

#include "calib/best_fit.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

// A complex root this near to the real axis, relative to its size, may be a real one that noise has moved.
constexpr double nearly_real = 0.1;

// The real roots of c4 v^4 + ... + c0, and the real parts of those that are almost real.
std::vector<double> roots_of(const std::array<double, 5>& c) {
  std::array<double, 5> monic{};
  for (std::size_t i = 0; i < 5; ++i) monic[i] = c[i] / c[4];
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  for (int i = 0; i < 4; ++i) companion(i, 3) = -monic[static_cast<std::size_t>(i)];
  if (!companion.allFinite()) return {};
  const Eigen::Vector4cd values = companion.eigenvalues();
  std::vector<double> roots;
  for (const std::complex<double>& value : values)
    if (std::abs(value.imag()) <= nearly_real * std::abs(value) && value.imag() >= 0)
      roots.push_back(value.real());
  return roots;
}

struct Triangle {
  double a2, b2, c2;                      // squared sides 23, 13, 12
  double cos_alpha, cos_beta, cos_gamma;  // between the directions 23, 13, 12
};

// The quartic in v = s3 / s1, s the distances from the camera.
std::array<double, 5> quartic_of(const Triangle& t) {
  const double p = (t.a2 - t.c2) / t.b2, q = (t.a2 + t.c2) / t.b2, r = t.a2 / t.b2, s = t.c2 / t.b2;
  const double ca = t.cos_alpha, cb = t.cos_beta, cg = t.cos_gamma;
  return {
      (1 + p) * (1 + p) - 4 * r * cg * cg, 4 * (-p * (1 + p) * cb + 2 * r * cg * cg * cb - (1 - q) * ca * cg),
      2 * (p * p - 1 + 2 * p * p * cb * cb + 2 * (1 - s) * ca * ca - 4 * q * ca * cb * cg +
           2 * (1 - r) * cg * cg),
      4 * (p * (1 - p) * cb - (1 - q) * ca * cg + 2 * s * ca * ca * cb), (p - 1) * (p - 1) - 4 * s * ca * ca};
}

}  // namespace

std::vector<Pose> poses_from_three(const std::array<Vector3d, 3>& p_W_mm,
                                   const std::array<Vector3d, 3>& d_C) {
  const Vector3d j1 = d_C[0].normalized(), j2 = d_C[1].normalized(), j3 = d_C[2].normalized();
  const Triangle t{(p_W_mm[1] - p_W_mm[2]).squaredNorm(),
                   (p_W_mm[0] - p_W_mm[2]).squaredNorm(),
                   (p_W_mm[0] - p_W_mm[1]).squaredNorm(),
                   j2.dot(j3),
                   j1.dot(j3),
                   j1.dot(j2)};
  const double p = (t.a2 - t.c2) / t.b2;
  std::vector<Pose> poses;
  for (const double v : roots_of(quartic_of(t))) {
    const double u =
        ((p - 1) * v * v - 2 * p * t.cos_beta * v + 1 + p) / (2 * (t.cos_gamma - v * t.cos_alpha));
    const double s1 = std::sqrt(t.b2 / (1 + v * v - 2 * v * t.cos_beta));
    if (!(v > 0 && u > 0 && std::isfinite(u * s1))) continue;
    const std::array<PointPair, 3> pairs{PointPair{p_W_mm[0], s1 * j1}, PointPair{p_W_mm[1], u * s1 * j2},
                                         PointPair{p_W_mm[2], v * s1 * j3}};
    const BestFitResult fit = best_fit(pairs);
    if (fit.status == BestFitStatus::ok) poses.push_back(fit.X_AB);
  }
  return poses;
}

}  // namespace zeropose
