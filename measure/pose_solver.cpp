#include "measure/pose_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/symmetric_eigen.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

// A step below this (mm at the extent of the marks) is the last one, if the step after it, as the last two
// predict it, is below the second: what was linearised before it still holds.
constexpr double last_step_mm = 1e-4, next_step_mm = 1e-7;
// A step above this changes the eccentricity of the discs' images noticeably (about 1e-7 px per 0.01 mm).
constexpr double offset_step_mm = 1e-2;
constexpr int max_rounds = 100;

// Beyond this the geometry leaves a direction open: one camera that sees marks 1000 times closer to each
// other than to itself stays below 1e8.
constexpr double max_condition = 1e10;
// A pose that is known no better than this share of the marks' extent, one sigma, is a guess: 17 degrees.
constexpr double max_sigma_share = 0.3;

Vector6 scales(const PoseModel& model) {
  Vector6 scale = Vector6::Ones();
  scale.tail<3>().setConstant(1 / model.extent_mm());
  return scale;
}

// Solves (N + damping diag N) delta = g in the free directions. False when singular.
bool solve_step(const PoseModel& model, const NormalEquations& equations, double damping, Vector6& delta) {
  const Vector6 scale = scales(model);
  Matrix6 N = scale.asDiagonal() * equations.N * scale.asDiagonal();
  const Vector6 g = scale.cwiseProduct(equations.g);
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    Eigen::Matrix3d N3 = basis.transpose() * N * basis;
    N3.diagonal() *= 1 + damping;
    const SmallCholesky<3> cholesky(N3);
    if (!cholesky.ok() || cholesky.condition_at_least() > max_condition) return false;
    delta = scale.cwiseProduct(basis * cholesky.solve(basis.transpose() * g));
  } else {
    N.diagonal() *= 1 + damping;
    const SmallCholesky<6> cholesky(N);
    if (!cholesky.ok() || cholesky.condition_at_least() > max_condition) return false;
    delta = scale.cwiseProduct(cholesky.solve(g));
  }
  return delta.allFinite();
}

double length_mm(const PoseModel& model, const Vector6& delta) {
  return delta.head<3>().norm() + model.extent_mm() * delta.tail<3>().norm();
}

// Levenberg-Marquardt from a pose the model is linearised at.
class Descent {
 public:
  Descent(PoseModel& model, Solution& solution) : model_(model), solution_(solution) {}

  SolverStatus run() {
    for (int round = 0; round < max_rounds; ++round) {
      Vector6 delta;
      if (!solve_step(model_, solution_.equations, damping_, delta)) {
        if (round == 0) return SolverStatus::singular;
        if (!damp()) return SolverStatus::not_converged;
        continue;
      }
      const double step_mm = length_mm(model_, delta);
      if (is_last(step_mm)) {
        solution_.pose = moved(solution_.pose, delta);
        return SolverStatus::converged;
      }
      if (take(delta, step_mm)) {
        previous_step_mm_ = step_mm;
        damping_ = damping_ < 1e-3 ? 0 : damping_ / 10;
      } else if (!damp()) {
        return SolverStatus::not_converged;
      }
    }
    return SolverStatus::not_converged;
  }

  bool model_is_elsewhere() const { return rejected_; }

 private:
  bool is_last(double step_mm) const {
    return step_mm < last_step_mm && step_mm * std::min(1.0, step_mm / previous_step_mm_) < next_step_mm;
  }

  // Goes there if the cost gets lower.
  bool take(const Vector6& delta, double step_mm) {
    const CentredPose next = moved(solution_.pose, delta);
    if (step_mm > offset_step_mm) model_.refresh_offsets(next);
    NormalEquations equations;
    rejected_ = !model_.linearise(next, equations) ||
                !(equations.cost <= solution_.equations.cost * (1 + 1e-9) + 1e-12);
    if (rejected_) {
      if (step_mm > offset_step_mm) model_.refresh_offsets(solution_.pose);
      return false;
    }
    solution_.pose = next;
    solution_.equations = equations;
    return true;
  }

  bool damp() {
    damping_ = std::max(10 * damping_, 1e-4);
    return damping_ <= 1e12;
  }

  PoseModel& model_;
  Solution& solution_;
  double damping_ = 0;
  double previous_step_mm_ = std::numeric_limits<double>::infinity();
  bool rejected_ = false;  // the last linearisation was not taken
};

Matrix6 unscaled(const Matrix6& M, const Vector6& scale) {
  return scale.asDiagonal() * M * scale.asDiagonal();
}

// The inverse of the scaled normal matrix (in the free directions) and its condition; false when singular.
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
  return inverse.allFinite() && condition < max_condition;
}

Vector6 weakest_direction(const PoseModel& model, const Matrix6& N) {
  if (!model.planar()) return symmetric_eigen(N).vectors.col(0);
  const auto& basis = model.planar_basis();
  return basis * symmetric_eigen(basis.transpose() * N * basis).vectors.col(0);
}

// L with L L' = C for a covariance of two.
Eigen::Matrix2d root_of(const Eigen::Matrix2d& C) {
  Eigen::Matrix2d L = Eigen::Matrix2d::Zero();
  L(0, 0) = std::sqrt(C(0, 0));
  L(1, 0) = C(1, 0) / L(0, 0);
  L(1, 1) = std::sqrt(std::max(0.0, C(1, 1) - L(1, 0) * L(1, 0)));
  return L;
}

// N^-1 (sum J' P C P J) N^-1 for the own and the total covariance C of the residuals.
void propagate(const PoseModel& model, Precision& precision) {
  Matrix6 own = Matrix6::Zero(), total = Matrix6::Zero();
  for (const Sight& sight : model.sights()) {
    if (!sight.active) continue;
    const Eigen::Matrix<double, 6, 2> own_WJ =
        sight.WJ * (sight.whitening * root_of(model.own_covariance(sight)));
    const Eigen::Matrix<double, 6, 2> total_WJ =
        sight.WJ * (sight.whitening * root_of(model.total_covariance(sight)));
    own.noalias() += own_WJ * own_WJ.transpose();
    total.noalias() += total_WJ * total_WJ.transpose();
  }
  precision.covariance = precision.inverse_N * own * precision.inverse_N;
  precision.total_covariance = precision.inverse_N * total * precision.inverse_N;
}

}  // namespace

Solution refine(PoseModel& model, const CentredPose& start) {
  Solution solution;
  solution.pose = start;
  model.refresh_offsets(start);
  solution.status = SolverStatus::no_image;
  if (!model.linearise(start, solution.equations)) return solution;
  Descent descent(model, solution);
  solution.status = descent.run();
  if (descent.model_is_elsewhere()) model.linearise(solution.pose, solution.equations);
  model.linearise_unused(solution.pose);
  return solution;
}

Precision precision_of(const PoseModel& model, const Solution& solution) {
  Precision precision;
  const Vector6 scale = scales(model);
  const Matrix6 N = unscaled(solution.equations.N, scale);
  Matrix6 inverse;
  if (invert(model, N, inverse, precision.condition)) {
    precision.inverse_N = unscaled(inverse, scale);
    propagate(model, precision);
    const Vector6 variances = precision.total_covariance.diagonal().cwiseQuotient(scale.cwiseAbs2());
    precision.weakest_sigma_mm = std::sqrt(variances.sum());
    precision.determined = precision.weakest_sigma_mm < max_sigma_share * model.extent_mm();
  }
  if (!precision.determined) precision.weakest = weakest_direction(model, N);
  return precision;
}

}  // namespace zeropose
