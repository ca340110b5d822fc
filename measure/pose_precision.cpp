#include "measure/pose_precision.h"

#include <cmath>
#include <limits>

#include "calib/symmetric_eigen.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

// A pose that is known no better than this share of the marks' extent, one sigma, is a guess: 17 degrees.
constexpr double max_sigma_share = 0.3;

// The inverse of the normal matrix (in the free directions) and its condition; false when singular.
bool invert(const PoseModel& model, const Matrix6& N, Matrix6& inverse, double& condition) {
  condition = std::numeric_limits<double>::infinity();
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    const Eigen::Matrix3d N3 = basis.transpose() * N * basis;
    const SmallCholesky<3> cholesky(N3);
    if (!cholesky.ok()) return false;
    const Eigen::Matrix3d inverse3 = cholesky.inverse();
    condition = condition_of(N3, inverse3);
    inverse = basis * inverse3 * basis.transpose();
  } else {
    const SmallCholesky<6> cholesky(N);
    if (!cholesky.ok()) return false;
    inverse = cholesky.inverse();
    condition = condition_of(N, inverse);
  }
  return inverse.allFinite() && condition < max_pose_condition;
}

// sum J' W' C W J over the active observations; C as 11, 12, 22.
Matrix6 weighted_sum(const PoseModel& model, std::array<Lanes, 3> SightBlock::*covariance) {
  std::array<Lanes, 21> sums;
  sums.fill(Lanes::Zero());
  for (const SightBlock& block : model.blocks()) {
    const std::array<Lanes, 3>& C = block.*covariance;
    std::size_t at = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const Lanes a1 = block.active * (C[0] * block.row1[i] + C[1] * block.row2[i]);
      const Lanes a2 = block.active * (C[1] * block.row1[i] + C[2] * block.row2[i]);
      for (std::size_t j = 0; j <= i; ++j) sums[at++] += a1 * block.row1[j] + a2 * block.row2[j];
    }
  }
  Matrix6 M;
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < 6; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) M(i, j) = M(j, i) = sums[at++].sum();
  return M;
}

Matrix6 symmetric(const Matrix6& M) { return 0.5 * (M + M.transpose()); }

// N^-1 (sum J' P C P J) N^-1 for the own and the total covariance C of the residuals.
void propagate(PoseModel& model, Precision& precision) {
  if (model.plain()) {
    precision.covariance = precision.total_covariance = precision.inverse_N;
    return;
  }
  const Matrix6& inverse = precision.inverse_N;
  precision.covariance = symmetric(inverse * weighted_sum(model, &SightBlock::own) * inverse);
  precision.total_covariance = symmetric(inverse * weighted_sum(model, &SightBlock::total) * inverse);
}

// The rows of W J in the metric S: row_i' S row_k as 11, 12, 22.
std::array<Lanes, 3> products(const SightBlock& block, const Matrix6& S) {
  std::array<Lanes, 3> result{Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
  for (std::size_t i = 0; i < 6; ++i) {
    Lanes s1 = Lanes::Zero(), s2 = Lanes::Zero();
    for (std::size_t j = 0; j < 6; ++j) {
      const double weight = S(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i));
      s1 += weight * block.row1[j];
      s2 += weight * block.row2[j];
    }
    result[0] += s1 * block.row1[i];
    result[1] += s1 * block.row2[i];
    result[2] += s2 * block.row2[i];
  }
  return result;
}

// r' C^-1 r.
Lanes square_by(const std::array<Lanes, 2>& r, const std::array<Lanes, 3>& C) {
  return (C[2] * r[0] * r[0] - 2 * C[1] * r[0] * r[1] + C[0] * r[1] * r[1]) / (C[0] * C[2] - C[1] * C[1]);
}

// Where an observation is not controlled by the others both r and its variance vanish: a little of the
// variance is kept.
constexpr double kept_share = 1 + 1e-9;

}  // namespace

Precision precision_of(PoseModel& model, const Solution& solution) {
  Precision precision;
  if (!model.plain()) model.refresh_covariances();
  if (!invert(model, solution.equations.N, precision.inverse_N, precision.condition)) return precision;
  propagate(model, precision);
  precision.weakest_sigma_mm = std::sqrt(precision.total_covariance.trace());
  precision.determined = precision.weakest_sigma_mm < max_sigma_share * model.extent_mm();
  return precision;
}

Vector6 weakest_direction(const PoseModel& model, const Matrix6& N) {
  if (!model.planar()) return symmetric_eigen(N).vectors.col(0);
  const auto& basis = model.planar_basis();
  return basis * symmetric_eigen(basis.transpose() * N * basis).vectors.col(0);
}

// r / sigma of r, as the length of a vector: r' Cov(r)^-1 r, all whitened, with
// Cov(r) = C - H C - C H' + J Cov(pose) J', H = J N^-1 J'; for an unused observation C + J Cov(pose) J'.
double normalise(PoseModel& model, const Precision& precision) {
  Lanes misfit = Lanes::Zero();
  for (SightBlock& block : model.blocks()) {
    std::array<Lanes, 3> Q;
    const std::array<Lanes, 3> H = products(block, precision.inverse_N);
    const Lanes& active = block.active;
    if (model.plain()) {
      const Lanes sign = 1 - 2 * active;
      Q = {kept_share + sign * H[0], sign * H[1], kept_share + sign * H[2]};
      misfit += active * (block.Wr[0] * block.Wr[0] + block.Wr[1] * block.Wr[1]);
    } else {
      const std::array<Lanes, 3>& C = block.total;
      const std::array<Lanes, 3> G = products(block, precision.total_covariance);
      const Lanes HC11 = H[0] * C[0] + H[1] * C[1], HC12 = H[0] * C[1] + H[1] * C[2];
      const Lanes HC21 = H[1] * C[0] + H[2] * C[1], HC22 = H[1] * C[1] + H[2] * C[2];
      Q = {kept_share * C[0] + G[0] - active * 2 * HC11, kept_share * C[1] + G[1] - active * (HC12 + HC21),
           kept_share * C[2] + G[2] - active * 2 * HC22};
      misfit += active * square_by(block.Wr, C);
    }
    block.normalised = square_by(block.Wr, Q).max(0.0).sqrt();
    for (std::size_t k = 0; k < lane_count; ++k)
      if (!block.visible[k]) block.normalised[static_cast<Eigen::Index>(k)] = no_tolerance;
  }
  return misfit.sum();
}

}  // namespace zeropose
