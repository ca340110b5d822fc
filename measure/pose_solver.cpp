#include "measure/pose_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

// A step below this (mm at the extent of the marks) is the last one, if the step after it, as the last two
// predict it, is below the second: what was linearised before it still holds.
constexpr double last_step_mm = 1e-4, next_step_mm = 1e-7;
// What the lens adds to the outlines of discs is computed near the solution only.
constexpr double bend_step_mm = 2;
constexpr int max_rounds = 100;

// Solves (N + damping diag N) delta = g in the free directions. False when singular.
bool solve_step(const PoseModel& model, const NormalEquations& equations, double damping, Vector6& delta) {
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    Eigen::Matrix3d N3 = basis.transpose() * equations.N * basis;
    N3.diagonal() *= 1 + damping;
    const SmallCholesky<3> cholesky(N3);
    if (!cholesky.ok() || cholesky.condition_at_least() > max_pose_condition) return false;
    delta = basis * cholesky.solve(basis.transpose() * equations.g);
  } else {
    Matrix6 N = equations.N;
    N.diagonal() *= 1 + damping;
    const SmallCholesky<6> cholesky(N);
    if (!cholesky.ok() || cholesky.condition_at_least() > max_pose_condition) return false;
    delta = cholesky.solve(equations.g);
  }
  return delta.allFinite();
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
      const double step_mm = delta.head<3>().norm() + delta.tail<3>().norm();
      delta.tail<3>() /= model_.extent_mm();
      const CentredPose next = moved(solution_.pose, delta);
      if (is_last(step_mm) && !model_.bends_are_old(next)) {
        solution_.pose = next;
        return SolverStatus::converged;
      }
      if (take(next, step_mm)) {
        previous_step_mm_ = step_mm;
        damping_ = damping_ < 1e-3 ? 0 : damping_ / 10;
      } else if (!damp()) {
        return SolverStatus::not_converged;
      }
    }
    return SolverStatus::not_converged;
  }

 private:
  bool is_last(double step_mm) const {
    return step_mm < last_step_mm && step_mm * std::min(1.0, step_mm / previous_step_mm_) < next_step_mm;
  }

  // Goes there if the cost gets lower. Where the lens' part of the outlines had to be computed anew, costs
  // with the old and the new one are not compared: the equations here are made anew and the step is tried
  // again.
  bool take(const CentredPose& next, double step_mm) {
    const bool other_bends = step_mm < bend_step_mm && model_.bends_are_old(next);
    if (other_bends) model_.refresh_bends(next);
    NormalEquations equations;
    const double old_cost = solution_.equations.cost;
    if (!model_.linearise(next, equations) || !(equations.cost <= old_cost * (1 + 1e-9) + 1e-12))
      return other_bends && model_.linearise(solution_.pose, solution_.equations);
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
};

}  // namespace

Solution refine(PoseModel& model, const CentredPose& start) {
  Solution solution;
  solution.pose = start;
  solution.status = SolverStatus::no_image;
  if (!model.linearise(start, solution.equations)) return solution;
  Descent descent(model, solution);
  solution.status = descent.run();
  // The last step was not linearised again, but deviations are those of where it went.
  if (!model.linearise(solution.pose, solution.equations)) solution.status = SolverStatus::no_image;
  return solution;
}

}  // namespace zeropose
