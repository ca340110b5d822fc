// What the marks with straight edges share: the window, the verdict on a fit, the choice among several.
// Internal to the room.
#pragma once

#include <optional>
#include <vector>

#include "measure/contour_fit.h"
#include "measure/line_search.h"
#include "measure/mark_sight.h"
#include "measure/marks.h"

namespace zeropose {

// The grey levels of a search's window, or why there are none.
struct OpenedWindow {
  MarkStatus status = MarkStatus::not_searched;  // found: there are
  GreyWindow greys;
};

// limits_sizes: the search is to have sensible limits of size.
OpenedWindow open_window(const ImageView& image, const MarkSearch& search, bool limits_sizes);

// Status, contrast, blur, quality and share of a fit. Its sizes and directions are not judged.
MarkFinding judged_fit(const ContourFit& fit, const MarkSearch& search);

// Fitted, whether it passed or not; strength: contrast times length, to compare.
struct JudgedMark {
  MarkFinding finding;
  double strength = 0;
  // Edge: as in EdgeFinding.
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d line_covariance = Eigen::Matrix2d::Zero();
};

// One wanted: the strongest that passed; ambiguous, with its numbers, if another one is nearly as strong.
// All: those that passed, each thing once. Else the most telling failure; without any, no_candidate, or
// low_contrast if the window has less than the search's.
MarkSight sight_of(std::vector<JudgedMark> marks, const GreyWindow& window, const MarkSearch& search,
                   HowMany wanted);

// Difference of two directions of a line, which has no sense: -pi/2..pi/2.
double wrapped_line_rad(double angle_rad);

// Place in the image of one in the window, px.
Eigen::Vector2d to_image(const GreyWindow& window, const Eigen::Vector2d& at);
Eigen::Vector2d to_window(const GreyWindow& window, const Eigen::Vector2d& u_px);

// Where all marks are wanted: all pieces of the strongest lines.
LineLimits line_limits_of(const MarkSearch& search, HowMany wanted, std::size_t lines_for_one);

}  // namespace zeropose
