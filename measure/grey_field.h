// Grey levels as real numbers between the pixels too: parts of images, their smaller copies, their splines.
// Internal to the room.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/image.h"

namespace zeropose {

// Row by row; place (0, 0) is the middle of the first pixel.
struct GreyField {
  int width = 0, height = 0;
  std::vector<float> grey;

  const float* row(int v) const { return grey.data() + std::ptrdiff_t{v} * width; }
  float* row(int v) { return grey.data() + std::ptrdiff_t{v} * width; }
};

// A window of the image; where it reaches beyond the image the nearest pixel stands in. Precondition: neither
// of them is empty.
GreyField field_of(const ImageView& image, const PixelWindow& window);

// A part of a field; where it reaches beyond it the nearest pixel stands in. Precondition: they overlap.
GreyField part_of(const GreyField& field, const PixelWindow& window);

// Half the size, rounded down, after smoothing with 1 3 3 1 both ways. Pixel i lies at 2 i + 0.5 of the
// larger one.
GreyField halved(const GreyField& field);

// The cubic spline through all pixels, with no curvature at the ends of rows and columns (M. Unser, Splines,
// IEEE Signal Processing Magazine 1999; the ends as for natural splines, so that slopes there are not forced
// to zero).
class GreySpline {
 public:
  // Precondition: at least 3 x 3 pixels.
  explicit GreySpline(const GreyField& field);

  bool holds(double u, double v) const { return u >= 0 && v >= 0 && u <= width_ - 1 && v <= height_ - 1; }

  // Precondition: holds(u, v).
  float at(float u, float v) const {
    float grey;
    line(u, v, 0, 0, 1, &grey);
    return grey;
  }

  // Values at count places a step (du, dv) from each other. Precondition: holds them all.
  void line(float u, float v, float du, float dv, int count, float* greys) const;

 private:
  int width_, height_, stride_;
  std::vector<float> coefficients_;  // one more on every side
};

// The slopes of that spline at the pixels, along rows and along columns, grey levels per px.
struct GreySlopes {
  GreyField along_u, along_v;
};
GreySlopes slopes_of(const GreyField& field);

// Variance of a slope by that of the independent noise of the pixels.
inline constexpr double slope_noise_gain = 1.3923;  // 9 (2 / sqrt 3 - 1)

}  // namespace zeropose
