// Refinement of one view, all 11 parameters, against Ceres with automatic derivatives: same points, same
// start.
#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <cmath>
#include <random>

#include "calib/linear_methods.h"
#include "calib/refine.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

struct View {
  std::vector<CalibrationPoint> points;
  CameraModel start;
  Pose X_WC;
};

// Points at random in a body of 300 x 220 x 150 mm; the start is that of the linear method at the image
// centre.
View view_of(std::int64_t count) {
  const CameraModel camera = test::division_camera(-0.2);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<Eigen::Vector3d> body;
  for (std::int64_t i = 0; i < count; ++i)
    body.emplace_back(150 * place(random), 110 * place(random), 75 * place(random));
  View view;
  view.points = test::photograph(camera, test::looking_at_origin(900, 30, 20), body, 0.1, random);
  LinearProblem linear;
  linear.points = view.points;
  linear.origin_px = {383.5, 285.5};
  const LinearResult first = calibrate_noncoplanar(linear);
  view.start = first.model;
  view.X_WC = first.X_WC;
  return view;
}

void report(benchmark::State& state, double cost, int iterations) {
  state.counters["rms_px"] = std::sqrt(cost / static_cast<double>(state.range(0)));
  state.counters["cost"] = cost;
  state.counters["iterations"] = iterations;
  state.SetComplexityN(state.range(0));
}

void zeropose_refine(benchmark::State& state) {
  const View view = view_of(state.range(0));
  RefineProblem problem;
  problem.points = view.points;
  problem.start = view.start;
  problem.X_WC_start = view.X_WC;
  RefineResult result;
  for (auto _ : state) result = refine(problem);
  report(state, result.cost, result.iterations);
}

struct Residuals {
  Eigen::Vector3d p_W;
  Eigen::Vector2d u;

  template <typename T>
  bool operator()(const T* internals, const T* pose, T* residual) const {
    const T p[3] = {T(p_W.x()), T(p_W.y()), T(p_W.z())};
    T c[3];
    ceres::AngleAxisRotatePoint(pose, p, c);
    const T z = c[2] + pose[5], x = (c[0] + pose[3]) / z, y = (c[1] + pose[4]) / z;
    const T factor = T(2) / (T(1) + sqrt(T(1) - T(4) * internals[4] * (x * x + y * y)));
    residual[0] = T(u.x()) - (internals[0] * factor * x + internals[2]);
    residual[1] = T(u.y()) - (internals[1] * factor * y + internals[3]);
    return true;
  }
};

void ceres_autodiff(benchmark::State& state) {
  const View view = view_of(state.range(0));
  ceres::Solver::Summary summary;
  for (auto _ : state) {
    double internals[5] = {view.start.fx_px, view.start.fy_px, view.start.cx_px, view.start.cy_px,
                           std::get<Division>(view.start.distortion).K};
    const Pose X_CW = view.X_WC.inverse();
    const Eigen::Vector3d turn = log_so3(X_CW.linear()), t = X_CW.translation();
    double pose[6] = {turn.x(), turn.y(), turn.z(), t.x(), t.y(), t.z()};
    ceres::Problem problem;
    for (const CalibrationPoint& point : view.points)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Residuals, 2, 5, 6>(new Residuals{point.p_W_mm, point.u_px}),
          nullptr, internals, pose);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 1e-12;
    ceres::Solve(options, &problem, &summary);
  }
  report(state, 2 * summary.final_cost, static_cast<int>(summary.iterations.size()));
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->Unit(benchmark::kMicrosecond);
  for (const std::int64_t count : {40, 363, 4000, 40000}) bench->Arg(count);
}

BENCHMARK(zeropose_refine)->Apply(sizes)->Complexity(benchmark::oN);
BENCHMARK(ceres_autodiff)->Apply(sizes);

}  // namespace
}  // namespace zeropose
