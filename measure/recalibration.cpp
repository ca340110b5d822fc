#include "measure/recalibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "calib/pose_only.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"
#include "measure/recalibration_fit.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double assumed_sigma_px = 0.1;    // of a pixel where nothing tells
constexpr double plausible_rms_px = 5;      // points that leave more are not those that they are taken for
constexpr double turned_only_rms_px = 0.3;  // more between the points, and the camera did not only turn
constexpr double outdated_px = 1;           // the calibrated pose misses the pixels before by more: a warning
constexpr double line_share = 1e-3;      // points nearer to a line than this share of their extent lie on it
constexpr double parallel_rad = 1e-4;    // directions within this are one
constexpr double max_sigma_share = 0.3;  // a change known no better, rad or share of the distance, is a guess

RecalibrationResult failed(Code code, std::string reason) {
  RecalibrationResult result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

bool is_covariance(const Eigen::Matrix2d& covariance) {
  return covariance.allFinite() && covariance(0, 0) > 0 && covariance(1, 1) > 0 &&
         covariance.determinant() > 0;
}

std::string fault_of(const RecalibrationProblem& problem, const RecalibrationPoint& point) {
  const bool places = problem.method != RecalibrationMethod::arbitrary_points;
  const bool before = problem.method != RecalibrationMethod::known_points;
  if (places && !point.p_mm.allFinite()) return "has coordinates that are not finite";
  if (!point.old_px.allFinite() || !point.new_px.allFinite()) return "has a pixel that is not finite";
  if (!is_covariance(point.old_covariance_px2) || !is_covariance(point.new_covariance_px2))
    return "has a covariance that is not positive definite";
  if (!ray(problem.model, point.new_px) || (before && !ray(problem.model, point.old_px)))
    return "has a pixel for which the lens model gives no direction";
  return {};
}

std::optional<RecalibrationResult> fault_of(const RecalibrationProblem& problem) {
  if (!(problem.sigma_px >= 0 && std::isfinite(problem.sigma_px)))
    return failed(Code::marks_invalid, "sigma_px is " + number(problem.sigma_px) + ", expected >= 0");
  if (!problem.X_WCo.matrix().allFinite())
    return failed(Code::marks_invalid, "the calibrated pose of the camera is not finite");
  for (const RecalibrationPoint& point : problem.points)
    if (const std::string fault = fault_of(problem, point); !fault.empty())
      return failed(Code::marks_invalid, "point " + point.name + " " + fault);
  return std::nullopt;
}

std::string names_of(std::span<const RecalibrationPoint> points, const std::vector<std::size_t>& chosen) {
  std::string names;
  for (const std::size_t i : chosen) names += (names.empty() ? "" : ", ") + points[i].name;
  return names;
}

Matrix6 turned(const Eigen::Matrix3d& R, const Matrix6& covariance) {
  Matrix6 T = Matrix6::Zero();
  T.topLeftCorner<3, 3>() = T.bottomRightCorner<3, 3>() = R;
  return T * covariance * T.transpose();
}

void set_change(const RecalibrationProblem& problem, const Pose& X_CoCn, const Matrix6& change_covariance,
                RecalibrationResult& result) {
  result.X_CoCn = X_CoCn;
  result.X_WCn = problem.X_WCo * X_CoCn;
  result.change_covariance = change_covariance;
  result.covariance = turned(problem.X_WCo.linear(), change_covariance);
}

// Root mean square distance of the pixels used; `both`: old and new ones.
void set_rms(bool both, RecalibrationResult& result) {
  double sum = 0;
  int count = 0;
  for (const RecalibrationDeviation& deviation : result.deviations) {
    if (!deviation.used) continue;
    sum += deviation.new_px.squaredNorm() + (both ? deviation.old_px.squaredNorm() : 0);
    count += both ? 2 : 1;
  }
  result.rms_px = count > 0 ? std::sqrt(sum / count) : 0;
}

void set_contradiction(std::span<const RecalibrationPoint> points, RecalibrationResult& result) {
  result.code = Code::deviation_not_attributable;
  result.reason = "the points contradict each other by " + number(result.rms_px) + " px (root mean square)";
  result.reason += result.suspects.empty() ? ", and no single one that moved explains it"
                                           : ", one of these moved: " + names_of(points, result.suspects);
}

// A change that is no better known than a guess.
void judge_precision(double distance_mm, RecalibrationResult& result) {
  const double turn = std::sqrt(result.change_covariance.bottomRightCorner<3, 3>().trace());
  const double shift_mm = std::sqrt(result.change_covariance.topLeftCorner<3, 3>().trace());
  if (turn <= max_sigma_share && shift_mm <= max_sigma_share * distance_mm) return;
  result.code = Code::geometry_degenerate;
  result.reason = "the points leave the camera's pose open: sigma " + number(shift_mm, 1) + " mm and " +
                  number(turn * degrees_per_radian, 1) + " deg";
}

Vector2d deviation_px(const CameraModel& model, const Vector2d& found_px, const Vector3d& p_CQ) {
  const auto u_px = project(model, p_CQ);
  return u_px ? Vector2d(found_px - *u_px) : Vector2d::Constant(std::numeric_limits<double>::infinity());
}

// --- known points

Code code_of(PoseOnlyStatus status) {
  switch (status) {
    case PoseOnlyStatus::ok:
      return Code::ok;
    case PoseOnlyStatus::wrong_problem:
    case PoseOnlyStatus::not_finite:
      return Code::marks_invalid;
    case PoseOnlyStatus::too_few_points:
      return Code::too_few_marks;
    case PoseOnlyStatus::collinear:
    case PoseOnlyStatus::ambiguous:
    case PoseOnlyStatus::not_determined:
      return Code::geometry_degenerate;
    case PoseOnlyStatus::contradiction:
      return Code::deviation_not_attributable;
    default:
      return Code::not_converged;
  }
}

void look_at_old_pixels(const RecalibrationProblem& problem, RecalibrationResult& result) {
  double sum = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const Vector3d p_Co = problem.X_WCo.inverse() * problem.points[i].p_mm;
    result.deviations[i].old_px = deviation_px(problem.model, problem.points[i].old_px, p_Co);
    if (result.deviations[i].used) sum += result.deviations[i].old_px.squaredNorm();
  }
  const auto used = std::ranges::count_if(result.deviations, &RecalibrationDeviation::used);
  const double rms_px = std::sqrt(sum / static_cast<double>(std::max<std::ptrdiff_t>(used, 1)));
  if (!(rms_px <= outdated_px))
    result.warnings.push_back("the calibrated pose misses the pixels before by " + number(rms_px) +
                              " px (root mean square): the change contains what was wrong with it");
}

