// What the plots of all reports are made of: frames, axes, bars, arrows, colours.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "config/svg.h"

namespace zeropose {

// Where a plot stands on the page: its title above, its axis below.
struct PlotFrame {
  double x = 0, y = 0, width = 0, height = 0;  // mm
};

namespace plot {

inline constexpr std::string_view blue = "#2463a8", red = "#c62828", grey = "#8a94a3", dark = "#1c2430",
                                  pale = "#f5f7fa", rule = "#dde2e9", bar = "#9dbfe3";

// 1, 2 or 5 times a power of ten, at most `value`.
double nice_below(double value);
// As many digits as a step of this size needs.
std::string step_text(double value, double step);

void draw_box(Svg& svg, const PlotFrame& frame, std::string_view title);
// Ticks with numbers below the frame.
void draw_x_axis(Svg& svg, const PlotFrame& frame, double low, double high, std::string_view label);
// Ticks with numbers left of it; least_step 1 for counts.
void draw_y_axis(Svg& svg, const PlotFrame& frame, double low, double high, bool downwards,
                 double least_step);
void draw_arrow(Svg& svg, const Eigen::Vector2d& from, const Eigen::Vector2d& vector,
                std::string_view colour);

struct Bins {
  double low = 0, high = 1;
  std::vector<int> counts;
  int most() const;
};
Bins bins_of(const std::vector<double>& values, double low, double high, std::size_t count);
// With the axis of the counts, up to `top`.
void draw_bars(Svg& svg, const PlotFrame& frame, const Bins& bins, double top);

}  // namespace plot
}  // namespace zeropose
