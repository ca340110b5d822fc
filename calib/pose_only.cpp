#include "calib/pose_only.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/best_fit.h"
#include "calib/pose_only_fit.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Of a pixel where nothing tells: no sigma was given and every equation is needed.
constexpr double assumed_sigma_px = 0.1;
// Points that leave more than this between them are not those that they are taken for.
constexpr double plausible_rms_px = 5;
// Points nearer to a line than this share of their extent lie on it.
constexpr double line_share = 1e-3;
// A pose known no better than this, rad or share of the distance, is a guess.
constexpr double max_sigma_share = 0.3;

PoseOnlyResult failed(PoseOnlyStatus status, std::string reason) {
  PoseOnlyResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

bool is_covariance(const Eigen::Matrix2d& covariance) {
  return covariance.allFinite() && covariance(0, 0) > 0 && covariance(1, 1) > 0 &&
         covariance.determinant() > 0;
}

// What is wrong with the numbers, or failed: nothing.
PoseOnlyResult fault_of(const PoseOnlyProblem& problem) {
  if (!(problem.sigma_px >= 0 && std::isfinite(problem.sigma_px)))
    return failed(PoseOnlyStatus::wrong_problem,
                  "sigma_px is " + number(problem.sigma_px) + ", expected >= 0");
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const CalibrationPoint& point = problem.points[i];
    const std::string which = "point " + number(i + 1) + " (from 1) ";
    if (!point.p_W_mm.allFinite() || !point.u_px.allFinite())
      return failed(PoseOnlyStatus::not_finite, which + "has a number that is not finite");
    if (!is_covariance(point.covariance_px2))
      return failed(PoseOnlyStatus::wrong_problem, which + "has a covariance that is not positive definite");
    if (!ray(problem.model, point.u_px))
      return failed(PoseOnlyStatus::not_finite,
                    which + "has a pixel for which the lens model gives no direction");
  }
  for (std::size_t i = 0; i < problem.features.size(); ++i) {
    const HousingFeature& feature = problem.features[i];
    if (!feature.p_C_mm.allFinite() || !feature.p_W_mm.allFinite())
      return failed(PoseOnlyStatus::not_finite,
                    "feature " + number(i + 1) + " (from 1) has a number that is not finite");
    if (!(feature.sigma_mm > 0))
      return failed(PoseOnlyStatus::wrong_problem,
                    "feature " + number(i + 1) + " (from 1) has no sigma above 0");
  }
  return {};
}

// Spread of the points across and along the line that fits them best, root mean square.
struct Spread {
  double across = 0, along = 0;
};

Spread spread_of(std::span<const CalibrationPoint> points) {
  Vector3d centre = Vector3d::Zero();
  for (const CalibrationPoint& point : points) centre += point.p_W_mm / static_cast<double>(points.size());
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const CalibrationPoint& point : points)
    sum += (point.p_W_mm - centre) * (point.p_W_mm - centre).transpose();
  const Vector3d squares = symmetric_eigen(sum).values.cwiseMax(0) / static_cast<double>(points.size());
  return {std::sqrt(squares(0) + squares(1)), std::sqrt(squares(2))};
}

PoseOnlyResult shortage_of(const PoseOnlyProblem& problem) {
  const std::size_t points = problem.points.size(), features = problem.features.size();
  if (features == 0) {
    const std::size_t needed = problem.X_WC_near ? 3 : 4;
    if (points < needed)
      return failed(PoseOnlyStatus::too_few_points, number(points) +
                                                        " reference points, without a feature on the "
                                                        "housing a camera's pose needs " +
                                                        number(needed));
    const Spread spread = spread_of(problem.points);
    if (spread.across <= line_share * spread.along)
      return failed(PoseOnlyStatus::collinear,
                    "the " + number(points) + " reference points lie on a line: " + number(spread.across) +
                        " mm across over " + number(spread.along) + " mm along (root mean square)");
  }
  if ((features == 1 || features == 2) && points < 2)
    return failed(PoseOnlyStatus::too_few_points,
                  number(points) + " reference points, with " + number(features) +
                      (features == 1 ? " feature" : " features") + " a camera's pose needs 2");
  return {};
}

PoseOnlyResult by_features_alone(const PoseOnlyProblem& problem) {
  std::vector<PointPair> pairs;
  for (const HousingFeature& feature : problem.features)
    pairs.push_back({feature.p_W_mm, feature.p_C_mm, 1 / (feature.sigma_mm * feature.sigma_mm)});
  const BestFitResult fit = best_fit(pairs);
  if (fit.status == BestFitStatus::collinear)
    return failed(PoseOnlyStatus::collinear, "the features on the housing lie on a line");
  PoseOnlyResult result;
  result.status = fit.status == BestFitStatus::ok ? PoseOnlyStatus::ok : PoseOnlyStatus::failed;
  result.X_WC = fit.X_AB;
  result.covariance = fit.covariance;
  result.redundancy = static_cast<int>(3 * pairs.size()) - 6;
  result.feature_deviations_mm = fit.residuals_mm;
  return result;
}