RecalibrationResult by_known_points(const RecalibrationProblem& problem) {
  if (problem.points.size() < 3)
    return failed(Code::too_few_marks, number(problem.points.size()) + " known points, a pose needs 3");
  std::vector<CalibrationPoint> points(problem.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_W_mm = problem.points[i].p_mm;
    points[i].u_px = problem.points[i].new_px;
    points[i].covariance_px2 = problem.points[i].new_covariance_px2;
  }
  PoseOnlyProblem pose_problem;
  pose_problem.model = problem.model;
  pose_problem.points = points;
  pose_problem.X_WC_near = problem.X_WCo;
  pose_problem.sigma_px = problem.sigma_px;
  const PoseOnlyResult pose = calibrate_pose(pose_problem);
  RecalibrationResult result = failed(code_of(pose.status), pose.reason);
  set_change(problem, problem.X_WCo.inverse() * pose.X_WC,
             turned(problem.X_WCo.linear().transpose(), pose.covariance), result);
  result.translation_known = true;
  result.sigma_px = pose.sigma_px;
  result.rms_px = pose.rms_px;
  result.redundancy = pose.redundancy;
  result.removed = pose.removed;
  result.suspects = pose.suspects;
  for (const CalibrationDeviation& deviation : pose.deviations)
    result.deviations.push_back({Vector2d::Zero(), deviation.dev_px, deviation.used});
  if (pose.status == PoseOnlyStatus::contradiction) set_contradiction(problem.points, result);
  if (!result.deviations.empty()) look_at_old_pixels(problem, result);
  return result;
}

