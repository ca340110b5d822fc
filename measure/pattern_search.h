// A taught pattern searched for in a window of an image and measured there (spec 50 M0). Internal to the
// room: find_marks() is the way in.
#pragma once

#include "measure/image.h"
#include "measure/marks.h"
#include "measure/pattern.h"

namespace zeropose {

// The rotation searched where MarkSearch::direction_tolerance_rad is left at pi, +-.
inline constexpr double plain_pattern_turn_rad = 0.0873;

// The place of the pattern's clicked point. The patch must lie in the window as a whole (1.5 px may stand
// out) and in the image; turned by MarkSearch::direction_rad +- its tolerance against the taught one, scale
// within 12 %, sheared a little; up to 20 % of it may be covered. Of the finding: direction_rad is the
// rotation, axis_ratio the shorter by the longer axis of a circle's picture, diameter_px the longer side of
// the patch as it is seen, contrast as Pattern::contrast, blur_px by how much it is less sharp than the
// taught one, quality the square of the correlation, outline_share the share of the patch that was used.
//
// not_searched: no taught pattern, or a search that makes no sense. outside_image: the window. no_candidate:
// nothing like it, or beyond the limits of rotation, scale and shear. too_small: below the scale.
// low_contrast: of less than MarkSearch::min_contrast, or too little left to place it to 0.3 px. blurred:
// less sharp than max_blur_px allows or than can be matched. saturated: more than 2 % of its pixels. cut_off:
// stands out of the window or the image, or is larger than the window. ambiguous: a second place that looks
// nearly as good. not_converged: something like it that differs too much, or too much of it covered.
MarkFinding find_pattern(const ImageView& image, const MarkSearch& search);

}  // namespace zeropose
