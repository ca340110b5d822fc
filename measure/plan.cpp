#include "measure/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "calib/pose_only.h"
#include "calib/symmetric_eigen.h"
#include "measure/mark_image.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double infinite = std::numeric_limits<double>::infinity();

// A mark in a camera's image with the object in its nominal pose.
struct Sighting {
  bool in_front = false;
  Vector2d u_px = Vector2d::Zero();  // what would be found
  double depth_mm = 0, focal_px = 0;
};

Sighting look(const PlanProblem& problem, const View& view) {
  const CalibratedCamera& camera = problem.cameras[view.camera];
  const Mark& mark = problem.job.marks[view.mark];
  const Pose X_CO = camera.X_WC.inverse() * problem.job.X_WO_nominal;
  const Vector3d p_CQ = X_CO * mark.p_O_mm;
  const auto u_px = project(camera.model, p_CQ);
  if (!u_px) return {};
  const Vector2d offset = image_offset(camera.model, mark, p_CQ, X_CO.linear() * mark.normal_O, 1);
  return {true, *u_px + offset, p_CQ.z(), std::max(camera.model.fx_px, camera.model.fy_px)};
}

double border_px(const CameraModel& camera, const Vector2d& u_px) {
  return std::min(
      {u_px.x() + 0.5, u_px.y() + 0.5, camera.width_px - 0.5 - u_px.x(), camera.height_px - 0.5 - u_px.y()});
}

PlannedView planned_view(const PlanProblem& problem, const View& view) {
  PlannedView planned;
  planned.view = view;
  planned.border_px = planned.border_mm = -infinite;
  const Sighting sighting = look(problem, view);
  if (!sighting.in_front) return planned;
  const CameraModel& camera = problem.cameras[view.camera].model;
  const double px_per_mm = sighting.focal_px / sighting.depth_mm;
  planned.diameter_px = 2 * problem.job.marks[view.mark].radius_mm * px_per_mm;
  planned.border_px = border_px(camera, sighting.u_px) - planned.diameter_px / 2;
  planned.border_mm = planned.border_px / px_per_mm;
  planned.seen = planned.border_px >= 0;
  return planned;
}

// What the job's cameras but one would find.
std::vector<Observation> expected_observations(const PlanProblem& problem, std::span<const PlannedView> views,
                                               std::size_t lost) {
  std::vector<Observation> observations;
  for (const PlannedView& planned : views)
    if (planned.seen && planned.view.camera != lost)
      observations.push_back({planned.view.camera, planned.view.mark, look(problem, planned.view).u_px,
                              problem.sigma_px * problem.sigma_px * Eigen::Matrix2d::Identity()});
  return observations;
}

struct Prediction {
  std::vector<Observation> observations;
  PoseResult pose;
  Reliability reliability;
  Verdict verdict;
  double sigma_mm = infinite, hidden_mm = infinite;
};

Verdict first_fault(const PlanProblem& problem, const PoseProblem& estimate, const Prediction& prediction) {
  std::vector<View> used;
  for (const Observation& observation : prediction.observations)
    used.push_back({observation.camera, observation.mark});
  const Verdict verdicts[] = {check_marks(problem.job, problem.cameras, used),
                              {prediction.pose.code, prediction.pose.reason},
                              check_power(problem.job, estimate, prediction.reliability),
                              check_sigma(problem.job, prediction.pose)};
  const auto* const fault = std::find_if(std::begin(verdicts), std::end(verdicts),
                                         [](const Verdict& verdict) { return verdict.code != Code::ok; });
  return fault == std::end(verdicts) ? verdicts[0] : *fault;
}

constexpr std::size_t none_lost = std::numeric_limits<std::size_t>::max();

Prediction predict(const PlanProblem& problem, std::span<const PlannedView> views, std::size_t lost) {
  Prediction prediction;
  prediction.observations = expected_observations(problem, views, lost);
  PoseProblem estimate;
  estimate.cameras = problem.cameras;
  estimate.marks = problem.job.marks;
  estimate.observations = prediction.observations;
  estimate.X_WO_start = problem.job.X_WO_nominal;
  estimate.X_WP_planar = problem.job.X_WP_planar;
  estimate.system_sigma_px = problem.job.system_sigma_px;
  estimate.reject_wrong_marks = false;
  prediction.pose = estimate_pose(estimate);
  prediction.reliability = reliability_of(problem.job, estimate, prediction.pose);
  prediction.verdict = first_fault(problem, estimate, prediction);
  if (prediction.pose.code != Code::ok) return prediction;
  prediction.sigma_mm = worst_sigma_mm(problem.job, prediction.pose);
  prediction.hidden_mm = prediction.reliability.hidden_mm;
  return prediction;
}

std::vector<PlannedPoint> planned_points(const Job& job, const PoseResult& pose) {
  std::vector<PlannedPoint> points;
  for (const ApplicationPoint& point : points_that_count(job))
    points.push_back({point.name, sigma_at_mm(pose, point.p_O_mm),
                      covariance_at_mm2(pose, point.p_O_mm).diagonal().cwiseSqrt()});
  return points;
}

