// estimate_pose(): the car body's 12 marks in 4 cameras, one camera, growing problems (0.1 px noise). The
// time is that of the whole call: checks of the input, estimate, covariances, deviations and the result's
// memory; "checked" also looks for wrong marks. Peers on the same problems: pose_ceres_bench.cpp,
// pose_mono_bench.cpp, pose_opengv_bench.cpp. Counters: pose_cases.h.
#include "tests/bench/pose_cases.h"

namespace zeropose::bench {
namespace {

void estimate(benchmark::State& state, const PoseCases& all, bool reject, bool start = true) {
  run_poses(state, all, [&](const PoseCase& one) {
    PoseProblem problem = problem_of(all, one);
    problem.reject_wrong_marks = reject;
    if (!start) problem.X_WO_start.reset();
    return estimate_pose(problem).X_WO;
  });
}

void zeropose_points(benchmark::State& state) { estimate(state, car_body_cases(false), false); }
void zeropose_points_checked(benchmark::State& state) { estimate(state, car_body_cases(false), true); }
void zeropose_discs_checked(benchmark::State& state) { estimate(state, car_body_cases(true), true); }
void zeropose_no_start(benchmark::State& state) { estimate(state, car_body_cases(false), true, false); }

void zeropose_mono(benchmark::State& state) {
  estimate(state, mono_cases(static_cast<std::size_t>(state.range(0))), false);
}
void zeropose_mono_no_start(benchmark::State& state) {
  estimate(state, mono_cases(static_cast<std::size_t>(state.range(0))), false, false);
}

// Marks in four cameras; marks twelve in each of several cameras.
void zeropose_marks(benchmark::State& state) {
  estimate(state, ring_cases(static_cast<std::size_t>(state.range(0)), 4, 16), true);
  state.SetComplexityN(state.range(0));
}
void zeropose_cameras(benchmark::State& state) {
  const auto cameras = static_cast<std::size_t>(state.range(0));
  estimate(state, ring_cases(12 * cameras, cameras, 16), true);
  state.SetComplexityN(state.range(0));
}

BENCHMARK(zeropose_points)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_points_checked)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_discs_checked)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_no_start)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_mono)->Arg(12)->Arg(6)->Arg(4)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_mono_no_start)->Arg(12)->Arg(6)->Arg(4)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_marks)
    ->Arg(6)
    ->Arg(12)
    ->Arg(48)
    ->Arg(192)
    ->Arg(768)
    ->Arg(3000)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_cameras)
    ->RangeMultiplier(4)
    ->Range(1, 64)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zeropose::bench
