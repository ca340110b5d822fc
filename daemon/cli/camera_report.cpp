#include "daemon/cli/camera_report.h"

#include <algorithm>
#include <sstream>

#include "config/text.h"

namespace zeropose::cli {
namespace {

std::string name_of_point(const RecalibrationPoint& point) {
  return point.group.empty() ? point.name : concat({point.group, "/", point.name});
}

// A translation that was neglected is held.
std::vector<ValueRow> pose_in_world(const RecalibrationProblem& problem, const RecalibrationResult& result) {
  std::vector<ValueRow> rows = pose_rows(result.X_WCn, result.covariance, problem.X_WCo);
  for (std::size_t i = 0; i < 3 && !result.translation_known; ++i) rows[i].sigma = -1;
  return rows;
}

void add_points(const RecalibrationProblem& problem, const RecalibrationResult& result, FitReport& report) {
  report.list = {"Points",
                 "Found after the movement minus expected. Red: left out, it moved itself.",
                 {{"point", 0, true}, {"u px", 60}, {"v px", 80}, {"dev u px", 105}, {"dev v px", 130}},
                 {},
                 1,
                 ReportSheet::inner};
  ErrorPlot plot{"Deviation of each point after the movement, px", {}};
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const RecalibrationPoint& point = problem.points[i];
    const RecalibrationDeviation& deviation = result.deviations[i];
    const std::string name = name_of_point(point);
    report.list.rows.push_back({{name, fixed_text(point.new_px.x(), 2), fixed_text(point.new_px.y(), 2),
                                 fixed_text(deviation.new_px.x(), 3), fixed_text(deviation.new_px.y(), 3)},
                                deviation.used});
    plot.bars.push_back({name, deviation.new_px.norm(), deviation.used});
    if (!deviation.used)
      report.findings.push_back(
          {Quality::usable, concat({"point ", name, " was left out: it moved itself, by ",
                                    fixed_text(deviation.new_px.norm(), 2), " px"})});
  }
  report.errors = {std::move(plot)};
}

}  // namespace

FitReport recalibration_report(const RecalibrationProblem& problem, const RecalibrationResult& result,
                               const std::string& camera, const std::string& source) {
  FitReport report;
  const std::size_t all = problem.points.size();
  report.title = concat({"Moved camera", camera.empty() ? "" : " ", camera});
  report.source = source;
  report.summary = concat({std::to_string(all - result.removed.size()), " of ", std::to_string(all),
                           " points fit within ", fixed_text(result.rms_px, 3), " px RMS."});
  report.findings = {{result.redundancy > 0 ? Quality::good : Quality::usable,
                      concat({std::to_string(result.redundancy), " equations more than unknowns",
                              result.redundancy > 0 ? "" : ": nothing would show a wrong point"})}};
  report.result = {
      "X_WC, the camera now beside where it was calibrated", pose_in_world(problem, result),
      result.translation_known
          ? "1 sigma: along and about the world's axes."
          : "1 sigma: about the world's axes. The translation is neglected: points without coordinates."};
  report.facts = {{"method", std::string(name_of(problem.method))},
                  {"noise of a pixel (1 sigma)", concat({fixed_text(result.sigma_px, 3), " px"})}};
  for (auto& fact : change_facts(result.X_WCn, problem.X_WCo)) report.facts.push_back(std::move(fact));
  add_points(problem, result, report);
  add_warnings(report, result.warnings);
  return report;
}

FitReport vanishing_report(const VanishingResult& result, std::span<const RectangleLine> images,
                           const std::string& source) {
  FitReport report;
  report.title = "Camera from vanishing points";
  report.source = source;
  report.summary = concat({std::to_string(result.used.size()), " images of the rectangle were used."});
  std::ostringstream condition;
  condition << result.condition;
  report.findings = {{Quality::usable, "a quick look: without distortion, and without sigmas"}};
  report.result = {"Internals",
                   {{"fx px", 2, result.fx_px, -1, std::nullopt, 0},
                    {"fy px", 2, result.fy_px, -1, std::nullopt, 0},
                    {"cx px", 2, result.cx_px, -1, std::nullopt, 0},
                    {"cy px", 2, result.cy_px, -1, std::nullopt, 0}},
                   "This method gives no sigmas; a circle board does (calibrate views)."};
  report.facts = {{"images used", std::to_string(result.used.size())},
                  {"condition of the equations", condition.str()}};
  report.list = {"Images",
                 "Side ratio as this camera sees it, and how far the corners are off. Red: skipped.",
                 {{"image", 0, true}, {"ratio", 45}, {"RMS px", 65}, {"", 70, true}},
                 {},
                 1,
                 ReportSheet::inner};
  ErrorPlot plot{"How far the four corners are off, RMS px", {}};
  for (const RectangleLine& image : images) {
    const bool used = image.skipped.empty();
    const bool placed = used && image.ratio_seen > 0;
    report.list.rows.push_back({{image.name, placed ? fixed_text(image.ratio_seen, 4) : "",
                                 placed ? fixed_text(image.rms_px, 3) : "", image.skipped},
                                used});
    if (placed) plot.bars.push_back({image.name, image.rms_px, true});
  }
  if (!plot.bars.empty()) report.errors = {std::move(plot)};
  add_warnings(report, {});
  return report;
}

}  // namespace zeropose::cli
