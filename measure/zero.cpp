#include "measure/zero.h"

#include <algorithm>
#include <cmath>

#include "calib/words.h"
#include "measure/compensation.h"

namespace zeropose {
namespace {

// A mark that is found further than this, and further than ten sigma, from its place in the other frames
// either moved or is another one.
constexpr double max_wander_px = 1;

std::vector<Observation> all_of(std::span<const std::vector<Observation>> frames, const View& view) {
  std::vector<Observation> found;
  for (const auto& frame : frames)
    for (const Observation& observation : frame)
      if (observation.camera == view.camera && observation.mark == view.mark) found.push_back(observation);
  return found;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The largest distance from the median; sets `sigma_px` to the largest standard deviation on the way.
double wander_px(const std::vector<Observation>& found, double& sigma_px) {
  std::vector<double> us, vs;
  for (const Observation& observation : found) {
    us.push_back(observation.u_px.x());
    vs.push_back(observation.u_px.y());
  }
  const Eigen::Vector2d middle(median(us), median(vs));
  double largest = 0;
  for (const Observation& observation : found) {
    largest = std::max(largest, (observation.u_px - middle).norm());
    sigma_px = std::max(sigma_px, std::sqrt(observation.covariance_px2.trace()));
  }
  return largest;
}

Observation mean(const std::vector<Observation>& found) {
  Observation mean = found.front();
  mean.u_px.setZero();
  mean.covariance_px2.setZero();
  const double count = static_cast<double>(found.size());
  for (const Observation& observation : found) {
    mean.u_px += observation.u_px / count;
    mean.covariance_px2 += observation.covariance_px2 / (count * count);
  }
  return mean;
}

struct Averaged {
  Code code = Code::internal;
  std::string reason;
  std::vector<Observation> observations;
};

Averaged average_views(const Job& job, std::span<const std::vector<Observation>> frames) {
  Averaged averaged;
  std::string missing;
  for (const View& view : job.views) {
    const auto found = all_of(frames, view);
    if (2 * found.size() <= frames.size()) {
      missing +=
          (missing.empty() ? "" : ", ") + job.marks[view.mark].name + " (" + number(found.size()) + ")";
      continue;
    }
    double sigma_px = 0;
    const double wander = wander_px(found, sigma_px);
    if (!(wander <= std::max(max_wander_px, 10 * sigma_px)))
      return {Code::deviation_not_attributable,
              "mark " + job.marks[view.mark].name + " wandered by " + number(wander) + " px between the " +
                  number(frames.size()) + " frames of the zero measurement",
              {}};
    averaged.observations.push_back(mean(found));
  }
  averaged.code = missing.empty() && !averaged.observations.empty() ? Code::ok : Code::too_few_marks;
  if (averaged.code != Code::ok)
    averaged.reason = "a zero measurement needs every mark in most of its " + number(frames.size()) +
                      " frames, missing are " + (missing.empty() ? "all" : missing);
  return averaged;
}

PoseProblem problem_of(std::span<const CalibratedCamera> cameras, const Job& job,
                       std::span<const Observation> observations, const Pose& X_WO_start) {
  PoseProblem problem;
  problem.cameras = cameras;
  problem.marks = job.marks;
  problem.observations = observations;
  problem.X_WO_start = X_WO_start;
  problem.X_WP_planar = job.X_WP_planar;
  problem.system_sigma_px = job.system_sigma_px;
  problem.reject_wrong_marks = false;
  return problem;
}

// Standard deviation of the frames' own poses round their mean; zero for fewer than two.
Vector6 spread_of(std::span<const CalibratedCamera> cameras, const Job& job,
                  std::span<const std::vector<Observation>> frames, const Pose& X_WO0) {
  std::vector<Pose> singles;
  for (const auto& frame : frames) {
    const PoseResult single = estimate_pose(problem_of(cameras, job, frame, X_WO0));
    if (single.code == Code::ok) singles.push_back(single.X_WO);
  }
  if (singles.size() < 2) return Vector6::Zero();
  const Pose mean_pose = average(singles);
  Vector6 squares = Vector6::Zero();
  for (const Pose& X_WO : singles) squares += difference(mean_pose, X_WO).cwiseAbs2();
  return (squares / static_cast<double>(singles.size() - 1)).cwiseSqrt();
}

bool valid(std::span<const CalibratedCamera> cameras, const Job& job) {
  return std::all_of(job.views.begin(), job.views.end(), [&](const View& view) {
    return view.camera < cameras.size() && view.mark < job.marks.size();
  });
}

void compensate_marks(std::span<const CalibratedCamera> cameras, const Job& job,
                      std::span<const Observation> observations, ZeroResult& result) {
  CompensationProblem problem;
  problem.cameras = cameras;
  problem.marks = job.marks;
  problem.observations = observations;
  problem.X_WO0 = result.pose.X_WO;
  CompensationResult compensation = compensate(problem);
  result.code = compensation.code;
  result.reason = std::move(compensation.reason);
  if (result.code != Code::ok) return;
  const auto& shifts = compensation.shifts_O_mm;
  const auto largest = std::max_element(shifts.begin(), shifts.end(),
                                        [](const auto& a, const auto& b) { return a.norm() < b.norm(); });
  if (largest != shifts.end() && !(largest->norm() <= job.requirements.max_compensation_mm)) {
    result.code = Code::compensation_too_large;
    result.reason = "mark " + job.marks[static_cast<std::size_t>(largest - shifts.begin())].name +
                    " would have to be shifted by " + number(largest->norm()) + " mm, allowed are " +
                    number(job.requirements.max_compensation_mm) + " mm";
    return;
  }
  result.zero = {result.pose.X_WO, std::move(compensation.shifts_O_mm)};
}

}  // namespace

Job compensated(Job job, const Zero& zero) {
  for (std::size_t i = 0; i < job.marks.size(); ++i) job.marks[i].p_O_mm += zero.compensation_O_mm[i];
  return job;
}

ZeroResult make_zero(std::span<const CalibratedCamera> cameras, const Job& job,
                     std::span<const std::vector<Observation>> frames) {
  ZeroResult result;
  if (!valid(cameras, job)) {
    result.code = Code::marks_invalid;
    result.reason = "the job names a camera or a mark that does not exist";
    return result;
  }
  const Averaged averaged = average_views(job, frames);
  result.code = averaged.code;
  result.reason = averaged.reason;
  if (result.code != Code::ok) return result;
  result.pose = estimate_pose(problem_of(cameras, job, averaged.observations, job.X_WO_nominal));
  result.code = result.pose.code;
  result.reason = result.pose.reason;
  if (result.code != Code::ok) return result;
  compensate_marks(cameras, job, averaged.observations, result);
  if (result.code == Code::ok)
    result.spread = spread_of(cameras, compensated(job, result.zero), frames, result.zero.X_WO0);
  return result;
}

}  // namespace zeropose
