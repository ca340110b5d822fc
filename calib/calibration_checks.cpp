#include "calib/calibration_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/eccentricity.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using enum CalibrationStatus;

constexpr double smallest_body_mm = 5, largest_body_mm = 50000;
constexpr double loose_focal = 0.01;

InputFault wrong(std::string reason) { return {wrong_problem, std::move(reason)}; }

bool same_lens(const CalibrationProblem& problem) {
  return std::holds_alternative<Division>(problem.start->model.distortion) ==
         (problem.lens == LensModel::division);
}

void warn_of_units(const PointLayout& layout, std::vector<std::string>& warnings) {
  const double extent = layout.extent_mm.x();
  if (extent < smallest_body_mm)
    warnings.push_back("the points span " + number(extent, 3) +
                       " mm (root mean square): are they in metres? They are read as millimetres");
  if (extent > largest_body_mm)
    warnings.push_back("the points span " + number(extent / 1000, 1) +
                       " m (root mean square): are they in micrometres? They are read as millimetres");
}

void warn_of_repetitions(const CalibrationProblem& problem, std::vector<std::string>& warnings) {
  std::vector<std::array<double, 5>> rows;
  for (const CalibrationPoint& point : problem.points)
    rows.push_back({point.p_W_mm.x(), point.p_W_mm.y(), point.p_W_mm.z(), point.u_px.x(), point.u_px.y()});
  std::sort(rows.begin(), rows.end());
  const auto repeated = rows.end() - std::unique(rows.begin(), rows.end());
  if (repeated > 0)
    warnings.push_back(number(static_cast<std::size_t>(repeated)) +
                       " rows are exact repetitions: they add weight, but no knowledge");
}

void warn_of_plane(const CalibrationProblem& problem, const CalibrationResult& result,
                   std::vector<std::string>& warnings) {
  if (!result.diagnosis.coplanar) return;
  if (!problem.fixed.has_all({Parameter::fx, Parameter::fy}))
    warnings.push_back("the points lie in one plane: fx / fy cannot be determined and is held at " +
                       number(result.model.fx_px / result.model.fy_px, 6));
  const auto& free = result.uncertainty.parameters;
  if (std::find(free.begin(), free.end(), Parameter::cx) != free.end())
    warnings.push_back(
        "the points lie in one plane: the image origin follows from the distortion alone, see its sigma");
}

double sigma_of(const CalibrationResult& result, Parameter parameter) {
  const auto& list = result.uncertainty.parameters;
  const auto found = std::find(list.begin(), list.end(), parameter);
  if (found == list.end()) return 0;
  const auto i = found - list.begin();
  return std::sqrt(result.uncertainty.covariance(i, i));
}

void warn_of_focal(const CalibrationResult& result, std::vector<std::string>& warnings) {
  const double focal = sigma_of(result, Parameter::fx) / result.model.fx_px;
  if (focal > loose_focal)
    warnings.push_back("the focal length is known to " + number(100 * focal, 1) +
                       " % only (one sigma): tilt the board more, or use points with more depth");
}

}  // namespace

std::vector<CalibrationDeviation> deviations_of(std::span<const CalibrationPoint> points,
                                                const CameraModel& camera, const Pose& X_WC) {
  const Pose X_CW = X_WC.inverse();
  const Vector2d focal(camera.fx_px, camera.fy_px);
  std::vector<CalibrationDeviation> deviations;
  for (const CalibrationPoint& point : points) {
    const Eigen::Vector3d p_C = X_CW * point.p_W_mm;
    CalibrationDeviation deviation;
    deviation.depth_mm = p_C.z();
    deviation.dev_px.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (const auto u = project(camera, p_C))
      deviation.dev_px =
          point.u_px - *u -
          ellipse_centre_offset(camera, p_C, X_CW.linear() * point.disc_normal_W, point.disc_radius_mm);
    deviation.dev_mm = deviation.dev_px.cwiseQuotient(focal) * p_C.z();
    deviations.push_back(deviation);
  }
  return deviations;
}

double rms_of(const std::vector<CalibrationDeviation>& deviations) {
  double sum = 0;
  for (const CalibrationDeviation& deviation : deviations) sum += deviation.dev_px.squaredNorm();
  return deviations.empty() ? 0 : std::sqrt(sum / static_cast<double>(deviations.size()));
}

std::optional<InputFault> options_fault(const CalibrationProblem& problem) {
  if (problem.width_px <= 0 || problem.height_px <= 0)
    return wrong("the image size " + number(problem.width_px) + " x " + number(problem.height_px) +
                 " is none");
  if (problem.points.empty()) return InputFault{too_few_points, "there are no points"};
  if (problem.lens == LensModel::brown && problem.residual == Residual::algebraic)
    return wrong("the algebraic residual is that of the division model; use reprojection with brown");
  if (problem.start && !same_lens(problem))
    return wrong("the start has another lens model than the one asked for; convert it first");
  for (const Parameter parameter : {Parameter::fx, Parameter::fy})
    if (problem.fixed.has(parameter) && !problem.start)
      return wrong(std::string(name_of(parameter)) + " is to be held, but there is no start that gives it");
  const bool pose_start = problem.start && problem.start->X_WC;
  for (int i = static_cast<int>(Parameter::x); i <= static_cast<int>(Parameter::rz); ++i)
    if (problem.fixed.has(static_cast<Parameter>(i)) && !pose_start)
      return wrong(std::string(name_of(static_cast<Parameter>(i))) +
                   " is to be held, but there is no start with a pose that gives it");
  if (problem.start && (!(problem.start->model.fx_px > 0) || !(problem.start->model.fy_px > 0)))
    return wrong("the start's focal lengths are not positive");
  return std::nullopt;
}

void add_warnings(const CalibrationProblem& problem, const PointLayout& layout, CalibrationResult& result) {
  std::vector<std::string>& warnings = result.diagnosis.warnings;
  warn_of_units(layout, warnings);
  warn_of_repetitions(problem, warnings);
  warn_of_plane(problem, result, warnings);
  warn_of_focal(result, warnings);
}

std::string_view name_of(CalibrationStatus status) {
  switch (status) {
    case ok:
      return "ok";
    case wrong_problem:
      return "wrong_problem";
    case not_finite:
      return "not_finite";
    case too_few_points:
      return "too_few_points";
    case duplicate_points:
      return "duplicate_points";
    case collinear:
      return "collinear";
    case coplanar:
      return "coplanar";
    case parallel_to_chip:
      return "parallel_to_chip";
    case all_in_centre:
      return "all_in_centre";
    case behind_camera:
      return "behind_camera";
    case not_determined:
      return "not_determined";
    case not_converged:
      return "not_converged";
    case failed:
      break;
  }
  return "failed";
}

}  // namespace zeropose
