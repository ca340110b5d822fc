// Least-squares matching: where a taught pattern lies, to hundredths of a pixel, from a place near by.
// Internal to the room.
#pragma once

#include <Eigen/Core>

#include "measure/grey_field.h"
#include "measure/image.h"
#include "measure/pattern.h"
#include "measure/pattern_level.h"

namespace zeropose {

// Where the patch lies: image = middle + linear * (place in the patch - its middle).
struct PatternWarp {
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
};

double rotation_of(const PatternWarp& warp);  // rad; of the nearest rotation
double scale_of(const PatternWarp& warp);     // root of the ratio of areas
double squeeze_of(const PatternWarp& warp);   // shorter by longer axis of a circle's picture, 0..1

struct PatternFit {
  bool converged = false;
  PatternWarp warp;
  MatchMatrix covariance = MatchMatrix::Zero();  // of the unknowns, with the noise of both pictures
  double gain = 0, offset_grey = 0;              // image = gain * patch + offset
  double correlation = 0;                        // of the pixels used
  double used_share = 0;                         // of the patch: seen, and not covered by something else
  double seen_share = 0;                         // of the patch: inside the image
  double saturated_share = 0;                    // of the patch
  double noise_grey = 0;                         // of a pixel of the image: sigma, with what the model leaves
  double blur_px2 = 0;  // squared sigma of the image's blur minus that of the taught patch, first order
  int iterations = 0;
};

// What the matching of a level may do.
struct MatchLimits {
  double farthest_px = 3;  // the middle from its start
  int most_iterations = 20;
  double last_step_sigmas = 0.03;
};

// Model: image(warp(x)) = gain * patch(x) + offset, 8 unknowns, inverse compositional Gauss-Newton (S. Baker,
// I. Matthews: Lucas-Kanade 20 years on, IJCV 2004) over the image's cubic spline with weights that fall to 0
// between 2.5 and 4.5 robust sigmas. The slopes are the patch's, so that the noise of the image cannot pull
// the place towards where interpolation smooths most. noise_grey: of the patch's pixels.
// It works on a part of the field about the start; a field may be larger than what is seen of it.
PatternFit match_level(const PatternLevel& level, const GreyField& field, const PatternWarp& start,
                       double noise_grey, const MatchLimits& limits = {});

// The same in full size, from a start within limits of the place. Preconditions: pattern taught, level made
// from it.
PatternFit fit_pattern(const ImageView& image, const Pattern& pattern, const PatternLevel& level,
                       const PatternWarp& start, const MatchLimits& limits = {});

// Place of the clicked point and its covariance, px and px^2.
Eigen::Vector2d clicked_place(const Pattern& pattern, const PatternFit& fit);
Eigen::Matrix2d clicked_covariance(const Pattern& pattern, const PatternFit& fit);

// The patch's pixels as a field.
GreyField field_of(const Pattern& pattern);

}  // namespace zeropose
