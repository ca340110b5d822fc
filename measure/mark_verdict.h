// What the searches for all kinds of marks ask alike: does a search make sense, do the pixels agree with a
// fit. Internal to the room.
#pragma once

#include "measure/marks.h"

namespace zeropose {

// Place, window, contrast and blur; then the limits of size and shape; then those of direction.
bool place_makes_sense(const MarkSearch& search);
bool sizes_make_sense(const MarkSearch& search);
bool directions_make_sense(const MarkSearch& search);

inline constexpr double plain_model_share = 0.04;  // of the contrast: what plain optics leave, rms
inline constexpr double saturated_share = 0.02;    // of the pixels across the outline: then it is saturated
inline constexpr double rough_px = 0.15;           // what the outline of a real mark may deviate, rms

// What a fit left.
struct FitEvidence {
  double contrast = 0, edge_rms = 0, flat_rms = 0;  // grey levels: across the outline, beside it (0: unknown)
  double outline_px = 0, outline_noise_px = 0;      // rms, and what the noise alone makes of that
  double spread = 0;                                // relative sigma of the two variances' ratio
};

// Residuals across the outline: noise as beside it, of which at most so much counts, and a small share of the
// contrast.
bool pixels_agree(const FitEvidence& evidence, double model_share, double most_noise_grey);

// 0..1: how well the model explains the pixels.
double quality_of(const FitEvidence& evidence);

}  // namespace zeropose