// --- arbitrary points

std::optional<RecalibrationResult> shortage_of_directions(const RecalibrationProblem& problem) {
  const std::size_t count = problem.points.size();
  if (count < 2) return failed(Code::too_few_marks, number(count) + " points, a rotation needs 2");
  double widest = 0;
  for (const RecalibrationPoint& point : problem.points) {
    const Vector3d first = ray(problem.model, problem.points.front().old_px)->normalized();
    widest = std::max(widest, first.cross(ray(problem.model, point.old_px)->normalized()).norm());
  }
  if (widest > parallel_rad) return std::nullopt;
  return failed(
      Code::geometry_degenerate,
      "all " + number(count) + " directions of sight are parallel, the rotation about them is open");
}

// Without points that moved, where the others then agree on a pure rotation; else all points stay: what a
// shift of the camera does to near points is no reason to throw them out.
WrongPoints agreeing_points(const RecalibrationProblem& problem, PointFit all, std::vector<bool>& used) {
  WrongPointOptions options;
  options.sigma_px = problem.sigma_px;
  std::vector<bool> fewer = used;
  PointFit kept = fit_rotation(problem, rotation_of(all));
  WrongPoints wrong = remove_wrong_points(std::move(all), fewer, options);
  const bool turned_only =
      wrong.agree && (problem.sigma_px > 0 || sigma_of_fit(wrong.fit, options) <= turned_only_rms_px);
  if (wrong.removed.empty() || turned_only) {
    used = fewer;
    return wrong;
  }
  wrong.fit = std::move(kept);
  wrong.sigma_px = sigma_of_fit(wrong.fit, options);
  wrong.removed.clear();
  wrong.agree = false;
  return wrong;
}

RecalibrationResult by_arbitrary_points(const RecalibrationProblem& problem) {
  if (auto shortage = shortage_of_directions(problem)) return *shortage;
  PointFit all = fit_rotation(problem, rotation_between(problem));
  if (all.status != PointFitStatus::ok)
    return failed(
        all.status == PointFitStatus::not_determined ? Code::geometry_degenerate : Code::not_converged,
        "no rotation of the camera was found that explains the points");
  std::vector<bool> used(problem.points.size(), true);
  const WrongPoints wrong = agreeing_points(problem, std::move(all), used);
  RecalibrationResult result;
  result.code = Code::ok;
  result.sigma_px = wrong.sigma_px > 0 ? wrong.sigma_px : assumed_sigma_px;
  result.redundancy = wrong.fit.redundancy;
  result.removed = wrong.removed;
  Pose X_CoCn = Pose::Identity();
  X_CoCn.linear() = rotation_of(wrong.fit);
  Matrix6 covariance = Matrix6::Zero();
  covariance.bottomRightCorner<3, 3>() = result.sigma_px * result.sigma_px * wrong.fit.inverse_N;
  set_change(problem, X_CoCn, covariance, result);
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const RecalibrationPoint& point = problem.points[i];
    const Vector3d d_new = X_CoCn.linear().transpose() * *ray(problem.model, point.old_px);
    result.deviations.push_back(
        {Vector2d::Zero(), deviation_px(problem.model, point.new_px, d_new), used[i]});
  }
  set_rms(false, result);
  judge_precision(std::numeric_limits<double>::infinity(), result);
  if (!wrong.agree || (problem.sigma_px == 0 && result.rms_px > turned_only_rms_px))
    result.warnings.push_back(
        "a rotation leaves " + number(result.rms_px) +
        " px (root mean square) between the points: the camera was shifted as well, or a "
        "point moved; known points or groups tell");
  return result;
}

// --- groups

