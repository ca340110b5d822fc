#include "config/fit_page.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/verdict.h"
#include "config/calibration_plots.h"
#include "config/point_sections.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr double margin = ReportSheet::margin, right = ReportSheet::right, right_end = ReportSheet::right_end;

void draw_table(ReportSheet& sheet, double x, const ValueTable& table) {
  if (table.rows.empty()) return;
  sheet.heading(x, table.title);
  sheet.values(x, table.rows);
  if (!table.note.empty()) sheet.note(x, table.note, x > margin ? 46 : 80, ReportSheet::soft, 2.3);
  sheet.y += 4;
}

void draw_facts(ReportSheet& sheet, const FitReport& report) {
  if (report.facts.empty()) return;
  sheet.heading(right, "Figures");
  for (const auto& [name, value] : report.facts) sheet.row({{right, name}, {right_end, value}});
}

void draw_tables(ReportSheet& sheet, const FitReport& report) {
  const double top = sheet.y;
  draw_table(sheet, margin, report.result);
  draw_table(sheet, margin, report.beside);
  const double left_end = sheet.y;
  sheet.y = top;
  draw_facts(sheet, report);
  sheet.y = std::max(sheet.y, left_end) + 7;
}

// Errors on the left, turns on the right.
void draw_errors(ReportSheet& sheet, const FitReport& report) {
  if (report.errors.empty() && report.turns.empty()) return;
  sheet.keep(45);
  const double top = sheet.y, x = margin + 120;
  for (const ErrorPlot& plot : report.errors) {
    draw_error_bars(sheet.svg, {margin + 10, sheet.y, 96, 28}, plot.title, plot.bars);
    sheet.y += 28 + 13;
  }
  if (report.turns.empty()) return;
  draw_turns(sheet.svg, {x, top, right_end - x, 28}, report.turns);
  sheet.y = std::max(sheet.y, top + 28 + 17);
}

void draw_image(ReportSheet& sheet, const ImageFit& image) {
  CalibrationProblem problem;
  problem.points = image.points;
  problem.width_px = image.model.width_px;
  problem.height_px = image.model.height_px;
  CalibrationResult result;
  result.status = CalibrationStatus::ok;
  result.model = image.model;
  result.deviations = image.deviations;
  sheet.keep(110);
  sheet.y += 4;
  if (!image.camera.empty()) {
    sheet.heading(margin, concat({"Camera ", image.camera}));
    sheet.y += 5;
  }
  draw_point_plots(sheet, problem, result);
  sheet.keep(44);
  const PlotFrame frame = image_frame({margin, sheet.y, 66, 42}, problem);
  const Coverage coverage = coverage_of(problem, result);
  draw_coverage(sheet.svg, frame, problem, coverage);
  const double bottom = sheet.y + frame.height;
  sheet.y -= 2;
  sheet.heading(margin + 76, "Coverage");
  sheet.note(margin + 76,
             concat({"The points that were used cover ", fixed_text(100 * coverage.area, 0),
                     " % of the image and reach ", fixed_text(100 * coverage.reach, 0),
                     " % of the way to the corner; depth from ", fixed_text(coverage.depth_min_mm, 0), " to ",
                     fixed_text(coverage.depth_max_mm, 0), " mm."}),
             68);
  sheet.y = std::max(sheet.y, bottom) + 12;
  sheet.list(list_of_points(problem, result, image.names));
}

}  // namespace

std::string fit_page(const FitReport& report) {
  ReportSheet sheet;
  sheet.title(report.title, report.source);
  Quality quality = Quality::good;
  for (const Finding& finding : report.findings) quality = std::min(quality, finding.quality);
  sheet.banner(quality, report.summary, report.findings);
  draw_tables(sheet, report);
  draw_errors(sheet, report);
  if (!report.list.rows.empty()) sheet.list(report.list);
  for (const ImageFit& image : report.images)
    if (!image.points.empty()) draw_image(sheet, image);
  return sheet.page();
}

std::vector<ValueRow> pose_rows(const Pose& X_AB, const Matrix6& covariance,
                                const std::optional<Pose>& active) {
  const auto numbers = [](const Pose& X) {
    const SixNumbers six = to_six_numbers(X);
    return std::array{six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
  };
  constexpr const char* names[] = {"x mm", "y mm", "z mm", "rx deg", "ry deg", "rz deg"};
  const auto values = numbers(X_AB);
  std::vector<ValueRow> rows;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const bool angle = i >= 3;
    rows.push_back({names[i], angle ? 4 : 3, values[i],
                    std::sqrt(covariance(k, k)) * (angle ? degrees_per_radian : 1), std::nullopt, 0});
    if (!active) continue;
    rows.back().active = numbers(*active)[i];
    const double difference = values[i] - *rows.back().active;
    rows.back().difference = angle ? std::remainder(difference, 360) : difference;
  }
  return rows;
}

std::vector<ValueRow> place_rows(const Eigen::Vector3d& p_mm, const Eigen::Matrix3d& covariance_mm2,
                                 const std::optional<Eigen::Vector3d>& active_mm) {
  constexpr const char* names[] = {"x mm", "y mm", "z mm"};
  std::vector<ValueRow> rows;
  for (int i = 0; i < 3; ++i) {
    rows.push_back({names[i], 3, p_mm[i], std::sqrt(covariance_mm2(i, i)), std::nullopt, 0});
    if (!active_mm) continue;
    rows.back().active = (*active_mm)[i];
    rows.back().difference = p_mm[i] - (*active_mm)[i];
  }
  return rows;
}

std::vector<std::pair<std::string, std::string>> change_facts(const Pose& X_AB,
                                                              const std::optional<Pose>& active) {
  if (!active) return {{"against the active one", "none was given"}};
  const Pose change = active->inverse() * X_AB;
  return {{"moved against the active one", concat({fixed_text(change.translation().norm(), 3), " mm"})},
          {"turned against it",
           concat({fixed_text(degrees_per_radian * log_so3(change.linear()).norm(), 4), " deg"})}};
}

void add_warnings(FitReport& report, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) report.findings.push_back({Quality::usable, warning});
  std::ranges::stable_sort(report.findings, {}, &Finding::quality);
}

}  // namespace zeropose
