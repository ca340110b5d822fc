#include "measure/pose_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

// A step below this (mm at the extent of the marks) is the last one: the next would be a thousand times
// smaller.
constexpr double last_step_mm = 1e-6;
// A step above this changes the eccentricity of the discs' images noticeably (about 1e-7 px per 0.01 mm).
constexpr double offset_step_mm = 1e-2;
constexpr int max_rounds = 100;

// Beyond this the normal matrix is singular within rounding.
constexpr double max_condition = 1e13;
// A pose that is known no better than this share of the marks' extent, one sigma, is a guess: 17 degrees.
constexpr double max_sigma_share = 0.3;

Vector6 scales(const PoseModel& model) {
  Vector6 scale = Vector6::Ones();
  scale.tail<3>().setConstant(1 / model.extent_mm());
  return scale;
}

// Solves (N + damping diag N) delta = g in the free directions.
bool solve_step(const PoseModel& model, const NormalEquations& equations, double damping, Vector6& delta) {
  const Vector6 scale = scales(model);
  Matrix6 N = scale.asDiagonal() * equations.N * scale.asDiagonal();
  const Vector6 g = scale.cwiseProduct(equations.g);
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    Eigen::Matrix3d N3 = basis.transpose() * N * basis;
    N3.diagonal() *= 1 + damping;
    const Eigen::LLT<Eigen::Matrix3d> cholesky(N3);
    if (cholesky.info() != Eigen::Success) return false;
    delta = scale.cwiseProduct(basis * cholesky.solve(basis.transpose() * g));
  } else {
    N.diagonal() *= 1 + damping;
    const Eigen::LLT<Matrix6> cholesky(N);
    if (cholesky.info() != Eigen::Success) return false;
    delta = scale.cwiseProduct(cholesky.solve(g));
  }
  return delta.allFinite();
}

double length_mm(const PoseModel& model, const Vector6& delta) {
  return delta.head<3>().norm() + model.extent_mm() * delta.tail<3>().norm();
}

double raised(double damping) { return std::max(10 * damping, 1e-4); }

// One round of Levenberg-Marquardt: a step that lowers the cost, or more damping.
struct Round {
  bool accepted = false;
  double step_mm = 0;
};

Round try_step(PoseModel& model, Solution& solution, double damping) {
  Vector6 delta;
  if (!solve_step(model, solution.equations, damping, delta)) return {};
  const double step_mm = length_mm(model, delta);
  const CentredPose next = moved(solution.pose, delta);
  if (step_mm < last_step_mm) {
    solution.pose = next;
    return {true, step_mm};
  }
  NormalEquations equations;
  const bool accepted =
      model.linearise(next, equations) && equations.cost <= solution.equations.cost * (1 + 1e-9) + 1e-12;
  if (accepted) {
    solution.pose = next;
    solution.equations = equations;
  }
  return {accepted, step_mm};
}

SolverStatus iterate(PoseModel& model, Solution& solution) {
  double damping = 0;
  for (int round = 0; round < max_rounds; ++round) {
    const Round done = try_step(model, solution, damping);
    if (done.accepted && done.step_mm < last_step_mm) return SolverStatus::converged;
    if (!done.accepted) {
      damping = raised(damping);
      if (damping > 1e12) return SolverStatus::not_converged;
      continue;
    }
    damping = damping < 1e-3 ? 0 : damping / 10;
    if (done.step_mm > offset_step_mm) {
      model.refresh_offsets(solution.pose);
      if (!model.linearise(solution.pose, solution.equations)) return SolverStatus::no_image;
    }
  }
  return SolverStatus::not_converged;
}

Matrix6 unscaled(const Matrix6& M, const Vector6& scale) {
  return scale.asDiagonal() * M * scale.asDiagonal();
}

template <typename Matrix>
double condition_of(const Matrix& M, const Matrix& inverse) {
  return M.cwiseAbs().colwise().sum().maxCoeff() * inverse.cwiseAbs().colwise().sum().maxCoeff();
}

// The inverse of the scaled normal matrix (in the free directions) and its condition; false when singular.
bool invert(const PoseModel& model, const Matrix6& N, Matrix6& inverse, double& condition) {
  condition = std::numeric_limits<double>::infinity();
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    const Eigen::Matrix3d N3 = basis.transpose() * N * basis;
    const Eigen::LLT<Eigen::Matrix3d> cholesky(N3);
    if (cholesky.info() != Eigen::Success) return false;
    const Eigen::Matrix3d inverse3 = cholesky.solve(Eigen::Matrix3d::Identity());
    condition = condition_of(N3, inverse3);
    inverse = basis * inverse3 * basis.transpose();
  } else {
    const Eigen::LLT<Matrix6> cholesky(N);
    if (cholesky.info() != Eigen::Success) return false;
    inverse = cholesky.solve(Matrix6::Identity());
    condition = condition_of(N, inverse);
  }
  return inverse.allFinite() && condition < max_condition;
}

Vector6 weakest_direction(const PoseModel& model, const Matrix6& N) {
  if (!model.planar()) return Eigen::SelfAdjointEigenSolver<Matrix6>(N).eigenvectors().col(0);
  const auto& basis = model.planar_basis();
  const Eigen::Matrix3d N3 = basis.transpose() * N * basis;
  return basis * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(N3).eigenvectors().col(0);
}

// N^-1 (sum J' P C P J) N^-1 for the own and the total covariance C of the residuals.
void propagate(const PoseModel& model, Precision& precision) {
  Matrix6 own = Matrix6::Zero(), total = Matrix6::Zero();
  for (const Sight& sight : model.sights()) {
    if (!sight.active) continue;
    const Eigen::Matrix<double, 2, 3> PA = sight.information * sight.A;
    add_normal_matrix(PA.transpose() * model.own_covariance(sight) * PA, sight.q, own);
    add_normal_matrix(PA.transpose() * model.total_covariance(sight) * PA, sight.q, total);
  }
  precision.covariance = precision.inverse_N * own * precision.inverse_N;
  precision.total_covariance = precision.inverse_N * total * precision.inverse_N;
}

}  // namespace

Solution refine(PoseModel& model, const CentredPose& start) {
  Solution solution;
  solution.pose = start;
  model.refresh_offsets(start);
  solution.status =
      model.linearise(start, solution.equations) ? iterate(model, solution) : SolverStatus::no_image;
  NormalEquations at_solution;
  if (model.linearise(solution.pose, at_solution, true)) solution.equations = at_solution;
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
