#include "measure/security.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

constexpr double max_white_share = 0.5;    // of the pixels
constexpr double min_bright_share = 0.01;  // of the pixels, above black
// What arithmetic leaves of a value that is its limit, mm and deg: far below the last digit of the wire.
constexpr double rounding = 1e-9;

Verdict good() { return {Code::ok, {}}; }

struct Counts {
  int marks = 0, cameras = 0;
  std::vector<int> in_camera;
};

Counts count_of(const Job& job, std::size_t cameras, std::span<const View> used) {
  std::vector<bool> seen(job.marks.size());
  Counts counts;
  counts.in_camera.assign(cameras, 0);
  for (const View& view : used) {
    if (!(job.marks[view.mark].weight > 0)) continue;
    counts.marks += !seen[view.mark];
    seen[view.mark] = true;
    counts.cameras += counts.in_camera[view.camera]++ == 0;
  }
  return counts;
}

bool same(const View& a, const View& b) { return a.camera == b.camera && a.mark == b.mark; }

std::string missing_of(const Job& job, std::span<const CalibratedCamera> cameras,
                       std::span<const View> used) {
  std::string names;
  for (const View& view : job.views) {
    if (!(job.marks[view.mark].weight > 0)) continue;
    if (std::any_of(used.begin(), used.end(), [&view](const View& other) { return same(view, other); }))
      continue;
    names += (names.empty() ? "" : ", ") + job.marks[view.mark].name + " in " + cameras[view.camera].name;
  }
  return names.empty() ? "none is missing" : "missing: " + names;
}

struct Place {
  std::string name;
  double value_mm = 0;
};

// Of the application points, or of the marks where there are none; NaN is worse than all.
template <typename ValueAt>
Place worst_place(const Job& job, const ValueAt& value_at) {
  Place worst;
  for (const ApplicationPoint& point : points_that_count(job)) {
    const double value_mm = value_at(point.p_O_mm);
    if (!(value_mm <= worst.value_mm) && !std::isnan(worst.value_mm)) worst = {point.name, value_mm};
  }
  return worst;
}

Place worst_sigma(const Job& job, const PoseResult& pose) {
  return worst_place(job, [&pose](const Eigen::Vector3d& p_O_mm) { return sigma_at_mm(pose, p_O_mm); });
}

Place furthest(const Job& job, const Pose& X_O0O_from, const Pose& X_O0O_to) {
  return worst_place(
      job, [&](const Eigen::Vector3d& p_O_mm) { return (X_O0O_to * p_O_mm - X_O0O_from * p_O_mm).norm(); });
}

}  // namespace

Verdict check_image(const PictureHealth& health, const std::string& name) {
  const double white_share = health.saturated_share, bright_share = 1 - health.dark_share;
  if (white_share > max_white_share)
    return {Code::image_saturated, name + ": " + number(100 * white_share, 0) +
                                       " % of the picture are white, allowed are " +
                                       number(100 * max_white_share, 0) + " %"};
  if (bright_share < min_bright_share)
    return {Code::image_dark, name + ": " + number(100 * bright_share, 1) +
                                  " % of the picture are brighter than grey level " + number(dark_grey) +
                                  ", needed are " + number(100 * min_bright_share, 1) + " %"};
  return good();
}

Verdict check_marks(const Job& job, std::span<const CalibratedCamera> cameras, std::span<const View> used) {
  const Requirements& needed = job.requirements;
  const Counts counts = count_of(job, cameras.size(), used);
  const int at_least = std::max(needed.min_marks, least_marks(job));
  if (counts.marks < at_least)
    return {Code::too_few_marks, number(counts.marks) + " marks can be used, " + number(at_least) +
                                     " are required; " + missing_of(job, cameras, used)};
  for (const View& view : job.views)
    if (counts.in_camera[view.camera] < needed.min_marks_per_camera)
      return {Code::too_few_marks_in_camera,
              cameras[view.camera].name + " has " + number(counts.in_camera[view.camera]) +
                  " marks that can be used, " + number(needed.min_marks_per_camera) + " are required; " +
                  missing_of(job, cameras, used)};
  if (counts.cameras < needed.min_cameras)
    return {Code::too_few_cameras, number(counts.cameras) + " cameras have marks that can be used, " +
                                       number(needed.min_cameras) + " are required; " +
                                       missing_of(job, cameras, used)};
  return good();
}

std::vector<ApplicationPoint> points_that_count(const Job& job) {
  if (!job.application_points.empty()) return job.application_points;
  std::vector<ApplicationPoint> points;
  for (const Mark& mark : job.marks) points.push_back({mark.name, mark.p_O_mm});
  return points;
}

Eigen::Matrix3d covariance_at_mm2(const PoseResult& pose, const Eigen::Vector3d& p_O_mm) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -cross_matrix(pose.X_WO.linear() * p_O_mm);
  return J * pose.total_covariance * J.transpose();
}

double sigma_at_mm(const PoseResult& pose, const Eigen::Vector3d& p_O_mm) {
  return std::sqrt(symmetric_eigen(covariance_at_mm2(pose, p_O_mm)).values.maxCoeff());
}

