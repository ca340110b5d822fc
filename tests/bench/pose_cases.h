// Problems that the pose benchmarks share, and what is reported of the poses found.
#pragma once

#include <benchmark/benchmark.h>

#include <vector>

#include "measure/pose.h"
#include "tests/support/cell_scene.h"

namespace zeropose::bench {

inline constexpr double pose_sigma_px = 0.1;
inline constexpr std::size_t pose_case_count = 256;

struct PoseCase {
  std::vector<Mark> marks;
  std::vector<Observation> observations;
  Pose X_WO = Pose::Identity(), X_WO_start = Pose::Identity();
  std::vector<std::size_t> wrong;  // observations, ascending
};

struct PoseCases {
  std::vector<CalibratedCamera> cameras;
  std::vector<PoseCase> cases;
};

// 12 marks of the car body in 4 cameras, 3 each, equal weights, moved by up to 30 mm and 0.2 degrees from the
// start; points unless `discs`.
PoseCases car_body_cases(bool discs, std::size_t count = pose_case_count);

// The same points with wrong ones: `wrong` of the 12, each 3..80 px off in its own direction, or (0) the
// three of one camera moved together by that much.
PoseCases wrong_cases(int wrong, std::size_t count);

// Marks in a cube of 500 mm, 3 m before one camera (f 4200 px, no distortion), any turn; the start is up to
// 30 mm and 3 degrees away.
PoseCases mono_cases(std::size_t marks, std::size_t count = pose_case_count);

// Marks in a cube of 1000 mm in the middle of a ring of cameras, 3 m away, seen by one camera each in turn.
PoseCases ring_cases(std::size_t marks, std::size_t cameras, std::size_t count);

PoseProblem problem_of(const PoseCases& all, const PoseCase& one);

// Sum of squared deviations over their variance, points.
double cost_of(const PoseCases& all, const PoseCase& one, const Pose& X_WO);

// Counters: error_per_crb, root mean square error over the Cramer-Rao bound, of the poses near the truth;
// cost_excess, the largest relative excess of the final cost over that of estimate_pose(), of the same;
// failed_share, farther from the truth than 50 bounds.
void report_poses(benchmark::State& state, const PoseCases& all, const std::vector<Pose>& poses);

// Runs `solve(case) -> Pose` round the cases and reports.
template <typename Solve>
void run_poses(benchmark::State& state, const PoseCases& all, Solve solve) {
  std::vector<Pose> poses(all.cases.size(), Pose::Identity());
  std::size_t i = 0;
  for (auto _ : state) {
    poses[i] = solve(all.cases[i]);
    benchmark::DoNotOptimize(poses[i]);
    i = (i + 1) % all.cases.size();
  }
  for (std::size_t k = 0; k < poses.size(); ++k) poses[k] = solve(all.cases[k]);
  report_poses(state, all, poses);
}

}  // namespace zeropose::bench
