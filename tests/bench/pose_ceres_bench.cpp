// The pose by Ceres, the same problems from the same starts as pose_bench.cpp: DENSE_QR with analytic and
// automatic derivatives, and its TinySolver. Points, as the peers model.
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <ceres/tiny_solver.h>

#include <cmath>
#include <deque>

#include "tests/bench/pose_cases.h"

namespace zeropose::bench {
namespace {

// Parameters: position (mm), rotation vector (rad) of X_WO.
struct AutodiffResidual {
  const CalibratedCamera* camera;
  Eigen::Matrix3d R_CW;
  Eigen::Vector3d p_OQ, u;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    const T p_O[3] = {T(p_OQ.x()), T(p_OQ.y()), T(p_OQ.z())};
    T q[3];
    ceres::AngleAxisRotatePoint(x + 3, p_O, q);
    const Eigen::Vector3d eye = camera->X_WC.translation();
    Eigen::Matrix<T, 3, 1> p_W(q[0] + x[0] - eye.x(), q[1] + x[1] - eye.y(), q[2] + x[2] - eye.z());
    const Eigen::Matrix<T, 3, 1> p_C = R_CW.cast<T>() * p_W;
    const T xn = p_C[0] / p_C[2], yn = p_C[1] / p_C[2];
    const double K = std::get<Division>(camera->model.distortion).K;
    const T factor = T(2) / (T(1) + sqrt(T(1) - T(4 * K) * (xn * xn + yn * yn)));
    residual[0] =
        (T(u.x()) - (T(camera->model.fx_px) * factor * xn + T(camera->model.cx_px))) / T(pose_sigma_px);
    residual[1] =
        (T(u.y()) - (T(camera->model.fy_px) * factor * yn + T(camera->model.cy_px))) / T(pose_sigma_px);
    return true;
  }
};

class AnalyticResidual : public ceres::SizedCostFunction<2, 6> {
 public:
  AnalyticResidual(const CalibratedCamera& camera, const Eigen::Vector3d& p_OQ, const Eigen::Vector2d& u)
      : camera_(camera), R_CW_(camera.X_WC.linear().transpose()), p_OQ_(p_OQ), u_(u) {}

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> p_WO(x[0]), phi(x[0] + 3);
    const Eigen::Vector3d q = exp_so3(phi) * p_OQ_;
    const auto projection =
        project_with_jacobian(camera_.model, R_CW_ * (q + p_WO - camera_.X_WC.translation()));
    if (!projection) return false;
    Eigen::Map<Eigen::Vector2d> r(residuals);
    r = (u_ - projection->u_px) / pose_sigma_px;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[0]);
    const Eigen::Matrix<double, 2, 3> A = projection->du_dp * R_CW_ / pose_sigma_px;
    J.leftCols<3>() = -A;
    J.rightCols<3>() = A * cross_matrix(q) * left_jacobian(phi);
    return true;
  }

 private:
  static Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
    const double angle2 = phi.squaredNorm(), angle = std::sqrt(angle2);
    const Eigen::Matrix3d K = cross_matrix(phi);
    if (angle < 1e-4) return Eigen::Matrix3d::Identity() + K / 2 + K * K / 6;
    return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / angle2 * K +
           (angle - std::sin(angle)) / (angle2 * angle) * K * K;
  }

  const CalibratedCamera& camera_;
  Eigen::Matrix3d R_CW_;
  Eigen::Vector3d p_OQ_;
  Eigen::Vector2d u_;
};

Pose solve_with_ceres(const PoseCases& all, const PoseCase& one, bool analytic) {
  Vector6 start;
  start << one.X_WO_start.translation(), log_so3(one.X_WO_start.linear());
  double* x = start.data();
  ceres::Problem problem;
  for (const Observation& observation : one.observations) {
    const CalibratedCamera& camera = all.cameras[observation.camera];
    const Eigen::Vector3d p_OQ = one.marks[observation.mark].p_O_mm;
    ceres::CostFunction* cost = nullptr;
    if (analytic)
      cost = new AnalyticResidual(camera, p_OQ, observation.u_px);
    else
      cost = new ceres::AutoDiffCostFunction<AutodiffResidual, 2, 6>(new AutodiffResidual{
          &camera, camera.X_WC.linear().transpose(), p_OQ, {observation.u_px.x(), observation.u_px.y(), 0}});
    problem.AddResidualBlock(cost, nullptr, x);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Pose X_WO = Pose::Identity();
  X_WO.linear() = exp_so3(start.tail<3>());
  X_WO.translation() = start.head<3>();
  return X_WO;
}

// All residuals of a case at once, as TinySolver wants them.
class TinyResidual {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 6 };

  TinyResidual(const PoseCases& all, const PoseCase& one) {
    for (const Observation& observation : one.observations)
      parts_.emplace_back(all.cameras[observation.camera], one.marks[observation.mark].p_O_mm,
                          observation.u_px);
  }
  int NumResiduals() const { return static_cast<int>(2 * parts_.size()); }
  bool operator()(const double* x, double* residuals, double* jacobian) const {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6>> J(jacobian, jacobian ? NumResiduals() : 0, 6);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      Eigen::Matrix<double, 2, 6, Eigen::RowMajor> part;
      double* of_part = part.data();
      if (!parts_[i].Evaluate(&x, residuals + 2 * i, jacobian ? &of_part : nullptr)) return false;
      if (jacobian) J.middleRows<2>(static_cast<Eigen::Index>(2 * i)) = part;
    }
    return true;
  }

 private:
  std::deque<AnalyticResidual> parts_;
};

Pose solve_with_tiny_solver(const PoseCases& all, const PoseCase& one) {
  Vector6 x;
  x << one.X_WO_start.translation(), log_so3(one.X_WO_start.linear());
  ceres::TinySolver<TinyResidual> solver;
  solver.options.gradient_tolerance = 1e-9;
  solver.options.parameter_tolerance = 1e-10;
  solver.Solve(TinyResidual(all, one), &x);
  Pose X_WO = Pose::Identity();
  X_WO.linear() = exp_so3(x.tail<3>());
  X_WO.translation() = x.head<3>();
  return X_WO;
}

void ceres_analytic(benchmark::State& state) {
  const PoseCases all = car_body_cases(false);
  run_poses(state, all, [&](const PoseCase& one) { return solve_with_ceres(all, one, true); });
}
void ceres_autodiff(benchmark::State& state) {
  const PoseCases all = car_body_cases(false);
  run_poses(state, all, [&](const PoseCase& one) { return solve_with_ceres(all, one, false); });
}
void ceres_tiny_solver(benchmark::State& state) {
  const PoseCases all = car_body_cases(false);
  run_poses(state, all, [&](const PoseCase& one) { return solve_with_tiny_solver(all, one); });
}

BENCHMARK(ceres_analytic)->Unit(benchmark::kMicrosecond);
BENCHMARK(ceres_autodiff)->Unit(benchmark::kMicrosecond);
BENCHMARK(ceres_tiny_solver)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zeropose::bench