// The principal directions of the covariance about the middle of the marks, with rotations in mm at the
// marks' extent.
std::vector<PlannedDirection> planned_directions(const PlanProblem& problem, const Prediction& prediction) {
  const Job& job = problem.job;
  const double count = static_cast<double>(prediction.observations.size());
  Vector3d middle_O = Vector3d::Zero();
  double squares = 0;
  for (const Observation& observation : prediction.observations)
    middle_O += job.marks[observation.mark].p_O_mm / count;
  for (const Observation& observation : prediction.observations)
    squares += (job.marks[observation.mark].p_O_mm - middle_O).squaredNorm() / count;
  Matrix6 about_middle = Matrix6::Identity();
  about_middle.topRightCorner<3, 3>() = -cross_matrix(prediction.pose.X_WO.linear() * middle_O);
  Vector6 scale = Vector6::Ones();
  scale.tail<3>().setConstant(std::sqrt(squares));
  const Matrix6 scaled = scale.asDiagonal() * about_middle;
  const SymmetricEigen eigen =
      symmetric_eigen(scaled * prediction.pose.total_covariance * scaled.transpose());
  std::vector<PlannedDirection> directions;
  const int free = job.X_WP_planar ? 3 : 6;
  for (int i = 0; i < free; ++i) {
    const double sigma_mm = std::sqrt(std::max(0.0, eigen.values(5 - i)));
    const Vector6 motion = (sigma_mm * eigen.vectors.col(5 - i)).cwiseQuotient(scale);
    directions.push_back({sigma_mm, motion.head<3>(), degrees_per_radian * motion.tail<3>()});
  }
  return directions;
}

double covered_share(const PlanProblem& problem, std::span<const PlannedView> views, std::size_t camera) {
  Eigen::Array2d low = Eigen::Array2d::Constant(infinite), high = -low;
  for (const PlannedView& planned : views) {
    if (!planned.seen || planned.view.camera != camera) continue;
    const Eigen::Array2d u_px = look(problem, planned.view).u_px.array();
    low = low.min(u_px - planned.diameter_px / 2);
    high = high.max(u_px + planned.diameter_px / 2);
  }
  if (!(high > low).all()) return 0;
  const CameraModel& model = problem.cameras[camera].model;
  const Eigen::Array2d size(model.width_px, model.height_px);
  return ((high.min(size - 0.5) - low.max(-0.5)) / size).prod();
}

PlannedRecovery planned_recovery(const PlanProblem& problem, std::size_t index) {
  const CalibratedCamera& camera = problem.cameras[index];
  std::vector<CalibrationPoint> points;
  for (const View& view : problem.references->views) {
    const ReferencePoint& reference = problem.references->points[view.mark];
    if (view.camera != index || reference.taught_px) continue;
    const auto u_px = project(camera.model, camera.X_WC.inverse() * reference.mark.p_O_mm);
    if (u_px && in_image(camera.model, *u_px)) points.push_back({reference.mark.p_O_mm, *u_px});
  }
  PoseOnlyProblem pose;
  pose.model = camera.model;
  pose.points = points;
  pose.X_WC_near = camera.X_WC;
  pose.sigma_px = problem.sigma_px;
  const PoseOnlyResult result = calibrate_pose(pose);
  PlannedRecovery recovery{static_cast<int>(points.size()), result.reason, infinite, infinite};
  if (result.status != PoseOnlyStatus::ok) return recovery;
  recovery.sigma_mm = std::sqrt(result.covariance.topLeftCorner<3, 3>().trace());
  recovery.sigma_deg = degrees_per_radian * std::sqrt(result.covariance.bottomRightCorner<3, 3>().trace());
  return recovery;
}

PlannedCamera planned_camera(const PlanProblem& problem, std::span<const PlannedView> views,
                             std::size_t camera) {
  PlannedCamera planned;
  planned.camera = camera;
  planned.marks =
      static_cast<int>(std::count_if(views.begin(), views.end(), [camera](const PlannedView& view) {
        return view.seen && view.view.camera == camera;
      }));
  planned.covered_share = covered_share(problem, views, camera);
  const Prediction without = predict(problem, views, camera);
  planned.loss = {without.verdict, without.sigma_mm, without.hidden_mm};
  if (problem.references != nullptr) planned.recovery = planned_recovery(problem, camera);
  return planned;
}

void add_reliability(const PlanProblem& problem, const Prediction& prediction,
                     std::vector<PlannedView>& views) {
  std::size_t next = 0;
  for (PlannedView& planned : views) {
    if (!planned.seen) continue;
    const std::size_t index = next++;
    for (const ObservationReliability& one : prediction.reliability.observations) {
      if (one.observation != index) continue;
      const Sighting sighting = look(problem, planned.view);
      planned.reliability = one;
      planned.detectable_mm = one.detectable_px / sighting.focal_px * sighting.depth_mm;
    }
  }
}

}  // namespace

Plan plan(const PlanProblem& problem) {
  Plan plan;
  std::set<std::size_t> cameras;
  for (const View& view : problem.job.views) {
    plan.views.push_back(planned_view(problem, view));
    cameras.insert(view.camera);
  }
  for (const std::size_t camera : cameras)
    plan.cameras.push_back(planned_camera(problem, plan.views, camera));
  const Prediction prediction = predict(problem, plan.views, none_lost);
  plan.verdict = prediction.verdict;
  plan.sigma_mm = prediction.sigma_mm;
  plan.hidden_mm = prediction.hidden_mm;
  if (prediction.pose.code != Code::ok) return plan;
  plan.sigma = prediction.pose.total_covariance.diagonal().cwiseSqrt();
  plan.points = planned_points(problem.job, prediction.pose);
  plan.directions = planned_directions(problem, prediction);
  add_reliability(problem, prediction, plan.views);
  return plan;
}

}  // namespace zeropose