double worst_sigma_mm(const Job& job, const PoseResult& pose) { return worst_sigma(job, pose).value_mm; }

Verdict check_sigma(const Job& job, const PoseResult& pose) {
  const double limit = job.requirements.max_sigma_mm;
  if (limit == 0) return good();
  const Place worst = worst_sigma(job, pose);
  if (worst.value_mm <= limit) return good();
  return {Code::sigma_too_large, "sigma at " + worst.name + " is " + number(worst.value_mm, 3) +
                                     " mm, allowed are " + number(limit, 3) + " mm"};
}

Reliability reliability_of(const Job& job, const PoseProblem& problem, const PoseResult& pose) {
  std::vector<Eigen::Vector3d> points_O_mm;
  for (const ApplicationPoint& point : points_that_count(job)) points_O_mm.push_back(point.p_O_mm);
  return reliability_of(problem, pose, points_O_mm);
}

Verdict check_power(const Job& job, const PoseProblem& problem, const Reliability& reliability) {
  const double limit = job.requirements.max_hidden_mm;
  if (limit == 0 || reliability.hidden_mm <= limit) return good();
  std::string whose, by;
  std::size_t point = 0;
  if (reliability.worst_is_mark) {
    const MarkReliability& worst = reliability.marks[reliability.worst];
    whose = "mark " + job.marks[worst.mark].name;
    by = " could sit wrong by " + number(worst.detectable_mm) + " mm";
    point = worst.worst_point;
  } else {
    const ObservationReliability& worst = reliability.observations[reliability.worst];
    const Observation& observation = problem.observations[worst.observation];
    whose = "mark " + job.marks[observation.mark].name + " in " + problem.cameras[observation.camera].name;
    by = " could be wrong by " + number(worst.detectable_px) + " px";
    point = worst.worst_point;
  }
  if (!std::isfinite(reliability.hidden_mm))
    return {Code::hidden_error_too_large,
            "nothing checks " + whose + ": were it wrong, nobody would notice; more marks are needed"};
  return {Code::hidden_error_too_large, whose + by + " and move " + points_that_count(job)[point].name +
                                            " by " + number(reliability.hidden_mm, 3) +
                                            " mm without being noticed, allowed are " + number(limit, 3) +
                                            " mm"};
}

Verdict check_limits(const Requirements& requirements, const Pose& X_O0O) {
  struct Axis {
    Code code;
    const char* name;
    const char* unit;
    double value;
  };
  const SixNumbers six = to_six_numbers(X_O0O);
  const std::array<Axis, 6> axes{{{Code::limit_x, "x", " mm", six.x_mm},
                                  {Code::limit_y, "y", " mm", six.y_mm},
                                  {Code::limit_z, "z", " mm", six.z_mm},
                                  {Code::limit_rx, "rx", " deg", six.rx_deg},
                                  {Code::limit_ry, "ry", " deg", six.ry_deg},
                                  {Code::limit_rz, "rz", " deg", six.rz_deg}}};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Axis& axis = axes[i];
    const Range& range = requirements.limits[i];
    const double slack = i < 3 ? 0 : rounding;
    if (axis.value >= range.min - slack && axis.value <= range.max + slack) continue;
    return {axis.code, std::string(axis.name) + " is " + number(axis.value, 4) + axis.unit +
                           ", allowed are " + number(range.min, 4) + " to " + number(range.max, 4) +
                           axis.unit};
  }
  return good();
}

Verdict check_displacement(const Job& job, const Pose& X_O0O) {
  const double limit = job.requirements.max_displacement_mm;
  if (limit == 0) return good();
  const Place worst = furthest(job, Pose::Identity(), X_O0O);
  if (worst.value_mm <= limit + rounding) return good();
  return {Code::limit_displacement, worst.name + " is displaced by " + number(worst.value_mm, 3) +
                                        " mm, allowed are " + number(limit, 3) + " mm"};
}

Verdict check_step(const Job& job, const Pose& X_O0O_last, const Pose& X_O0O) {
  const Requirements& allowed = job.requirements;
  const Place worst = furthest(job, X_O0O_last, X_O0O);
  if (allowed.max_step_mm > 0 && !(worst.value_mm <= allowed.max_step_mm + rounding))
    return {Code::step_too_large, worst.name + " is " + number(worst.value_mm, 3) +
                                      " mm from where the last valid result put it, allowed are " +
                                      number(allowed.max_step_mm, 3) + " mm"};
  const double turn_deg =
      log_so3(X_O0O_last.linear().transpose() * X_O0O.linear()).norm() * degrees_per_radian;
  if (allowed.max_step_deg > 0 && !(turn_deg <= allowed.max_step_deg + rounding))
    return {Code::step_too_large, "the object is turned by " + number(turn_deg, 4) +
                                      " deg from where the last valid result put it, allowed are " +
                                      number(allowed.max_step_deg, 4) + " deg"};
  return good();
}

}  // namespace zeropose
