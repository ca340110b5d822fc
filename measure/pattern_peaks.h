// Where a small patch correlates best with a field, place by place. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/grey_field.h"
#include "measure/pattern_fit.h"

namespace zeropose {

// A patch turned and scaled, without mean and of norm 1.
struct CorrelationMask {
  GreyField weights;
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();  // field = linear * patch
};

// What of the patch stays inside it when it is turned; empty if that is less than 5 px. Precondition: the
// patch is at least 5 x 5 px.
CorrelationMask mask_of(const GreyField& patch, const GreySpline& spline, double rotation_rad, double scale);

// Correlation -1..1 with the mask's first pixel at each place; 0 where the field's standard deviation under
// the mask is below least_sigma. Empty if the mask is larger than the field.
GreyField correlation_map(const GreyField& field, const CorrelationMask& mask, double least_sigma);

// The same at one place, which must hold the mask.
double correlation_at(const GreyField& field, const CorrelationMask& mask, int u, int v);

struct PatternPeak {
  PatternWarp warp;  // px of the field
  double correlation = 0;
};

// How far and how finely to look.
struct PeakSearch {
  double rotation_rad = 0, tolerance_rad = 0;
  double least_sigma = 0;  // grey levels
  std::size_t most = 6;    // peaks
};

// The best places, best first, one for each maximum, with the best of a few rotations and scales.
std::vector<PatternPeak> pattern_peaks(const GreyField& field, const GreyField& patch,
                                       const PeakSearch& search);

}  // namespace zeropose
