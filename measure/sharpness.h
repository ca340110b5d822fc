// How sharp a picture is where nothing was found in it (spec 50 M6.1). Internal to the room.
#pragma once

#include <optional>

#include "measure/image.h"

namespace zeropose {

// The blur of the sharpest edge in the window, sigma in px, to about a quarter; nullopt where grey levels
// differ too little within 24 px. Compares the largest difference between places 4 px apart with that between
// places 24 px apart, each the mean of 4 x 4 px, so that neither noise nor slowly changing light counts.
std::optional<double> sharpest_edge_px(const ImageView& image, const PixelWindow& window);

}  // namespace zeropose
