// The pose from one camera by OpenCV, the same problems as zeropose_mono in pose_bench.cpp: ITERATIVE from
// the same start; SQPNP and EPNP need none. RANSAC: 3 of 12 marks wrong by 3..80 px.
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "tests/bench/pose_cases.h"

namespace zeropose::bench {
namespace {

const cv::Matx33d camera_matrix(4200, 0, 1223.5, 0, 4200, 1023.5, 0, 0, 1);

struct Correspondences {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
};

Correspondences correspondences_of(const PoseCase& one) {
  Correspondences all;
  for (const Observation& observation : one.observations) {
    const Eigen::Vector3d& p = one.marks[observation.mark].p_O_mm;
    all.points.emplace_back(p.x(), p.y(), p.z());
    all.pixels.emplace_back(observation.u_px.x(), observation.u_px.y());
  }
  return all;
}

Pose pose_of(const cv::Vec3d& turn, const cv::Vec3d& shift) {
  Pose X_CO = Pose::Identity();
  X_CO.linear() = exp_so3({turn[0], turn[1], turn[2]});
  X_CO.translation() = Eigen::Vector3d(shift[0], shift[1], shift[2]);
  return X_CO;
}

Pose solve(const PoseCase& one, int method) {
  const Correspondences all = correspondences_of(one);
  const Eigen::Vector3d phi = log_so3(one.X_WO_start.linear()), p = one.X_WO_start.translation();
  cv::Vec3d turn(phi.x(), phi.y(), phi.z()), shift(p.x(), p.y(), p.z());
  try {
    if (!cv::solvePnP(all.points, all.pixels, camera_matrix, cv::noArray(), turn, shift,
                      method == cv::SOLVEPNP_ITERATIVE, method))
      return Pose::Identity();
  } catch (const cv::Exception&) {
    return Pose::Identity();
  }
  return pose_of(turn, shift);
}

void opencv_mono(benchmark::State& state, int method) {
  cv::setNumThreads(1);
  const PoseCases all = mono_cases(static_cast<std::size_t>(state.range(0)));
  run_poses(state, all, [&](const PoseCase& one) { return solve(one, method); });
}

void opencv_iterative(benchmark::State& state) { opencv_mono(state, cv::SOLVEPNP_ITERATIVE); }
void opencv_sqpnp(benchmark::State& state) { opencv_mono(state, cv::SOLVEPNP_SQPNP); }
void opencv_epnp(benchmark::State& state) { opencv_mono(state, cv::SOLVEPNP_EPNP); }

PoseCases mono_wrong_cases() {
  PoseCases all = mono_cases(12);
  test::Random random(5);
  for (PoseCase& one : all.cases)
    for (std::size_t i = 0; i < 3; ++i) {
      const double angle = test::uniform(random, 0, 6.283185307), size_px = test::uniform(random, 3, 80);
      one.observations[4 * i].u_px += size_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      one.wrong.push_back(4 * i);
    }
  return all;
}

// Are exactly the wrong ones out?
bool is_right(const PoseCase& one, const std::vector<std::size_t>& out) { return out == one.wrong; }

template <typename Outliers>
void run_mono_wrong(benchmark::State& state, const PoseCases& all, Outliers outliers) {
  std::size_t i = 0, right = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(outliers(all.cases[i]));
    i = (i + 1) % all.cases.size();
  }
  for (const PoseCase& one : all.cases) right += is_right(one, outliers(one));
  state.counters["right_share"] = static_cast<double>(right) / static_cast<double>(all.cases.size());
}

void opencv_ransac_3_wrong(benchmark::State& state) {
  cv::setNumThreads(1);
  const PoseCases all = mono_wrong_cases();
  run_mono_wrong(state, all, [](const PoseCase& one) {
    const Correspondences seen = correspondences_of(one);
    cv::Vec3d turn, shift;
    std::vector<int> inliers;
    cv::solvePnPRansac(seen.points, seen.pixels, camera_matrix, cv::noArray(), turn, shift, false, 1000, 1.0F,
                       0.9999, inliers);
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < one.observations.size(); ++k)
      if (std::find(inliers.begin(), inliers.end(), static_cast<int>(k)) == inliers.end()) out.push_back(k);
    return out;
  });
}

void zeropose_mono_3_wrong(benchmark::State& state) {
  const PoseCases all = mono_wrong_cases();
  run_mono_wrong(state, all, [&all](const PoseCase& one) {
    PoseProblem problem = problem_of(all, one);
    problem.reject_wrong_marks = true;
    std::vector<std::size_t> out = estimate_pose(problem).removed;
    std::sort(out.begin(), out.end());
    return out;
  });
}

BENCHMARK(opencv_iterative)->Arg(12)->Arg(6)->Arg(4)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_sqpnp)->Arg(12)->Arg(6)->Arg(4)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_epnp)->Arg(12)->Arg(6)->Arg(4)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencv_ransac_3_wrong)->Unit(benchmark::kMicrosecond);
BENCHMARK(zeropose_mono_3_wrong)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zeropose::bench
