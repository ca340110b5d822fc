#include "daemon/cli/robot_report.h"

#include <algorithm>
#include <cmath>

#include "calib/eccentricity.h"
#include "calib/words.h"
#include "config/svg.h"
#include "config/text.h"

namespace zeropose::cli {
namespace {

bool holds(const std::vector<std::size_t>& list, std::size_t i) {
  return std::ranges::find(list, i) != list.end();
}

std::string mm_text(double value, int decimals = 3) { return concat({fixed_text(value, decimals), " mm"}); }
std::string deg_text(double value) { return concat({fixed_text(value, 4), " deg"}); }
std::string px_text(double value) { return concat({fixed_text(value, 3), " px"}); }

std::string share_text(std::size_t used, std::size_t all) {
  return concat({std::to_string(used), " of ", std::to_string(all)});
}

ReportList::Row touch_row(const HandPose& touch, const Eigen::Vector3d& residual_mm, bool used) {
  return {{touch.name, fixed_text(residual_mm.x(), 3), fixed_text(residual_mm.y(), 3),
           fixed_text(residual_mm.z(), 3), fixed_text(residual_mm.norm(), 3),
           used ? "" : "left out: it contradicts the others"},
          used};
}

void add_touches(std::span<const HandPose> touches, const ToolResult& result, FitReport& report) {
  report.list = {
      "Touches",
      "By how much each misses the fixed point, along the base's axes. Red: left out.",
      {{"touch", 0, true}, {"x mm", 45}, {"y mm", 60}, {"z mm", 75}, {"distance mm", 95}, {"", 102, true}},
      {},
      1,
      ReportSheet::inner};
  ErrorPlot plot{"Distance of each touch from the fixed point, mm", {}};
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const bool used = !holds(result.removed, i);
    const double distance_mm = result.residuals_mm[i].norm();
    plot.bars.push_back({touches[i].name, distance_mm, used});
    report.list.rows.push_back(touch_row(touches[i], result.residuals_mm[i], used));
    if (!used)
      report.findings.push_back(
          {Quality::usable,
           concat({"touch ", touches[i].name, " was left out: it misses the point of the others by ",
                   mm_text(distance_mm)})});
  }
  report.errors = {std::move(plot)};
}

}  // namespace

FitReport tool_report(std::span<const HandPose> touches, const ToolResult& result,
                      const std::optional<Eigen::Vector3d>& active_mm, const std::string& source) {
  FitReport report;
  const std::size_t used = touches.size() - result.removed.size();
  report.title = "Tool calibration";
  report.source = source;
  report.summary = concat({"The tool's end: ", share_text(used, touches.size()), " touches fit within ",
                           mm_text(result.rms_mm), " RMS."});
  report.findings.push_back(
      {Quality::good, concat({std::to_string(result.redundancy), " equations more than unknowns"})});
  report.result = {"p_HT, the tool's end in the hand",
                   place_rows(result.p_HT_mm, result.covariance, active_mm), ""};
  report.beside = {"The fixed point in the robot's base", place_rows(result.p_RT_mm, result.covariance_RT),
                   ""};
  report.facts = {{"touches used", share_text(used, touches.size())},
                  {"RMS distance", mm_text(result.rms_mm)},
                  {"noise of a coordinate (1 sigma)", mm_text(result.sigma_mm)},
                  {"against the active one",
                   active_mm ? mm_text((result.p_HT_mm - *active_mm).norm()) : "none was given"}};
  std::vector<Pose> X_RH;
  for (const HandPose& touch : touches) X_RH.push_back(touch.X_RH);
  report.turns = hand_turns(X_RH, result.removed);
  add_touches(touches, result, report);
  add_warnings(report, result.warnings);
  return report;
}

namespace {

Pose board_in_camera(const HandEyeProblem& problem, const HandEyeResult& result, const Pose& X_RH) {
  const Pose X_FG = problem.setup == HandEyeSetup::eye_in_hand ? X_RH.inverse() : X_RH;
  return result.X_FC.inverse() * X_FG * result.X_GB;
}

CalibrationDeviation deviation_of(const CameraModel& model, const Pose& X_CB, const CalibrationPoint& point) {
  CalibrationDeviation deviation;
  const Eigen::Vector3d p_C = X_CB * point.p_W_mm;
  deviation.depth_mm = p_C.z();
  const auto u_px = project(model, p_C);
  if (!u_px) return deviation;
  deviation.dev_px =
      point.u_px - *u_px -
      ellipse_centre_offset(model, p_C, X_CB.linear() * point.disc_normal_W, point.disc_radius_mm);
  deviation.dev_mm = deviation.dev_px.cwiseQuotient(Eigen::Vector2d(model.fx_px, model.fy_px)) * p_C.z();
  deviation.used = true;
  return deviation;
}

// All points from the joint estimate: the robot's error is in them.
ImageFit image_of(const HandEyeProblem& problem, const HandEyeResult& result) {
  ImageFit image;
  image.model = problem.model;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const HandEyeView& view = problem.views[v];
    const HandEyeViewResult& found = result.views[v];
    if (found.points_used == 0) continue;
    const Pose X_CB = board_in_camera(problem, result, view.X_RH);
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      CalibrationDeviation deviation = deviation_of(problem.model, X_CB, view.points[i]);
      deviation.used = deviation.used && found.used && !holds(found.points_removed, i);
      image.points.push_back(view.points[i]);
      image.deviations.push_back(deviation);
      image.names.push_back(concat({view.name, " ", std::to_string(i + 1)}));
    }
  }
  return image;
}

