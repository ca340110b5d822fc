#include "tests/bench/pose_cases.h"

#include <algorithm>
#include <cmath>

namespace zeropose::bench {
namespace {

using test::Random;

constexpr double two_pi = 6.283185307179586;

Eigen::Vector2d any_shift_px(Random& random) {
  const double angle = test::uniform(random, 0, two_pi);
  return test::uniform(random, 3, 80) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

void spoil(PoseCase& one, int wrong, Random& random) {
  std::vector<std::size_t> order(one.observations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  if (wrong > 0) {
    one.wrong.assign(order.begin(), order.begin() + wrong);
    for (const std::size_t i : one.wrong) one.observations[i].u_px += any_shift_px(random);
  } else {
    const std::size_t camera = one.observations[order[0]].camera;
    const Eigen::Vector2d shift_px = any_shift_px(random);
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (one.observations[i].camera != camera) continue;
      one.wrong.push_back(i);
      one.observations[i].u_px += shift_px;
    }
  }
  std::sort(one.wrong.begin(), one.wrong.end());
}

CalibratedCamera pinhole(const Pose& X_WC) {
  CalibratedCamera camera;
  camera.model = {2448, 2048, 4200, 4200, 1223.5, 1023.5, Division{}};
  camera.X_WC = X_WC;
  return camera;
}

Job job_of_random_marks(std::size_t marks, std::size_t cameras, double half_width_mm, Random& random) {
  Job job;
  for (std::size_t i = 0; i < marks; ++i) {
    Mark mark;
    mark.p_O_mm = test::uniform_vector(random, half_width_mm);
    job.marks.push_back(mark);
    job.views.push_back({i % cameras, i});
  }
  return job;
}

Pose moved_by(const Pose& X_WO, double mm, double deg, Random& random) {
  Vector6 delta;
  delta << test::uniform_vector(random, mm), test::uniform_vector(random, deg / degrees_per_radian);
  return moved(X_WO, delta);
}

}  // namespace

PoseCases car_body_cases(bool discs, std::size_t count) {
  test::CellScene scene = discs ? test::car_body() : test::car_body_points();
  for (Mark& mark : scene.job.marks) {
    mark.weight = 1;
    mark.tolerance_px = no_tolerance;
  }
  PoseCases all{scene.cameras, {}};
  Random random(1);
  for (std::size_t i = 0; i < count; ++i) {
    PoseCase& one = all.cases.emplace_back();
    one.marks = scene.job.marks;
    one.X_WO = test::random_shift(random, 30, 0.2);
    one.observations = test::observe(scene.cameras, scene.job, one.X_WO, pose_sigma_px, random);
  }
  return all;
}

PoseCases wrong_cases(int wrong, std::size_t count) {
  PoseCases all = car_body_cases(false, count);
  Random random(2);
  for (PoseCase& one : all.cases) spoil(one, wrong, random);
  return all;
}

PoseCases mono_cases(std::size_t marks, std::size_t count) {
  PoseCases all{{pinhole(Pose::Identity())}, {}};
  Random random(3);
  for (std::size_t i = 0; i < count; ++i) {
    PoseCase& one = all.cases.emplace_back();
    const Job job = job_of_random_marks(marks, 1, 250, random);
    one.marks = job.marks;
    one.X_WO.translation() = Eigen::Vector3d(0, 0, 3000) + test::uniform_vector(random, 100);
    one.X_WO.linear() = test::uniform_rotation(random);
    one.X_WO_start = moved_by(one.X_WO, 30, 3, random);
    one.observations = test::observe(all.cameras, job, one.X_WO, pose_sigma_px, random);
  }
  return all;
}

PoseCases ring_cases(std::size_t marks, std::size_t cameras, std::size_t count) {
  PoseCases all;
  for (std::size_t i = 0; i < cameras; ++i) {
    const double angle = two_pi * static_cast<double>(i) / static_cast<double>(cameras);
    Pose X_WC = Pose::Identity();
    X_WC.linear().col(2) = Eigen::Vector3d(-std::cos(angle), -std::sin(angle), 0);
    X_WC.linear().col(1) = Eigen::Vector3d(0, 0, -1);
    X_WC.linear().col(0) = X_WC.linear().col(1).cross(X_WC.linear().col(2));
    X_WC.translation() = -3000 * X_WC.linear().col(2);
    all.cameras.push_back(pinhole(X_WC));
  }
  Random random(4);
  for (std::size_t i = 0; i < count; ++i) {
    PoseCase& one = all.cases.emplace_back();
    const Job job = job_of_random_marks(marks, cameras, 500, random);
    one.marks = job.marks;
    one.X_WO = moved_by(Pose::Identity(), 30, 0.2, random);
    one.observations = test::observe(all.cameras, job, one.X_WO, pose_sigma_px, random);
  }
  return all;
}

PoseProblem problem_of(const PoseCases& all, const PoseCase& one) {
  PoseProblem problem;
  problem.cameras = all.cameras;
  problem.marks = one.marks;
  problem.observations = one.observations;
  problem.X_WO_start = one.X_WO_start;
  problem.reject_wrong_marks = false;
  return problem;
}

double cost_of(const PoseCases& all, const PoseCase& one, const Pose& X_WO) {
  double sum = 0;
  for (const Observation& observation : one.observations) {
    const CalibratedCamera& camera = all.cameras[observation.camera];
    const auto u = project(camera.model, camera.X_WC.inverse() * X_WO * one.marks[observation.mark].p_O_mm);
    sum += u ? (observation.u_px - *u).squaredNorm() / (pose_sigma_px * pose_sigma_px) : 1e30;
  }
  return sum;
}

void report_poses(benchmark::State& state, const PoseCases& all, const std::vector<Pose>& poses) {
  double squares = 0, excess = 0, near = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const PoseCase& one = all.cases[i];
    PoseProblem problem = problem_of(all, one);
    problem.X_WO_start = one.X_WO;
    const PoseResult reference = estimate_pose(problem);
    const Vector6 error = difference(one.X_WO, poses[i]);
    const double square = error.dot(reference.covariance.ldlt().solve(error)) / 6;
    if (!(square < 50 * 50)) continue;
    ++near;
    squares += square;
    const double cost = cost_of(all, one, reference.X_WO);
    excess = std::max(excess, (cost_of(all, one, poses[i]) - cost) / std::max(1.0, cost));
  }
  state.counters["error_per_crb"] = std::sqrt(squares / near);
  state.counters["cost_excess"] = excess;
  state.counters["failed_share"] = 1 - near / static_cast<double>(poses.size());
}

}  // namespace zeropose::bench
