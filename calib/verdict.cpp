#include "calib/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/uncertainty.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;

// The limits of docs/calibration.md: good up to the first, usable up to the second.
struct Limit {
  double good, usable;
};
constexpr Limit noise_ratio{1.5, 3};   // RMS against what the stated noise leaves
constexpr Limit rms_px_limit{0.7, 3};  // where no noise is stated
constexpr Limit rejected_share{0.05, 0.2};
constexpr Limit origin_sigma_share{0.005, 0.05};  // of the image's width
constexpr Limit image_share{0.5, 0.1};            // of the hull, at least
constexpr Limit depth_share{0.1, 0};              // of the depth, at least
constexpr double strong_correlation = 0.99;
constexpr int few_redundant = 10;

Quality at_most(double value, Limit limit) {
  if (value <= limit.good) return Quality::good;
  return value <= limit.usable ? Quality::usable : Quality::not_usable;
}
Quality at_least(double value, Limit limit) {
  if (value >= limit.good) return Quality::good;
  return value >= limit.usable ? Quality::usable : Quality::not_usable;
}

std::string percent(double share) { return number(100 * share, 0) + " %"; }

std::size_t used_count(const CalibrationResult& result) {
  return static_cast<std::size_t>(std::count_if(result.deviations.begin(), result.deviations.end(),
                                                [](const auto& deviation) { return deviation.used; }));
}

int redundancy_of(const CalibrationResult& result) {
  return static_cast<int>(2 * used_count(result)) - static_cast<int>(result.uncertainty.parameters.size());
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Andrew's monotone chain.
std::vector<Vector2d> hull_of(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2d> hull;
  const auto add = [&hull](const Vector2d& point, std::size_t least) {
    while (hull.size() > least && cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0)
      hull.pop_back();
    hull.push_back(point);
  };
  for (const Vector2d& point : points) add(point, 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = points.size(); i-- > 1;) add(points[i - 1], lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

double area_of(const std::vector<Vector2d>& hull) {
  double twice = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) twice += cross(hull[i], hull[(i + 1) % hull.size()]);
  return std::abs(twice) / 2;
}

Finding judge_fit(const CalibrationProblem& problem, const CalibrationResult& result) {
  const std::string rms =
      std::string("the points fit within ").append(number(result.rms_px, 3)).append(" px RMS");
  if (!(problem.sigma_px > 0))
    return {at_most(result.rms_px, rms_px_limit), rms + "; the noise of the points was not stated"};
  // Of 2 n residuals of this variance the parameters take their share away.
  double variance = 0;
  for (std::size_t i = 0; i < std::min(problem.points.size(), result.deviations.size()); ++i)
    if (result.deviations[i].used) variance += problem.points[i].covariance_px2.trace() / 2;
  const double n = std::max(1.0, static_cast<double>(used_count(result)));
  const double noise_px = problem.sigma_px * std::sqrt(variance / n);
  const double expected_px = noise_px * std::sqrt(std::max(1, redundancy_of(result)) / n);
  const double ratio = result.rms_px / expected_px;
  return {at_most(ratio, noise_ratio), rms + ", " + number(ratio, 1) + " times what the stated noise of " +
                                           number(noise_px, 3) + " px leaves"};
}

Finding judge_redundancy(const CalibrationResult& result, int further_unknowns) {
  const int redundancy = redundancy_of(result) - further_unknowns;
  if (result.uncertainty.parameters.empty())
    return {Quality::usable, "without refinement there are no sigmas: nothing says how good the numbers are"};
  const std::string text =
      number(used_count(result)) + " points, " + number(redundancy) + " equations more than unknowns";
  if (redundancy >= few_redundant) return {Quality::good, text};
  return {Quality::usable, text + ": so few that the fit proves little"};
}

Finding judge_rejected(const CalibrationResult& result) {
  const std::size_t all = result.deviations.size(), rejected = all - used_count(result);
  if (rejected == 0) return {Quality::good, "no point was rejected"};
  const double share = static_cast<double>(rejected) / static_cast<double>(all);
  return {at_most(share, rejected_share),
          number(rejected) + " of " + number(all) + " points were rejected (" + percent(share) + ")"};
}

Finding judge_size(const CalibrationProblem& problem) {
  const auto outside = std::ranges::count_if(problem.points, [&](const CalibrationPoint& point) {
    return !in_image({problem.width_px, problem.height_px}, point.u_px);
  });
  if (outside == 0) return {};
  return {Quality::not_usable, number(static_cast<std::size_t>(outside)) +
                                   " pixels lie outside the image of " + number(problem.width_px) + " x " +
                                   number(problem.height_px) + ": is the size right?"};
}

Finding judge_image(const Coverage& coverage) {
  const Quality quality = at_least(coverage.area, image_share);
  std::string text = "the points cover " + percent(coverage.area) + " of the image and reach " +
                     percent(coverage.reach) + " of the way to the corner";
  if (quality != Quality::good) text += ": outside of them distortion is extrapolated";
  return {quality, text};
}

Finding judge_depth(const Coverage& coverage) {
  const Quality quality = at_least(coverage.depth_range(), depth_share);
  std::string text = "depth from " + number(coverage.depth_min_mm, 0) + " to " +
                     number(coverage.depth_max_mm, 0) + " mm (" + percent(coverage.depth_range()) + ")";
  if (quality != Quality::good) text += ": focal length and distance are hard to tell apart";
  return {quality, text};
}

Finding judge_origin(const CalibrationProblem& problem, const ReportedUncertainty& uncertainty) {
  const double sigma_px =
      std::max(sigma_of(uncertainty, Parameter::cx), sigma_of(uncertainty, Parameter::cy));
  if (uncertainty.parameters.empty()) return {Quality::good, ""};
  if (sigma_px < 0) return {Quality::usable, "the image origin was held, not estimated"};
  const Quality quality = at_most(sigma_px / problem.width_px, origin_sigma_share);
  std::string text = "image origin known to " + number(sigma_px, 2) + " px (1 sigma)";
  if (quality != Quality::good)
    text += ": the pose makes up for its error, so measure only where points were";
  return {quality, text};
}

// Strong correlations are normal (origin with rx ry, K with f); they say that parameters stand for each
// other.
Finding judge_correlations(const ReportedUncertainty& uncertainty) {
  std::string pairs;
  const auto& names = uncertainty.parameters;
  std::size_t count = 0;
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double value =
          uncertainty.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (std::abs(value) < strong_correlation || ++count > 4) continue;
      pairs.append(pairs.empty() ? "" : ", ").append(name_of(names[j])).append("-").append(name_of(names[i]));
    }
  if (count == 0) return {Quality::good, ""};
  if (count > 4) pairs += " and " + number(count - 4) + " more";
  return {Quality::good, "strongly correlated (use them together, not one by one): " + pairs};
}

std::string summary_of(Quality quality) {
  switch (quality) {
    case Quality::good:
      return "Good: fit, coverage and uncertainty are as they should be.";
    case Quality::usable:
      return "Usable within the region of the points; read the remarks before you accept it.";
    default:
      return "Not usable: do not activate it.";
  }
}

}  // namespace

