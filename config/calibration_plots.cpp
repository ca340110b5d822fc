#include "config/calibration_plots.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "config/plot_parts.h"
#include "config/text.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using namespace plot;

// The largest deviation of the used points that arrows are scaled to: rejected ones may leave the frame.
double typical_largest_px(const CalibrationResult& result) {
  std::vector<double> sizes;
  for (const auto& deviation : result.deviations)
    if (deviation.used) sizes.push_back(deviation.dev_px.norm());
  if (sizes.empty()) return 1;
  const auto place = static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + place, sizes.end());
  return std::max(sizes[static_cast<std::size_t>(place)], 1e-9);
}

Vector2d on_page(const PlotFrame& frame, const CalibrationProblem& problem, const Vector2d& u_px) {
  return {frame.x + (u_px.x() + 0.5) / problem.width_px * frame.width,
          frame.y + (u_px.y() + 0.5) / problem.height_px * frame.height};
}

void draw_image_axes(Svg& svg, const PlotFrame& frame, const CalibrationProblem& problem) {
  draw_x_axis(svg, frame, -0.5, problem.width_px - 0.5, "u, px");
  draw_y_axis(svg, frame, -0.5, problem.height_px - 0.5, true, 1);
  svg.text(frame.x - 9.6, frame.y + frame.height / 2, "v, px",
           {.size_mm = 2.4, .anchor = "middle", .turn_deg = -90});
}

}  // namespace

PlotFrame image_frame(const PlotFrame& frame, const CalibrationProblem& problem) {
  const double scale = std::min(frame.width / problem.width_px, frame.height / problem.height_px);
  return {frame.x, frame.y, problem.width_px * scale, problem.height_px * scale};
}

void draw_quiver(Svg& svg, const PlotFrame& outer, const CalibrationProblem& problem,
                 const CalibrationResult& result) {
  const PlotFrame frame = image_frame(outer, problem);
  draw_box(svg, frame, "Deviations over the image (found minus projected)");
  draw_image_axes(svg, frame, problem);
  const double mm_per_px = (problem.points.size() > 100 ? 4.5 : 7) / typical_largest_px(result);
  svg.begin_clip(frame.x, frame.y, frame.width, frame.height);
  const Vector2d origin = on_page(frame, problem, {result.model.cx_px, result.model.cy_px});
  svg.line(origin.x() - 2.5, origin.y(), origin.x() + 2.5, origin.y(), {.stroke = grey, .width_mm = 0.3});
  svg.line(origin.x(), origin.y() - 2.5, origin.x(), origin.y() + 2.5, {.stroke = grey, .width_mm = 0.3});
  for (std::size_t i = 0; i < std::min(problem.points.size(), result.deviations.size()); ++i) {
    const CalibrationDeviation& deviation = result.deviations[i];
    const Vector2d place = on_page(frame, problem, problem.points[i].u_px);
    const std::string_view colour = deviation.used ? blue : red;
    svg.circle(place.x(), place.y(), 0.45, {.fill = colour});
    if (!deviation.used) svg.circle(place.x(), place.y(), 1.5, {.stroke = red, .width_mm = 0.3});
    if (deviation.dev_px.allFinite()) draw_arrow(svg, place, deviation.dev_px * mm_per_px, colour);
  }
  svg.end_clip();
  // The scale stands right above the frame, outside of the data.
  const double legend_px = nice_below(12 / mm_per_px), length = legend_px * mm_per_px;
  const double right = frame.x + frame.width, y = frame.y + frame.height + 6.2;
  draw_arrow(svg, {right - length, y}, {length, 0}, blue);
  svg.text(right - length - 1.5, y + 0.9, concat({step_text(legend_px, legend_px), " px"}),
           {.size_mm = 2.4, .anchor = "end"});
  svg.line(frame.x - 1, y, frame.x + 1, y, {.stroke = grey, .width_mm = 0.3});
  svg.line(frame.x, y - 1, frame.x, y + 1, {.stroke = grey, .width_mm = 0.3});
  svg.text(frame.x + 2.2, y + 0.9, "image origin", {.size_mm = 2.4});
  if (std::any_of(result.deviations.begin(), result.deviations.end(), [](auto& d) { return !d.used; })) {
    svg.circle(frame.x + 22.5, y, 1.2, {.stroke = red, .width_mm = 0.3});
    svg.text(frame.x + 24.7, y + 0.9, "rejected", {.size_mm = 2.4});
  }
}

