// Marks in an image: search in a window, place to hundredths of a pixel, covariance, or a reason (spec 50
// M0).
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "measure/image.h"

namespace zeropose {

struct Pattern;

enum class MarkKind {
  disc,     // flat disc or hole
  ring,     // one or more concentric circles about an optional disc: inner_shares
  ball,     // sphere
  slot,     // long hole: two parallel edges closed by half circles
  cross,    // two bars
  corner,   // where two straight edges meet
  edge,     // straight edge; its place along itself is open
  pattern,  // taught patch
};

// Where and what to look for in one image.
struct MarkSearch {
  MarkKind kind = MarkKind::disc;
  bool bright = false;  // brighter than what surrounds it
  Eigen::Vector2d expected_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_window_px =
      Eigen::Vector2d::Zero();  // the window is expected +- this, cut to the image
  double min_diameter_px = 0,
         max_diameter_px = 0;   // the longer axis of the outline; cross: of its arms' span
  double min_axis_ratio = 0.3;  // shorter / longer axis; slot: width / length
  double min_contrast = 15;     // grey levels
  double max_blur_px = 4;       // sigma of the edges
  std::vector<double>
      inner_shares{};  // ring: radii of its inner circles by that of the outer one, descending
  // Slot: its longer axis. Cross: one of its bars. Corner: the middle of the angle, from the corner into the
  // dark side (bright: into the bright side). Edge: across it, from dark to bright.
  double direction_rad = 0;
  double direction_tolerance_rad = std::numbers::pi;
  double opening_rad = std::numbers::pi / 2;  // corner: its angle; cross: between its bars
  double opening_tolerance_rad = 0.35;
  const Pattern* pattern = nullptr;  // borrowed
};

enum class MarkStatus {
  not_searched = 0,
  found,
  outside_image,
  no_candidate,
  too_small,
  low_contrast,
  blurred,
  saturated,
  cut_off,  // reaches beyond the window or the image
  ambiguous,
  not_converged
};
std::string_view name_of(MarkStatus status);
std::string_view name_of(MarkKind kind);

// One per search. Where no mark was found the numbers are those of what came nearest to one, 0 if nothing
// did.
struct MarkFinding {
  MarkStatus status = MarkStatus::not_searched;
  // The centre of the outline in the image (not yet the projected centre of the disc), the point where the
  // bars or edges meet, the point of an edge nearest to the expected place, the taught pattern's point.
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();  // edge: along itself as good as unknown
  double diameter_px = 0;                                    // longer axis
  double axis_ratio = 0;                                     // shorter / longer axis
  double direction_rad = 0;                                  // as in the search
  double contrast = 0;                                  // grey levels between mark and surroundings, positive
  double blur_px = 0;                                   // sigma of the edges
  double quality = 0;                                   // 0..1: how well the model explains the pixels
  double outline_share = 0;                             // of the outline that was seen and used
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Zero();  // the outline is x^T shape^-1 x = 1 about u_px
  double radius_share = 1;  // ring: u_px is the centre of the circle of this share of the outer radius
};

// Findings in the order of the searches. Pure and repeatable bit by bit. A mark may be up to 2.5 px + its
// blur near the image's border and must lie in its window as a whole; its surroundings should be of one
// surface for 3.5 px round it. Two things in one window that both pass for the mark are ambiguous unless one
// has less than 0.4 of the other's contrast. A search that makes no sense (not finite, limits the wrong way
// round) is not_searched, an empty image or a window beside the image outside_image. Saturated: at white; a
// mark at 0 is measured.
std::vector<MarkFinding> find_marks(const ImageView& image, std::span<const MarkSearch> searches);

// All things in a window that pass for the mark, the highest contrast first: where several are wanted, or the
// geometry of several marks is to choose. nearest: what came nearest where there is none.
// Patterns: at most the one that find_marks() finds. crowded: there are more than the `most` of highest
// contrast that were looked at.
struct AllMarks {
  std::vector<MarkFinding> found;
  MarkFinding nearest;
  bool crowded = false;
};
AllMarks find_all_marks(const ImageView& image, const MarkSearch& search, std::size_t most = 4000);

// Why it was not found, with the numbers and the limit they miss, for people.
std::string reason_text(const MarkFinding& finding, const MarkSearch& search);

// Window of a search, cut to the image; may be empty.
PixelWindow window_of(const ImageView& image, const MarkSearch& search);

}  // namespace zeropose