std::string_view name_of(Quality quality) {
  constexpr std::array<std::string_view, 3> names{"not usable", "usable", "good"};
  return names[static_cast<std::size_t>(quality)];
}

Coverage coverage_of(const CalibrationProblem& problem, const CalibrationResult& result) {
  Coverage coverage;
  std::vector<Vector2d> used;
  double farthest_px = 0;
  const Vector2d origin(result.model.cx_px, result.model.cy_px);
  for (std::size_t i = 0; i < std::min(problem.points.size(), result.deviations.size()); ++i) {
    const CalibrationDeviation& deviation = result.deviations[i];
    if (!deviation.used) continue;
    const Vector2d& u_px = problem.points[i].u_px;
    coverage.depth_min_mm =
        used.empty() ? deviation.depth_mm : std::min(coverage.depth_min_mm, deviation.depth_mm);
    coverage.depth_max_mm =
        used.empty() ? deviation.depth_mm : std::max(coverage.depth_max_mm, deviation.depth_mm);
    farthest_px = std::max(farthest_px, (u_px - origin).norm());
    used.push_back(u_px);
    const int column = static_cast<int>((u_px.x() + 0.5) / problem.width_px * Coverage::columns);
    const int row = static_cast<int>((u_px.y() + 0.5) / problem.height_px * Coverage::rows);
    const int cell = std::clamp(row, 0, Coverage::rows - 1) * Coverage::columns +
                     std::clamp(column, 0, Coverage::columns - 1);
    ++coverage.counts[static_cast<std::size_t>(cell)];
  }
  coverage.hull_px = hull_of(used);
  coverage.area = area_of(coverage.hull_px) / (double(problem.width_px) * double(problem.height_px));
  const Vector2d corner =
      origin.cwiseAbs().cwiseMax((Vector2d(problem.width_px, problem.height_px) - origin).cwiseAbs());
  coverage.reach = farthest_px / corner.norm();
  return coverage;
}

CalibrationVerdict judge(const CalibrationProblem& problem, const CalibrationResult& result,
                         int further_unknowns) {
  CalibrationVerdict verdict;
  if (result.status != CalibrationStatus::ok) {
    verdict.summary = "Not usable: there is no result.";
    verdict.findings.push_back({Quality::not_usable, result.reason});
    return verdict;
  }
  const Coverage coverage = coverage_of(problem, result);
  const ReportedUncertainty uncertainty = reported_uncertainty(result.uncertainty, result.X_WC);
  std::array findings{judge_fit(problem, result),
                      judge_redundancy(result, further_unknowns),
                      judge_rejected(result),
                      judge_image(coverage),
                      judge_size(problem),
                      judge_depth(coverage),
                      judge_origin(problem, uncertainty),
                      judge_correlations(uncertainty)};
  for (Finding& finding : findings)
    if (!finding.text.empty()) verdict.findings.push_back(std::move(finding));
  std::stable_sort(verdict.findings.begin(), verdict.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.quality < b.quality; });
  verdict.quality = verdict.findings.front().quality;
  verdict.summary = summary_of(verdict.quality);
  return verdict;
}

}  // namespace zeropose
