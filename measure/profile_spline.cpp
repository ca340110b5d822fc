#include "measure/profile_spline.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace zeropose {
namespace {

constexpr double normal_median = 0.6745;  // of the size of a normal variable of sigma 1

}  // namespace

SplineKnots::SplineKnots(double from_mm, double to_mm, double spacing_mm) : from_mm_(from_mm) {
  const double pieces = std::max(1.0, std::round((to_mm - from_mm) / spacing_mm));
  spacing_mm_ = (to_mm - from_mm) / pieces;
  count_ = static_cast<Eigen::Index>(pieces) + 3;
}

SplineWeights SplineKnots::at(double radius_mm) const {
  const double x = (radius_mm - from_mm_) / spacing_mm_;
  SplineWeights weights;
  weights.first = std::clamp(static_cast<Eigen::Index>(std::floor(x)), Eigen::Index{0}, count_ - 4);
  const double t = x - static_cast<double>(weights.first), s = 1 - t, k = spacing_mm_;
  weights.value << s * s * s, 4 + t * t * (3 * t - 6), 4 + s * s * (3 * s - 6), t * t * t;
  weights.value /= 6;
  weights.slope << -s * s, t * (3 * t - 4), -s * (3 * s - 4), t * t;
  weights.slope /= 2 * k;
  weights.bend << s, 3 * t - 2, 3 * s - 2, t;
  weights.bend /= k * k;
  return weights;
}

void even_out(Eigen::MatrixXd& normal, Eigen::Index coefficients, double strength) {
  const Eigen::Index first = normal.rows() - coefficients;
  const double weight = strength * normal.diagonal().tail(coefficients).mean();
  const Eigen::Vector3d second(1, -2, 1);
  for (Eigen::Index i = first; i + 2 < normal.rows(); ++i)
    normal.block<3, 3>(i, i) += weight * second * second.transpose();
}

ProfileSpline::ProfileSpline(std::span<const ProfileSample> samples, const SplineKnots& knots, double gain)
    : knots_(knots) {
  const Eigen::Index n = knots_.coefficients();
  assert(std::ssize(samples) > n);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const ProfileSample& sample : samples) {
    const SplineWeights w = knots_.at(sample.radius_mm);
    const double weight = 1 / (sample.sigma_mm * sample.sigma_mm);
    normal.block<4, 4>(w.first, w.first) += weight * w.value * w.value.transpose();
    right.segment<4>(w.first) += weight * sample.height_mm * w.value;
  }
  even_out(normal, n);
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  coefficients_ = solver.solve(right);
  std::vector<double> off;
  for (const ProfileSample& sample : samples) {
    const SplineWeights w = knots_.at(sample.radius_mm);
    off.push_back(std::abs(sample.height_mm - w.value.dot(coefficients_.segment<4>(w.first))) /
                  sample.sigma_mm);
  }
  const auto middle = off.begin() + std::ssize(off) / 2;
  std::ranges::nth_element(off, middle);
  scatter_ =
      *middle / normal_median *
      std::sqrt(static_cast<double>(std::ssize(samples)) / static_cast<double>(std::ssize(samples) - n));
  covariance_ = gain * std::max(1.0, scatter_ * scatter_) * solver.solve(Eigen::MatrixXd::Identity(n, n));
}

ProfileHeight ProfileSpline::at(double radius_mm) const {
  const SplineWeights w = knots_.at(radius_mm);
  const Eigen::Vector4d c = coefficients_.segment<4>(w.first);
  const double variance = w.value.dot(covariance_.block<4, 4>(w.first, w.first) * w.value);
  return {w.value.dot(c), w.slope.dot(c), w.bend.dot(c), std::sqrt(std::max(0.0, variance))};
}

}  // namespace zeropose
