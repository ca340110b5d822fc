// Marks with straight edges: each found in its window, fitted by maximum likelihood, or the reason why not
// (spec 50 M0).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/image.h"
#include "measure/mark_sight.h"
#include "measure/marks.h"

namespace zeropose {

// Of each search the fields count that marks.h names for its kind. Pure and repeatable bit by bit. A search
// that makes no sense is not_searched, an empty image or a window beside it outside_image. Two things in one
// window that both pass are ambiguous when the weaker one has more than half of the other's contrast times
// length; what is beside the mark within its band (2.5 px and its blur) is left out piece by piece, up to
// 30 % of the outline. Where none was found the numbers are those of what came nearest to one.

// The straight edge whose dark and bright sides lie as asked. u_px: its point nearest to the expected place;
// the covariance along it is unknown_along_px2; diameter_px: how much of it is seen, at least
// min_diameter_px (edge_least_px if that is smaller). max_diameter_px, min_axis_ratio and bright do not
// count. Too near to the window's border for its band: cut_off; nearer than 3 px it is not seen.
inline constexpr double unknown_along_px2 = 1e6, edge_least_px = 8;
MarkSight look_for_edges(const ImageView& image, const MarkSearch& search, HowMany wanted);

// The same with the whole line of each edge. middle_px: of what is seen of it, diameter_px long; strength:
// contrast times length, of all pieces that lie on its line; line_covariance: of its place at u_px along
// direction_rad (px), and of direction_rad.
struct EdgeFinding {
  MarkFinding mark;
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  double strength = 0;
  Eigen::Matrix2d line_covariance = Eigen::Matrix2d::Zero();
};
struct EdgeSight {
  std::vector<EdgeFinding> standing;
  std::vector<EdgeFinding>
      failed;           // seen and not passed, each with its reason; no covariance, place to about 1 px
  MarkFinding nearest;  // as in MarkSight
};
EdgeSight look_for_edge_lines(const ImageView& image, const MarkSearch& search, HowMany wanted);

// Where two edges meet. diameter_px: the longer arm that is seen, axis_ratio: the shorter one by it; each at
// least min_diameter_px (edge_least_px if that is smaller). max_diameter_px and min_axis_ratio do not count.
// An edge that goes on behind the corner makes it none. opening_rad: up to pi the mark fills the angle;
// beyond, direction_rad still points from the corner into the mark.
MarkSight look_for_corners(const ImageView& image, const MarkSearch& search, HowMany wanted);

// A long hole, also seen obliquely: any affine image of a stadium that is longer than slot_least_ratio times
// its width, which is to be five times the blur. diameter_px: its length, axis_ratio: its width by that.
inline constexpr double slot_least_ratio = 1.2;
MarkSight look_for_slots(const ImageView& image, const MarkSearch& search, HowMany wanted);

// Two bars of equal width. u_px: where their middle lines meet; diameter_px: the longer span that is seen;
// axis_ratio: the bars' width by that (min_axis_ratio does not count). Arms may end in the window or reach
// beyond it; each must be seen for 6 px from the other bar.
MarkSight look_for_crosses(const ImageView& image, const MarkSearch& search, HowMany wanted);

}  // namespace zeropose
