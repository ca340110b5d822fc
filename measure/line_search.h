// Straight edges in a window: points of steepest slope, lines by a vote, what of them is seen. Internal to
// the room.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/contour_fit.h"

namespace zeropose {

// The coarse place of a straight edge: good to about half a pixel. Coordinates: column and row in the window.
struct EdgeLine {
  double normal_rad = 0;              // from dark to bright
  double offset_px = 0;               // normal . x
  double t0 = 0, t1 = 0;              // seen from there to there along (-sin, cos) of the normal, px
  bool open0 = false, open1 = false;  // the window ends there, not the edge
  double contrast = 0;                // grey levels, median

  Eigen::Vector2d normal() const { return {std::cos(normal_rad), std::sin(normal_rad)}; }
  Eigen::Vector2d along() const { return {-std::sin(normal_rad), std::cos(normal_rad)}; }
  Eigen::Vector2d point(double t) const { return offset_px * normal() + t * along(); }
  double length() const { return t1 - t0; }
  double strength() const { return contrast * length(); }
};

struct LineLimits {
  double min_contrast = 15, max_blur_px = 3;
  double direction_rad = 0, tolerance_rad = 4;  // of the normal; pi or more: any
  double min_length_px = 6;
  std::size_t most = 12;
  bool all_pieces = false;  // that lie on one straight line; else the longest of them
};

// The strongest first (votes weigh slope, so contrast and length both count); at most limits.most.
std::vector<EdgeLine> find_lines(const GreyWindow& window, const LineLimits& limits);

// Bilinear. Precondition: 0 <= x <= width - 1, 0 <= y <= height - 1.
double grey_between(const GreyWindow& window, const Eigen::Vector2d& at);
bool holds(const GreyWindow& window, const Eigen::Vector2d& at, double margin_px);

// The longest piece of a row of yes and no where yes prevails two to one: first and last index, or an empty
// one (last < first).
struct SeenRun {
  int first = 0, last = -1;
};
SeenRun longest_run(const std::vector<bool>& seen);

double wrapped_rad(double angle_rad);  // to -pi..pi

}  // namespace zeropose