void draw_histogram(Svg& svg, const PlotFrame& frame, const CalibrationResult& result) {
  std::vector<double> values;
  double sum = 0, largest = 0;
  for (const auto& deviation : result.deviations)
    for (const double value : {deviation.dev_px.x(), deviation.dev_px.y()})
      if (deviation.used) {
        values.push_back(value);
        sum += value * value;
        largest = std::max(largest, std::abs(value));
      }
  draw_box(svg, frame, "Histogram");
  if (values.empty()) return;
  const auto n = static_cast<double>(values.size());
  const double sigma = std::max(std::sqrt(sum / n), 1e-12), reach = std::max(largest, 3 * sigma) * 1.001;
  const std::size_t count = std::clamp<std::size_t>(2 * static_cast<std::size_t>(std::cbrt(n)) + 1, 7, 31);
  const Bins bins = bins_of(values, -reach, reach, count);
  const auto normal = [&](double value) {
    return n * (2 * reach / static_cast<double>(count)) * std::exp(-value * value / (2 * sigma * sigma)) /
           (sigma * std::sqrt(2 * std::numbers::pi));
  };
  const double top = 1.15 * std::max<double>(bins.most(), normal(0));
  draw_bars(svg, frame, bins, top);
  std::vector<Vector2d> curve;
  for (int i = 0; i <= 100; ++i) {
    const double value = reach * (i / 50.0 - 1);
    curve.emplace_back(frame.x + frame.width * i / 100, frame.y + frame.height * (1 - normal(value) / top));
  }
  svg.polyline(curve, {.stroke = blue, .width_mm = 0.35});
  draw_x_axis(svg, frame, -reach, reach, "deviation in u and in v, px");
  svg.text(frame.x + frame.width, frame.y - 2,
           concat({"RMS ", fixed_text(sigma, sigma < 0.01 ? 5 : 3), " px"}),
           {.size_mm = 2.6, .anchor = "end"});
}

void draw_depths(Svg& svg, const PlotFrame& frame, const CalibrationResult& result) {
  std::vector<double> depths;
  for (const auto& deviation : result.deviations)
    if (deviation.used) depths.push_back(deviation.depth_mm);
  draw_box(svg, frame, "Depth of the points");
  if (depths.empty()) return;
  const auto [low, high] = std::minmax_element(depths.begin(), depths.end());
  // At least a tenth of the distance is shown: a flat board looks flat.
  const double middle = (*low + *high) / 2, half = std::max(0.52 * (*high - *low), 0.05 * middle);
  const Bins bins = bins_of(depths, middle - half, middle + half, 24);
  draw_bars(svg, frame, bins, 1.15 * bins.most());
  draw_x_axis(svg, frame, middle - half, middle + half, "distance along the optical axis, mm");
}

void draw_coverage(Svg& svg, const PlotFrame& outer, const CalibrationProblem& problem,
                   const Coverage& coverage) {
  const PlotFrame frame = image_frame(outer, problem);
  draw_box(svg, frame, "Used points per cell of the image");
  const double width = frame.width / Coverage::columns, height = frame.height / Coverage::rows;
  const int most = std::max(1, *std::max_element(coverage.counts.begin(), coverage.counts.end()));
  for (int row = 0; row < Coverage::rows; ++row)
    for (int column = 0; column < Coverage::columns; ++column) {
      const int count = coverage.counts[static_cast<std::size_t>(row * Coverage::columns + column)];
      const double x = frame.x + column * width, y = frame.y + row * height;
      if (count > 0)
        svg.rectangle(x, y, width, height, {.fill = "#6aa3dc", .opacity = 0.25 + 0.65 * count / most});
      svg.rectangle(x, y, width, height, {.stroke = rule});
      svg.text(x + width / 2, y + height / 2 + 0.9, std::to_string(count),
               {.size_mm = 2.4, .colour = count > 0 ? dark : grey, .anchor = "middle"});
    }
  std::vector<Vector2d> hull;
  for (const Vector2d& u_px : coverage.hull_px) hull.push_back(on_page(frame, problem, u_px));
  svg.begin_clip(frame.x, frame.y, frame.width, frame.height);  // pixels outside of the image may be points
  svg.polygon(hull, {.stroke = blue, .width_mm = 0.35});
  svg.end_clip();
}

}  // namespace zeropose