std::string finite_text(double value, int decimals) {
  return std::isfinite(value) ? fixed_text(value, decimals) : "-";
}

void add_views(const HandEyeProblem& problem, const HandEyeResult& result, FitReport& report) {
  report.list = {"Views",
                 "Where a view alone puts the board beside where robot and answer put it. Red: left out.",
                 {{"view", 0, true},
                  {"error mm", 45},
                  {"error deg", 62},
                  {"RMS px", 77},
                  {"points", 92},
                  {"", 98, true}},
                 {},
                 1,
                 ReportSheet::inner};
  ErrorPlot mm{"Error of each view, mm", {}}, deg{"Error of each view, deg", {}};
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    const HandEyeViewResult& view = result.views[v];
    const std::string& name = problem.views[v].name;
    const bool found = view.points_used > 0;
    mm.bars.push_back({name, view.error_mm, view.used});
    deg.bars.push_back({name, view.error_deg, view.used});
    report.list.rows.push_back({{name, finite_text(view.error_mm, 3), finite_text(view.error_deg, 4),
                                 found ? finite_text(view.rms_px, 3) : "-",
                                 share_text(view.points_used, problem.views[v].points.size()),
                                 view.used ? "" : "left out: " + view.reason},
                                view.used});
    if (!view.used)
      report.findings.push_back({Quality::usable, concat({"view ", name, " was left out: ", view.reason})});
    else if (!view.points_removed.empty())
      report.findings.push_back(
          {Quality::usable, concat({std::to_string(view.points_removed.size()), " points of view ", name,
                                    " were left out: they contradict the others"})});
  }
  report.errors = {std::move(mm), std::move(deg)};
}

void add_turns(const HandEyeProblem& problem, const HandEyeResult& result, FitReport& report) {
  std::vector<Pose> X_RH;
  std::vector<std::size_t> unused;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    X_RH.push_back(problem.views[v].X_RH);
    if (!result.views[v].used) unused.push_back(v);
  }
  report.turns = hand_turns(X_RH, unused);
}

std::vector<std::pair<std::string, std::string>> hand_eye_facts(const HandEyeProblem& problem,
                                                                const HandEyeResult& result,
                                                                const std::optional<Pose>& active) {
  const auto change = change_facts(result.X_FC, active);
  const char* source = problem.robot_sigma_mm > 0 ? "given" : "estimated";
  std::vector<std::pair<std::string, std::string>> facts{
      {"RMS error of the views", mm_text(result.rms_mm)},
      {"", deg_text(result.rms_deg)},
      {"RMS of the points", px_text(result.rms_px)},
      {"noise of a pixel (1 sigma)", px_text(result.sigma_px)},
      {concat({"noise of the robot, ", source}), mm_text(result.robot_sigma_mm)},
      {"", deg_text(result.robot_sigma_deg)},
      {"scale of the board", concat({fixed_text(result.scale, 5), " ± ", fixed_text(result.scale_sigma, 5)})},
      {"covariances enlarged by", fixed_text(result.few_views_factor, 2)}};
  facts.insert(facts.end(), change.begin(), change.end());
  return facts;
}

}  // namespace

FitReport hand_eye_report(const HandEyeProblem& problem, const HandEyeResult& result,
                          const std::optional<Pose>& active, const std::string& source) {
  const bool in_hand = problem.setup == HandEyeSetup::eye_in_hand;
  const auto used = static_cast<std::size_t>(std::ranges::count_if(result.views, &HandEyeViewResult::used));
  FitReport report;
  report.title =
      in_hand ? "Hand-eye calibration: camera on the hand" : "Hand-eye calibration: camera beside the robot";
  report.source = source;
  report.summary = concat({share_text(used, result.views.size()), " views agree within ",
                           mm_text(result.rms_mm), " and ", deg_text(result.rms_deg), " RMS."});
  report.findings.push_back(
      {Quality::good, concat({std::to_string(result.redundancy), " equations more than unknowns"})});
  report.result = {in_hand ? "X_HC, the camera in the hand" : "X_RC, the camera in the robot's base",
                   pose_rows(result.X_FC, result.covariance_FC, active), ""};
  report.beside = {in_hand ? "X_RB, the board in the robot's base" : "X_HB, the board in the hand",
                   pose_rows(result.X_GB, result.covariance_GB),
                   "1 sigma: along and about the axes of the frame that the pose is given in."};
  report.facts = hand_eye_facts(problem, result, active);
  add_turns(problem, result, report);
  add_views(problem, result, report);
  report.images = {image_of(problem, result)};
  add_warnings(report, result.warnings);
  return report;
}

}  // namespace zeropose::cli
