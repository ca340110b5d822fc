#include "calib/best_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A spread across the line below this share of the length along it is taken for a line.
constexpr double collinear_ratio = 1e-6;

struct Moments {
  double weight = 0;
  Vector3d centre_A = Vector3d::Zero(), centre_B = Vector3d::Zero();
  Matrix3d cross = Matrix3d::Zero(), spread_A = Matrix3d::Zero(), spread_B = Matrix3d::Zero();
};

Moments moments_of(std::span<const PointPair> pairs) {
  Moments m;
  for (const auto& pair : pairs) {
    m.weight += pair.weight;
    m.centre_A += pair.weight * pair.p_A_mm;
    m.centre_B += pair.weight * pair.p_B_mm;
  }
  m.centre_A /= m.weight;
  m.centre_B /= m.weight;
  for (const auto& pair : pairs) {
    const Vector3d a = pair.p_A_mm - m.centre_A, b = pair.p_B_mm - m.centre_B;
    m.cross += pair.weight * a * b.transpose();
    m.spread_A += pair.weight * a * a.transpose();
    m.spread_B += pair.weight * b * b.transpose();
  }
  return m;
}

bool is_line(const Matrix3d& spread) {
  const Vector3d squares = symmetric_eigen(spread).values;
  return !(squares(1) > collinear_ratio * collinear_ratio * squares(2));
}

// For unit variance of a coordinate of weight 1: a point moves by dt + w x (R p_B).
Matrix6 cofactor(std::span<const PointPair> pairs, const Pose& X_AB) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(6, 6);
  for (const auto& pair : pairs) {
    Eigen::MatrixXd J(3, 6);
    J << Matrix3d::Identity(), -cross_matrix(X_AB.linear() * pair.p_B_mm);
    N += pair.weight * J.transpose() * J;
  }
  return N.inverse();
}

bool is_finite(const PointPair& pair) {
  return pair.p_A_mm.allFinite() && pair.p_B_mm.allFinite() && std::isfinite(pair.weight) && pair.weight >= 0;
}

BestFitResult failed(BestFitStatus status) {
  BestFitResult result;
  result.status = status;
  return result;
}

}  // namespace

BestFitResult best_fit(std::span<const PointPair> pairs) {
  if (!std::all_of(pairs.begin(), pairs.end(), is_finite)) return failed(BestFitStatus::not_finite);
  if (std::count_if(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.weight > 0; }) < 3)
    return failed(BestFitStatus::too_few_points);
  const Moments m = moments_of(pairs);
  if (is_line(m.spread_A) || is_line(m.spread_B)) return failed(BestFitStatus::collinear);

  BestFitResult result;
  result.status = BestFitStatus::ok;
  result.X_AB.linear() = nearest_rotation(m.cross);
  result.X_AB.translation() = m.centre_A - result.X_AB.linear() * m.centre_B;
  double sum = 0;
  for (const auto& pair : pairs) {
    result.residuals_mm.push_back(pair.p_A_mm - result.X_AB * pair.p_B_mm);
    sum += pair.weight * result.residuals_mm.back().squaredNorm();
  }
  result.rms_mm = std::sqrt(sum / m.weight);
  const auto used =
      std::count_if(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.weight > 0; });
  result.sigma_mm = std::sqrt(sum / (3.0 * static_cast<double>(used) - 6));
  result.covariance = result.sigma_mm * result.sigma_mm * cofactor(pairs, result.X_AB);
  return result;
}

}  // namespace zeropose
