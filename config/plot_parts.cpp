#include "config/plot_parts.h"

#include <algorithm>
#include <cmath>

#include "config/text.h"

namespace zeropose::plot {

using Eigen::Vector2d;

// 1, 2 or 5 times a power of ten, at most `value`.
double nice_below(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double digit : {5., 2., 1.})
    if (digit * power <= value * (1 + 1e-12)) return digit * power;
  return power;
}

// As many digits as a step of this size needs.
std::string step_text(double value, double step) {
  return fixed_text(value, step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
}

void draw_box(Svg& svg, const PlotFrame& frame, std::string_view title) {
  svg.text(frame.x, frame.y - 2, title, {.size_mm = 3.2, .bold = true});
  svg.rectangle(frame.x, frame.y, frame.width, frame.height, {.fill = pale, .stroke = grey});
}

// Ticks with numbers below the frame.
void draw_x_axis(Svg& svg, const PlotFrame& frame, double low, double high, std::string_view label) {
  const double step = nice_below((high - low) / 3.5);
  for (double value = std::ceil(low / step) * step; value <= high + 1e-9 * step; value += step) {
    const double x = frame.x + (value - low) / (high - low) * frame.width;
    svg.line(x, frame.y + frame.height, x, frame.y + frame.height + 1, {.stroke = grey});
    svg.text(x, frame.y + frame.height + 3.6, step_text(value, step),
             {.size_mm = 2.4, .colour = dark, .anchor = "middle"});
  }
  svg.text(frame.x + frame.width / 2, frame.y + frame.height + 7, label,
           {.size_mm = 2.4, .colour = dark, .anchor = "middle"});
}

void draw_y_axis(Svg& svg, const PlotFrame& frame, double low, double high, bool downwards,
                 double least_step) {
  const double step = std::max(least_step, nice_below(std::abs(high - low) / 3));
  for (double value = std::ceil(low / step) * step; value <= high; value += step) {
    const double share = (value - low) / (high - low);
    const double y = frame.y + (downwards ? share : 1 - share) * frame.height;
    svg.line(frame.x - 1, y, frame.x, y, {.stroke = grey});
    svg.text(frame.x - 1.5, y + 0.9, step_text(value, step),
             {.size_mm = 2.4, .colour = dark, .anchor = "end"});
  }
}

int Bins::most() const { return counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end()); }

Bins bins_of(const std::vector<double>& values, double low, double high, std::size_t count) {
  Bins bins{low, high, std::vector<int>(count)};
  for (const double value : values) {
    const double place = (value - low) / (high - low) * static_cast<double>(count);
    ++bins.counts[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(count) - 1))];
  }
  return bins;
}

void draw_bars(Svg& svg, const PlotFrame& frame, const Bins& bins, double top) {
  const double width = frame.width / static_cast<double>(bins.counts.size());
  for (std::size_t i = 0; i < bins.counts.size(); ++i) {
    const double height = bins.counts[i] / top * frame.height;
    if (height > 0)
      svg.rectangle(frame.x + width * static_cast<double>(i), frame.y + frame.height - height, width, height,
                    {.fill = "#9dbfe3", .stroke = "#ffffff", .width_mm = 0.15});
  }
  draw_y_axis(svg, frame, 0, top, false, 1);
}

void draw_arrow(Svg& svg, const Vector2d& from, const Vector2d& vector, std::string_view colour) {
  const Vector2d to = from + vector;
  const double length = vector.norm();
  svg.line(from.x(), from.y(), to.x(), to.y(), {.stroke = colour, .width_mm = 0.25});
  if (length < 0.3) return;
  const Vector2d along = vector / length * std::min(1.1, length / 2), across(-along.y(), along.x());
  const Vector2d head[3] = {to, to - along + 0.4 * across, to - along - 0.4 * across};
  svg.polygon(head, {.fill = colour});
}

}  // namespace zeropose::plot
