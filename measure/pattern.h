// A patch of an image that a user taught as a mark by clicking into it (spec 50 M0).
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "measure/image.h"

namespace zeropose {

enum class PatternStatus {
  not_taught = 0,
  taught,
  outside_image,
  too_small,  // below smallest_pattern_px
  saturated,
  flat,           // no structure that stands out of the noise
  one_direction,  // structure in one direction only: the patch could slide along the other
  point_too_far   // the clicked point lies so far from the patch that its place would be uncertain
};
std::string_view name_of(PatternStatus status);

inline constexpr int smallest_pattern_px = 12;

// Only one that is taught can be searched for; the others keep what was seen, for people to look at.
struct Pattern {
  PatternStatus status = PatternStatus::not_taught;
  int width_px = 0, height_px = 0;
  std::vector<float> greys;                              // 0..255, row by row
  Eigen::Vector2d clicked_px = Eigen::Vector2d::Zero();  // from the middle of the patch's first pixel
  double noise_grey = 0;                                 // sigma of one pixel, estimated
  double contrast = 0;  // grey levels: twice the standard deviation, the step of a pattern of two equal parts
  double sigma_px = 0;  // of the clicked point in a picture as good as this one, its worst direction
};

// The patch in a window of the image. clicked_px: in the image, in or near the window.
Pattern teach_pattern(const ImageView& image, const PixelWindow& window, const Eigen::Vector2d& clicked_px);

}  // namespace zeropose