void fill_deviations(const PoseOnlyProblem& problem, const std::vector<bool>& used, PoseOnlyResult& result) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const CalibrationPoint& point = problem.points[i];
    CalibrationDeviation& deviation = result.deviations.emplace_back();
    const Vector3d p_CQ = result.X_WC.inverse() * point.p_W_mm;
    deviation.depth_mm = p_CQ.z();
    deviation.used = used[i];
    const auto u_px = project(problem.model, p_CQ);
    deviation.dev_px =
        u_px ? Vector2d(point.u_px - *u_px) : Vector2d::Constant(std::numeric_limits<double>::infinity());
    deviation.dev_mm =
        deviation.dev_px.cwiseQuotient(Vector2d(problem.model.fx_px, problem.model.fy_px)) * p_CQ.z();
    if (!used[i]) continue;
    sum += deviation.dev_px.squaredNorm();
    ++count;
  }
  result.rms_px = count > 0 ? std::sqrt(sum / count) : 0;
  for (const HousingFeature& feature : problem.features)
    result.feature_deviations_mm.push_back(feature.p_W_mm - result.X_WC * feature.p_C_mm);
}

std::string list_of(const std::vector<std::size_t>& points) {
  std::string text;
  for (const std::size_t point : points) text += (text.empty() ? "" : ", ") + number(point + 1);
  return text;
}

// The points contradict each other.
void judge_agreement(const WrongPoints& wrong, PoseOnlyResult& result) {
  const bool implausible = !(result.rms_px <= plausible_rms_px);
  if (wrong.agree && !implausible) return;
  result.status = PoseOnlyStatus::contradiction;
  result.reason = "the points contradict each other by " + number(result.rms_px) + " px (root mean square)";
  result.reason += wrong.suspects.empty()
                       ? ", and no single one explains it"
                       : ", wrong is one of points " + list_of(wrong.suspects) + " (from 1)";
  result.suspects = wrong.suspects;
}

void judge_precision(const PoseOnlyProblem& problem, PoseOnlyResult& result) {
  double distance_mm = std::numeric_limits<double>::infinity();
  for (const CalibrationDeviation& deviation : result.deviations)
    distance_mm = std::min(distance_mm, deviation.depth_mm);
  const double turn = std::sqrt(result.covariance.bottomRightCorner<3, 3>().trace());
  const double shift_mm = std::sqrt(result.covariance.topLeftCorner<3, 3>().trace());
  if (turn <= max_sigma_share && shift_mm <= max_sigma_share * distance_mm) return;
  result.status = PoseOnlyStatus::not_determined;
  result.reason = "the " + number(problem.points.size()) + " points leave the pose open: sigma " +
                  number(shift_mm, 1) + " mm and " + number(turn * degrees_per_radian, 1) + " deg";
}

}  // namespace

std::string_view name_of(PoseOnlyStatus status) {
  switch (status) {
    case PoseOnlyStatus::ok:
      return "ok";
    case PoseOnlyStatus::wrong_problem:
      return "wrong_problem";
    case PoseOnlyStatus::not_finite:
      return "not_finite";
    case PoseOnlyStatus::too_few_points:
      return "too_few_points";
    case PoseOnlyStatus::collinear:
      return "collinear";
    case PoseOnlyStatus::ambiguous:
      return "ambiguous";
    case PoseOnlyStatus::not_determined:
      return "not_determined";
    case PoseOnlyStatus::contradiction:
      return "contradiction";
    case PoseOnlyStatus::not_converged:
      return "not_converged";
    default:
      return "failed";
  }
}

PoseOnlyResult calibrate_pose(const PoseOnlyProblem& problem) {
  if (PoseOnlyResult fault = fault_of(problem); fault.status != PoseOnlyStatus::failed) return fault;
  if (PoseOnlyResult shortage = shortage_of(problem); shortage.status != PoseOnlyStatus::failed)
    return shortage;
  if (problem.points.empty()) return by_features_alone(problem);

  PoseOnlyResult result;
  WrongPointOptions options;
  options.sigma_px = problem.sigma_px;
  std::vector<bool> used(problem.points.size(), true);
  double scale_px = problem.sigma_px > 0 ? problem.sigma_px : assumed_sigma_px;
  CameraFits fits = fits_from_anywhere(problem, scale_px);
  if (fits.best.status != PointFitStatus::ok) {
    const bool open = fits.best.status == PointFitStatus::not_determined;
    return failed(open ? PoseOnlyStatus::not_determined : PoseOnlyStatus::not_converged,
                  open ? "the points leave a direction of the camera's pose open"
                       : "no pose of the camera explains the points");
  }
  result.alternatives = std::move(fits.alternatives);
  WrongPoints wrong;
  wrong.agree = true;
  wrong.fit = std::move(fits.best);
  if (problem.reject_wrong_points) wrong = remove_wrong_points(std::move(wrong.fit), used, options);
  // Features in mm and pixels are weighted right once the pixels' sigma is known.
  const double found_px = sigma_of_fit(wrong.fit, options);
  if (problem.sigma_px == 0 && found_px > 0 && !problem.features.empty()) {
    scale_px = found_px;
    PointFit again = fit_points(*equations_at(problem, scale_px, pose_of(wrong.fit)), used);
    if (again.status == PointFitStatus::ok) wrong.fit = std::move(again);
  }
  result.status = PoseOnlyStatus::ok;
  result.X_WC = pose_of(wrong.fit);
  result.sigma_px = found_px > 0 ? found_px : assumed_sigma_px;
  result.covariance = result.sigma_px * result.sigma_px * wrong.fit.inverse_N;
  result.redundancy = wrong.fit.redundancy;
  result.condition = wrong.fit.condition;
  result.removed = wrong.removed;
  fill_deviations(problem, used, result);
  judge_precision(problem, result);
  judge_agreement(wrong, result);
  if (result.status == PoseOnlyStatus::ok && fits.undecided) {
    result.status = PoseOnlyStatus::ambiguous;
    result.reason = number(result.alternatives.size() + 1) + " different poses explain the " +
                    number(problem.points.size()) + " points equally well";
  }
  return result;
}

}  // namespace zeropose
