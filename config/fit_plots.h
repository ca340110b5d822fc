// The plots of what a robot or a measuring system gave: one error per view, touch or point, and how the hand
// was turned.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"
#include "config/plot_parts.h"

namespace zeropose {

struct ErrorBar {
  std::string name;
  double value = 0;
  bool used = true;  // else red; longer than the plot where it is far beyond the others
};

// The names stand below, as many as there is room for.
void draw_error_bars(Svg& svg, const PlotFrame& frame, std::string_view title,
                     std::span<const ErrorBar> bars);

// A pose of the hand by its turn from the mean orientation, about the hand's axes.
struct HandTurn {
  Eigen::Vector3d about_H_deg = Eigen::Vector3d::Zero();
  bool used = true;
};
std::vector<HandTurn> hand_turns(std::span<const Pose> X_RH, std::span<const std::size_t> unused);

// One lane per axis, a dot per pose.
void draw_turns(Svg& svg, const PlotFrame& frame, std::span<const HandTurn> turns);

}  // namespace zeropose