std::optional<RecalibrationResult> shortage_of_groups(const RecalibrationProblem& problem) {
  std::map<std::string, std::vector<Vector3d>> groups;
  for (const RecalibrationPoint& point : problem.points) groups[point.group].push_back(point.p_mm);
  if (groups.size() < 2)
    return failed(Code::too_few_marks, number(groups.size()) + (groups.size() == 1 ? " group" : " groups") +
                                           " of points, this method needs 2");
  for (const auto& [name, points] : groups) {
    if (points.size() < 3)
      return failed(Code::too_few_marks,
                    "group " + name + " has " + number(points.size()) + " points, it needs 3");
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& p : points) centre += p / static_cast<double>(points.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vector3d& p : points) spread += (p - centre) * (p - centre).transpose();
    const Vector3d squares = symmetric_eigen(spread).values.cwiseMax(0);
    if (std::sqrt(squares(0) + squares(1)) <= line_share * std::sqrt(squares(2)))
      return failed(Code::geometry_degenerate, "the points of group " + name + " lie on a line");
  }
  return std::nullopt;
}

// Another placement of the groups gives another change, farther off than the noise explains.
void judge_alternatives(const GroupFits& fits, RecalibrationResult& result) {
  constexpr double ellipsoid_999 = 22.46;  // chi-square, six degrees of freedom
  const auto solver = result.change_covariance.ldlt();
  for (const Pose& other : fits.others) {
    const Vector6 apart = difference(result.X_CoCn, other);
    if (apart.dot(solver.solve(apart)) <= ellipsoid_999) continue;
    result.code = Code::geometry_degenerate;
    result.reason =
        "the groups can be placed in several ways that explain the pixels equally well, with changes " +
        number(apart.head<3>().norm()) + " mm and " + number(apart.tail<3>().norm() * degrees_per_radian, 3) +
        " deg apart: give the groups more points, or points with depth";
    return;
  }
}

RecalibrationResult by_groups(const RecalibrationProblem& problem) {
  if (auto shortage = shortage_of_groups(problem)) return *shortage;
  GroupFits fits = fit_groups_from_anywhere(problem);
  if (fits.best.status != PointFitStatus::ok) {
    const bool open = fits.best.status == PointFitStatus::not_determined;
    return failed(open ? Code::geometry_degenerate : Code::not_converged,
                  open ? "the groups leave a direction of the camera's change open"
                       : "no change of the camera explains the groups");
  }
  WrongPointOptions options;
  options.sigma_px = problem.sigma_px;
  std::vector<bool> used(problem.points.size(), true);
  const WrongPoints wrong = remove_wrong_points(std::move(fits.best), used, options);
  const GroupState& state = groups_of(wrong.fit);
  RecalibrationResult result;
  result.code = Code::ok;
  result.translation_known = true;
  result.sigma_px = wrong.sigma_px > 0 ? wrong.sigma_px : assumed_sigma_px;
  result.redundancy = wrong.fit.redundancy;
  result.removed = wrong.removed;
  result.suspects = wrong.suspects;
  set_change(problem, state.X_CoCn,
             result.sigma_px * result.sigma_px * wrong.fit.inverse_N.topLeftCorner<6, 6>(), result);
  const std::vector<std::size_t> groups = group_numbers(problem.points);
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const RecalibrationPoint& point = problem.points[i];
    const Vector3d p_Co = state.X_CoG[groups[i]] * point.p_mm;
    nearest_mm = std::min(nearest_mm, p_Co.norm());
    result.deviations.push_back({deviation_px(problem.model, point.old_px, p_Co),
                                 deviation_px(problem.model, point.new_px, state.X_CoCn.inverse() * p_Co),
                                 used[i]});
  }
  set_rms(true, result);
  judge_precision(nearest_mm, result);
  judge_alternatives(fits, result);
  if (!wrong.agree || !(result.rms_px <= plausible_rms_px)) set_contradiction(problem.points, result);
  return result;
}

}  // namespace

std::string_view name_of(RecalibrationMethod method) {
  switch (method) {
    case RecalibrationMethod::known_points:
      return "known";
    case RecalibrationMethod::arbitrary_points:
      return "arbitrary";
    case RecalibrationMethod::groups:
      return "groups";
  }
  return "unknown";
}

RecalibrationResult recalibrate(const RecalibrationProblem& problem) {
  if (auto fault = fault_of(problem)) return *fault;
  switch (problem.method) {
    case RecalibrationMethod::known_points:
      return by_known_points(problem);
    case RecalibrationMethod::arbitrary_points:
      return by_arbitrary_points(problem);
    default:
      return by_groups(problem);
  }
}

}  // namespace zeropose
