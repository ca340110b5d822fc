#include "daemon/cli/place_report.h"

#include <algorithm>

#include "config/svg.h"
#include "config/text.h"

namespace zeropose::cli {
namespace {

std::string mm_text(double value) { return concat({fixed_text(value, 3), " mm"}); }

Finding redundancy_finding(int redundancy) {
  return {redundancy > 0 ? Quality::good : Quality::usable,
          concat({std::to_string(redundancy), " equations more than unknowns",
                  redundancy > 0 ? "" : ": nothing would show a wrong point"})};
}

std::vector<std::string> place_cells(const std::string& name, const Eigen::Vector3d& residual_mm) {
  return {name, fixed_text(residual_mm.x(), 3), fixed_text(residual_mm.y(), 3),
          fixed_text(residual_mm.z(), 3), fixed_text(residual_mm.norm(), 3)};
}

void add_features(const PoseOnlyResult& result, FitReport& report) {
  if (result.feature_deviations_mm.empty()) return;
  report.list = {"Points on the housing",
                 "Measured minus where the pose puts them, along the world's axes.",
                 {{"feature", 0, true}, {"x mm", 45}, {"y mm", 60}, {"z mm", 75}, {"distance mm", 95}},
                 {},
                 1,
                 ReportSheet::inner};
  ErrorPlot plot{"Deviation of each point on the housing, mm", {}};
  for (std::size_t i = 0; i < result.feature_deviations_mm.size(); ++i) {
    const std::string name = std::to_string(i + 1);
    report.list.rows.push_back({place_cells(name, result.feature_deviations_mm[i]), true});
    plot.bars.push_back({name, result.feature_deviations_mm[i].norm(), true});
  }
  report.errors = {std::move(plot)};
}

}  // namespace

FitReport pose_report(const PoseOnlyProblem& problem, const PoseOnlyResult& result,
                      const std::optional<Pose>& active, const std::string& source) {
  FitReport report;
  const std::size_t all = problem.points.size();
  report.title = "Pose of a camera";
  report.source = source;
  report.summary = all == 0
                       ? "The pose from points on the housing alone."
                       : concat({std::to_string(all - result.removed.size()), " of ", std::to_string(all),
                                 " points fit within ", fixed_text(result.rms_px, 3), " px RMS."});
  report.findings = {redundancy_finding(result.redundancy)};
  for (const std::size_t i : result.removed)
    report.findings.push_back(
        {Quality::usable,
         concat({"point ", std::to_string(i + 1), " was left out: it contradicts the others, by ",
                 fixed_text(result.deviations[i].dev_px.norm(), 2), " px"})});
  report.result = {"X_WC, the camera in the world", pose_rows(result.X_WC, result.covariance, active),
                   "1 sigma: along and about the world's axes."};
  if (all > 0)
    report.facts = {{"RMS of the points", concat({fixed_text(result.rms_px, 3), " px"})},
                    {"noise of a pixel (1 sigma)", concat({fixed_text(result.sigma_px, 3), " px"})}};
  for (auto& fact : change_facts(result.X_WC, active)) report.facts.push_back(std::move(fact));
  add_features(result, report);
  if (all > 0)
    report.images = {
        ImageFit{"", problem.model, {problem.points.begin(), problem.points.end()}, result.deviations, {}}};
  add_warnings(report, {});
  return report;
}

namespace {

std::string name_of(const SensorProblem& problem, const SensorSighting& sighting) {
  return concat({problem.points[sighting.point].name, sighting.view.empty() ? "" : " ", sighting.view});
}

void add_sightings(const SensorProblem& problem, const SensorResult& result, FitReport& report) {
  report.list = {"Points",
                 "Known minus where the sensor and its pose put them. Red: left out.",
                 {{"point, view", 0, true},
                  {"x mm", 45},
                  {"y mm", 60},
                  {"z mm", 75},
                  {"distance mm", 95},
                  {"ray gap mm", 113},
                  {"", 119, true}},
                 {},
                 1,
                 ReportSheet::inner};
  ErrorPlot plot{"Deviation of each point, mm", {}};
  for (std::size_t i = 0; i < problem.sightings.size(); ++i) {
    const SensorSighting& sighting = problem.sightings[i];
    const bool used = std::ranges::find(result.fit.removed, i) == result.fit.removed.end();
    const std::string name = name_of(problem, sighting);
    const Eigen::Vector3d& residual_mm = result.fit.residuals_mm[i];
    ReportList::Row row{place_cells(name, residual_mm), used};
    row.cells.push_back(fixed_text(result.places[i].ray_gap_mm, 3));
    row.cells.emplace_back(used ? "" : "left out: it contradicts the others");
    report.list.rows.push_back(std::move(row));
    plot.bars.push_back({name, residual_mm.norm(), used});
    if (!used)
      report.findings.push_back(
          {Quality::usable, concat({"point ", name, " was left out: it contradicts the others, by ",
                                    mm_text(residual_mm.norm())})});
  }
  report.errors = {std::move(plot)};
}

// What one camera saw, beside where the sensor put the points.
ImageFit image_of(const SensorProblem& problem, const SensorResult& result, std::size_t camera) {
  ImageFit image;
  image.camera = problem.cameras[camera].name;
  image.model = problem.cameras[camera].model;
  const Pose X_CS = problem.cameras[camera].X_WC.inverse();
  const Eigen::Vector2d focal_px(image.model.fx_px, image.model.fy_px);
  for (std::size_t i = 0; i < problem.sightings.size(); ++i) {
    const SensorSighting& sighting = problem.sightings[i];
    for (std::size_t k = 0; k < sighting.observations.size(); ++k) {
      if (sighting.observations[k].camera != camera) continue;
      const double depth_mm = (X_CS * result.places[i].p_W_mm).z();
      const Eigen::Vector2d& dev_px = result.places[i].deviations_px[k];
      CalibrationPoint point;
      point.u_px = sighting.observations[k].u_px;
      image.points.push_back(point);
      image.deviations.push_back({dev_px, dev_px.cwiseQuotient(focal_px) * depth_mm, depth_mm,
                                  std::ranges::find(result.fit.removed, i) == result.fit.removed.end()});
      image.names.push_back(name_of(problem, sighting));
    }
  }
  return image;
}

}  // namespace

FitReport sensor_report(const SensorProblem& problem, const SensorResult& result, const std::string& pose,
                        const std::optional<Pose>& active, const std::string& source) {
  FitReport report;
  const std::size_t all = problem.sightings.size();
  report.title = pose == "X_HS" ? "Stereo sensor on a hand" : "Stereo sensor in the world";
  report.source = source;
  report.summary = concat({std::to_string(all - result.fit.removed.size()), " of ", std::to_string(all),
                           " points fit within ", mm_text(result.fit.rms_mm), " RMS."});
  report.findings = {redundancy_finding(result.fit.redundancy)};
  report.result = {concat({pose, ", the sensor in the ", pose == "X_HS" ? "hand" : "world"}),
                   pose_rows(result.fit.X_AB, result.fit.covariance, active),
                   "1 sigma: along and about the axes of the outer frame."};
  report.facts = {{"RMS distance", mm_text(result.fit.rms_mm)}};
  for (auto& fact : change_facts(result.fit.X_AB, active)) report.facts.push_back(std::move(fact));
  add_sightings(problem, result, report);
  for (std::size_t camera = 0; camera < problem.cameras.size(); ++camera)
    report.images.push_back(image_of(problem, result, camera));
  add_warnings(report, {});
  return report;
}

}  // namespace zeropose::cli
