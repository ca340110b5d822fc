#include "config/point_sections.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "config/calibration_plots.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::size_t most_listed = 1000;

std::vector<std::size_t> listed(const CalibrationProblem& problem, const CalibrationResult& result) {
  const auto& deviations = result.deviations;
  std::vector<std::size_t> order(std::min(deviations.size(), problem.points.size()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (order.size() <= most_listed) return order;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return deviations[a].dev_px.norm() > deviations[b].dev_px.norm();
  });
  order.resize(most_listed);
  return order;
}

ReportList::Row row_of(const std::string& name, const Eigen::Vector2d& u_px,
                       const CalibrationDeviation& deviation) {
  return {{name, fixed_text(u_px.x(), 2), fixed_text(u_px.y(), 2), fixed_text(deviation.dev_px.x(), 3),
           fixed_text(deviation.dev_px.y(), 3), fixed_text(deviation.dev_px.norm(), 3),
           fixed_text(deviation.dev_mm.x(), 3), fixed_text(deviation.dev_mm.y(), 3)},
          deviation.used};
}

}  // namespace

void draw_point_plots(ReportSheet& sheet, const CalibrationProblem& problem,
                      const CalibrationResult& result) {
  const double left = ReportSheet::margin + 10, right = ReportSheet::margin + 120,
               width = ReportSheet::right_end - right;
  const PlotFrame image = image_frame({left, sheet.y, 92, 74}, problem);
  draw_quiver(sheet.svg, image, problem, result);
  draw_histogram(sheet.svg, {right, sheet.y, width, 28}, result);
  draw_depths(sheet.svg, {right, sheet.y + 45, width, 20}, result);
  sheet.y += std::max(image.height, 65.0) + 17;
}

ReportList list_of_points(const CalibrationProblem& problem, const CalibrationResult& result,
                          std::span<const std::string> names) {
  const bool all = result.deviations.size() <= most_listed;
  ReportList list{all ? "Deviations of all points, found minus projected"
                      : "Deviations of the 1000 worst points, found minus projected",
                  "mm: at the point's distance. Red: rejected.",
                  {},
                  {},
                  2,
                  88};
  if (names.empty())
    list.columns = {{"no.", 6},       {"u px", 18},    {"v px", 30}, {"dev u px", 42},
                    {"dev v px", 54}, {"size px", 65}, {"u mm", 77}, {"v mm", 88}};
  else
    list.columns = {{"point", 0, true}, {"u px", 25},    {"v px", 36}, {"dev u px", 47},
                    {"dev v px", 58},   {"size px", 68}, {"u mm", 78}, {"v mm", 88}};
  for (const std::size_t i : listed(problem, result))
    list.rows.push_back(row_of(names.empty() ? std::to_string(i + 1) : names[i], problem.points[i].u_px,
                               result.deviations[i]));
  return list;
}

}  // namespace zeropose
