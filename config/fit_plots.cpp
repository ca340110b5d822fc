#include "config/fit_plots.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string_view>

namespace zeropose {
namespace {

using namespace plot;

constexpr double letter_mm = 1.4;

// So that a wrong one, which is far larger, does not flatten the others.
double top_of(std::span<const ErrorBar> bars) {
  double used = 0, all = 0;
  for (const ErrorBar& bar : bars) {
    if (!std::isfinite(bar.value)) continue;
    all = std::max(all, bar.value);
    if (bar.used) used = std::max(used, bar.value);
  }
  return std::max(1.15 * (used > 0 ? std::min(all, 3 * used) : all), 1e-3);
}

// Every so many names are written.
std::size_t name_step(std::span<const ErrorBar> bars, double width_mm) {
  std::size_t letters = 1;
  for (const ErrorBar& bar : bars) letters = std::max(letters, bar.name.size());
  return static_cast<std::size_t>(std::ceil(static_cast<double>(letters + 1) * letter_mm / width_mm));
}

// The rotation nearest to the mean of the matrices.
Eigen::Matrix3d mean_rotation(std::span<const Pose> X_RH) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Pose& X : X_RH) sum += X.linear();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

void draw_error_bars(Svg& svg, const PlotFrame& frame, std::string_view title,
                     std::span<const ErrorBar> bars) {
  draw_box(svg, frame, title);
  if (bars.empty()) return;
  const double top = top_of(bars), width = frame.width / static_cast<double>(bars.size());
  const std::size_t step = name_step(bars, width);
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const double x = frame.x + width * static_cast<double>(i), bottom = frame.y + frame.height;
    const double value = std::isfinite(bars[i].value) ? std::min(bars[i].value, top) : 0;
    const double height = value / top * frame.height;
    svg.rectangle(x + 0.15 * width, bottom - height, 0.7 * width, height,
                  {.fill = bars[i].used ? bar : red, .opacity = bars[i].used ? 1 : 0.6});
    if (bars[i].value > top)
      svg.text(x + width / 2, frame.y + 3, step_text(bars[i].value, nice_below(top / 10)),
               {.size_mm = 2.3, .anchor = "middle"});
    if (i % step == 0)
      svg.text(x + width / 2, bottom + 3.4, bars[i].name, {.size_mm = 2.3, .anchor = "middle"});
  }
  draw_y_axis(svg, frame, 0, top, false, 0);
}

std::vector<HandTurn> hand_turns(std::span<const Pose> X_RH, std::span<const std::size_t> unused) {
  const Eigen::Matrix3d R_mean = mean_rotation(X_RH);
  std::vector<HandTurn> turns;
  for (std::size_t i = 0; i < X_RH.size(); ++i)
    turns.push_back({degrees_per_radian * log_so3(R_mean.transpose() * X_RH[i].linear()),
                     std::ranges::find(unused, i) == unused.end()});
  return turns;
}

void draw_turns(Svg& svg, const PlotFrame& frame, std::span<const HandTurn> turns) {
  draw_box(svg, frame, "Turns of the hand");
  double reach = 1;
  for (const HandTurn& turn : turns) reach = std::max(reach, 1.1 * turn.about_H_deg.cwiseAbs().maxCoeff());
  constexpr std::string_view axes[] = {"x", "y", "z"};
  const double lane = frame.height / 3;
  for (int axis = 0; axis < 3; ++axis) {
    const double y = frame.y + (axis + 0.5) * lane;
    svg.line(frame.x, y, frame.x + frame.width, y, {.stroke = rule});
    svg.text(frame.x - 1.5, y + 0.9, axes[axis], {.size_mm = 2.4, .anchor = "end"});
    for (const HandTurn& turn : turns)
      svg.circle(frame.x + (turn.about_H_deg[axis] / reach + 1) / 2 * frame.width, y, 0.8,
                 {.fill = turn.used ? blue : red, .opacity = 0.7});
  }
  draw_x_axis(svg, frame, -reach, reach, "from the mean, about the hand's axes, deg");
}

}  // namespace zeropose
