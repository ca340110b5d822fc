// Marks in an image: search in a window, centre to hundredths of a pixel, covariance, or a reason (spec 50
// M0).
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "measure/image.h"

namespace zeropose {

enum class MarkKind { dark_disc, bright_disc };

// Where and what to look for in one image.
struct MarkSearch {
  MarkKind kind = MarkKind::dark_disc;
  Eigen::Vector2d expected_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_window_px =
      Eigen::Vector2d::Zero();                      // the window is expected +- this, cut to the image
  double min_diameter_px = 0, max_diameter_px = 0;  // of the ellipse's longer axis
  double min_axis_ratio = 0.3;                      // shorter / longer axis
  double min_contrast = 15;                         // grey levels
};

enum class MarkStatus {
  not_searched = 0,
  found,
  outside_image,
  no_candidate,
  too_small,
  low_contrast,
  saturated,
  cut_off,
  ambiguous,
  not_converged
};
std::string_view name_of(MarkStatus status);

// One per search. u_px is the centre of the ellipse in the image (not yet the projected centre of the disc).
struct MarkFinding {
  MarkStatus status = MarkStatus::not_searched;
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double diameter_px = 0;                               // longer axis
  double axis_ratio = 0;                                // shorter / longer axis
  double contrast = 0;                                  // grey levels between mark and surroundings, positive
  double quality = 0;                                   // 0..1: how well the model explains the pixels
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Zero();  // the outline is x^T shape^-1 x = 1 about u_px
};

// Findings in the order of the searches. Pure and repeatable bit by bit. A mark may be up to 2.5 px + its
// blur near the image's border and must lie in its window as a whole; its surroundings should be of one
// surface for 3.5 px round it. Two things in one window that both pass for the mark are ambiguous unless one
// has less than 0.4 of the other's contrast. A search that makes no sense (not finite, limits the wrong way
// round) is not_searched, an empty image or a window beside the image outside_image. Saturated: at 255; a
// mark at 0 is measured.
std::vector<MarkFinding> find_marks(const ImageView& image, std::span<const MarkSearch> searches);

}  // namespace zeropose
