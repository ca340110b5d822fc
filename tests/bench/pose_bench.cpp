// Pose of the car body from 12 marks in 4 cameras (0.1 px noise) against Ceres, same problems, same starts.
// Counters: error_per_crb = root mean square error over the Cramer-Rao bound; cost_excess = largest relative
// excess of the final cost over the smaller one of ours and a converged reference.
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <cmath>

#include "measure/pose.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

constexpr double sigma_px = 0.1;
constexpr std::size_t problem_count = 256;

struct Case {
  std::vector<Observation> observations;
  Pose X_WO = Pose::Identity(), X_WO_start = Pose::Identity();
};

struct Cases {
  test::CellScene scene;
  std::vector<Case> cases;
  std::vector<double> reference_costs;
};

double cost_of(const test::CellScene& scene, const Case& one, const Pose& X_WO) {
  double sum = 0;
  for (const Observation& observation : one.observations) {
    const CalibratedCamera& camera = scene.cameras[observation.camera];
    const auto u =
        project(camera.model, camera.X_WC.inverse() * X_WO * scene.job.marks[observation.mark].p_O_mm);
    sum += u ? (observation.u_px - *u).squaredNorm() / (sigma_px * sigma_px) : 1e30;
  }
  return sum;
}

PoseProblem problem_of(const test::CellScene& scene, const Case& one) {
  PoseProblem problem = test::problem_of(scene.cameras, scene.job, one.observations, one.X_WO_start);
  problem.system_sigma_px = 0;
  problem.reject_wrong_marks = false;
  return problem;
}

// Equal weights, so that the estimate can reach the bound; points when `discs` is false, as the peers model.
Cases make_cases(bool discs) {
  Cases all{test::car_body(), {}, {}};
  for (Mark& mark : all.scene.job.marks) {
    mark.weight = 1;
    mark.tolerance_px = no_tolerance;
    if (!discs) mark.radius_mm = 0;
  }
  test::Random random(1);
  for (std::size_t i = 0; i < problem_count; ++i) {
    Case& one = all.cases.emplace_back();
    one.X_WO = test::random_shift(random, 30, 0.2);
    one.observations = test::observe(all.scene.cameras, all.scene.job, one.X_WO, sigma_px, random);
    const Pose X_WO = estimate_pose(problem_of(all.scene, one)).X_WO;
    all.reference_costs.push_back(cost_of(all.scene, one, X_WO));
  }
  return all;
}

void report(benchmark::State& state, const Cases& all, const std::vector<Pose>& poses, bool discs) {
  double squares = 0, excess = 0;
  for (std::size_t i = 0; i < problem_count; ++i) {
    const PoseResult reference = estimate_pose(problem_of(all.scene, all.cases[i]));
    const Vector6 error = difference(all.cases[i].X_WO, poses[i]);
    squares += error.dot(reference.covariance.ldlt().solve(error)) / 6;
    const double cost = cost_of(all.scene, all.cases[i], poses[i]);
    excess = std::max(excess, cost / all.reference_costs[i] - 1);
  }
  state.counters["error_per_crb"] = std::sqrt(squares / problem_count);
  if (!discs) state.counters["cost_excess"] = excess;
}

void estimate(benchmark::State& state, bool discs, bool reject) {
  const Cases all = make_cases(discs);
  std::vector<Pose> poses(problem_count);
  std::size_t i = 0;
  for (auto _ : state) {
    PoseProblem problem = problem_of(all.scene, all.cases[i]);
    problem.reject_wrong_marks = reject;
    const PoseResult result = estimate_pose(problem);
    benchmark::DoNotOptimize(result.X_WO);
    poses[i] = result.X_WO;
    i = (i + 1) % problem_count;
  }
  report(state, all, poses, discs);
}

void zeropose_points(benchmark::State& state) { estimate(state, false, false); }
void zeropose_points_checked(benchmark::State& state) { estimate(state, false, true); }
void zeropose_discs_checked(benchmark::State& state) { estimate(state, true, true); }

// One of the twelve 20 px off: found, proved to be the only explanation, removed.
void zeropose_discs_one_wrong(benchmark::State& state) {
  Cases all = make_cases(true);
  for (std::size_t i = 0; i < problem_count; ++i) all.cases[i].observations[i % 12].u_px.x() += 20;
  std::size_t i = 0, found = 0, count = 0;
  for (auto _ : state) {
    PoseProblem problem = problem_of(all.scene, all.cases[i]);
    problem.reject_wrong_marks = true;
    const PoseResult result = estimate_pose(problem);
    found += result.removed.size() == 1 && result.removed[0] == i % 12;
    ++count;
    i = (i + 1) % problem_count;
  }
  state.counters["found_share"] = static_cast<double>(found) / static_cast<double>(count);
}

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
    residual[0] = (T(u.x()) - (T(camera->model.fx_px) * factor * xn + T(camera->model.cx_px))) / T(sigma_px);
    residual[1] = (T(u.y()) - (T(camera->model.fy_px) * factor * yn + T(camera->model.cy_px))) / T(sigma_px);
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
    r = (u_ - projection->u_px) / sigma_px;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[0]);
    const Eigen::Matrix<double, 2, 3> A = projection->du_dp * R_CW_ / sigma_px;
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

Pose solve_with_ceres(const test::CellScene& scene, const Case& one, bool analytic) {
  Vector6 start;
  start << one.X_WO_start.translation(), log_so3(one.X_WO_start.linear());
  double* x = start.data();
  ceres::Problem problem;
  for (const Observation& observation : one.observations) {
    const CalibratedCamera& camera = scene.cameras[observation.camera];
    const Eigen::Vector3d p_OQ = scene.job.marks[observation.mark].p_O_mm;
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

void ceres_dense_qr(benchmark::State& state, bool analytic) {
  const Cases all = make_cases(false);
  std::vector<Pose> poses(problem_count);
  std::size_t i = 0;
  for (auto _ : state) {
    poses[i] = solve_with_ceres(all.scene, all.cases[i], analytic);
    i = (i + 1) % problem_count;
  }
  report(state, all, poses, false);
}

void ceres_analytic(benchmark::State& state) { ceres_dense_qr(state, true); }
void ceres_autodiff(benchmark::State& state) { ceres_dense_qr(state, false); }

BENCHMARK(zeropose_points)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_points_checked)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_discs_checked)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_discs_one_wrong)->Unit(benchmark::kMicrosecond);
BENCHMARK(ceres_analytic)->Unit(benchmark::kMicrosecond);
BENCHMARK(ceres_autodiff)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zeropose
