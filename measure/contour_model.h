// The blurred outline with shading: normal equations and residuals over the pixels of a band. Internal to the
// room.
#pragma once

#include <cstdint>
#include <span>

#include "measure/contour_fit.h"

namespace zeropose::contour {

NormalSums normal_sums(const PixelBand& band, const ActivePixels& active, const ContourShape& shape,
                       const Unknowns& at);

// How flat pixels stand to what the model shows there.
struct FlatMisfit {
  double mean = 0, squares = 0;  // of the residuals: mean, sum of squares
};
FlatMisfit flat_misfit(const FlatSums& sums, double level, const Unknowns& at);

// Of every pixel across the outline.
void find_residuals(const PixelBand& band, std::span<const std::uint32_t> all, const ContourShape& shape,
                    const Unknowns& at, PixelResiduals& out);

}  // namespace zeropose::contour
