// What a picture says about lens, light and camera, whatever it shows (spec 50 M6.1).
#pragma once

#include <optional>

#include "measure/image.h"

namespace zeropose {

inline constexpr double saturated_grey = 254, dark_grey = 12;

// Grey levels on the scale 0..255. Shares are of the pixels of every fourth row and column.
struct PictureHealth {
  double noise_grey = 0;       // standard deviation, rounding of the pixels included
  double saturated_share = 0;  // at saturated_grey and above
  double dark_share = 1;       // at dark_grey and below
  double mean_grey = 0;
  // The blur of the strongest edges, sigma in px: how well the lens is focused, not what contrast there is.
  // nullopt: no edge that stands out of the noise. From 0.3 px, below which pixels show no difference.
  std::optional<double> focus_px = {};
};

// Looks at every tenth pixel or so: 0.1 ms at 768 x 572 px. The noise is that of the flat places: a fine
// texture all over the picture counts as noise. An empty image is all dark.
PictureHealth picture_health(const ImageView& image);

// One figure of a camera from picture to picture, against what it was in the beginning (at best in the
// pictures of the zero measurement).
struct HealthTrend {
  double first = 0;      // mean of the first few values
  double mean = 0;       // exponential mean since then
  int count = 0;         // values
  int in_a_row = 0;      // values after which the flag should be another one
  bool changed = false;  // until the mean is back within the band for as many values
  double ratio() const { return first > 0 ? mean / first : 1; }
};

// The trend with one more value. The mean, over about five values, is out of the band where it is more than a
// quarter above or below the first; eight in a row of one kind change the flag.
HealthTrend followed(HealthTrend trend, double value);

}  // namespace zeropose
