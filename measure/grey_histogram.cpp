#include "measure/grey_histogram.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "measure/tally.h"

namespace zeropose {

GreyHistogram::GreyHistogram(const SearchImage& image, const MarkSearch& search) {
  const double diameter = search.min_diameter_px / image.reduction();
  const double mark = 0.25 * std::numbers::pi * diameter * diameter * search.min_axis_ratio;
  const double enough = std::sqrt(double(image.width()) * image.height() / 6000);
  const int least = mark > 400 ? 3 : mark > 20 ? 2 : 1;
  const int stride = std::max(least, static_cast<int>(std::min(enough, 0.4 * diameter)));
  Tally<256> greys;
  std::size_t turn = 0;
  for (int v = 0; v < image.height(); v += stride) {
    const std::uint8_t* row = image.row(v);
    for (int u = 0; u < image.width(); u += stride) greys.add(turn++, row[u]);
  }
  count_ = greys.counts();
  few_ = std::max(1, static_cast<int>(std::min(1e9, 0.25 * mark / (stride * stride))));
}

int GreyHistogram::low() const {
  int grey = 0;
  for (int sum = 0; grey < 255 && (sum += at(grey)) < few_;) ++grey;
  return grey;
}

int GreyHistogram::high() const {
  int grey = 255;
  for (int sum = 0; grey > 0 && (sum += at(grey)) < few_;) --grey;
  return grey;
}

int GreyHistogram::quietest_near(double level, double room) const {
  const auto crowd = [this](int grey) { return at(grey - 2) + at(grey - 1) + at(grey) + at(grey + 1); };
  const int middle = static_cast<int>(std::lround(level));
  int best = middle;
  for (int off = 1; off <= static_cast<int>(room); ++off)
    for (const int grey : {middle - off, middle + off})
      if (crowd(grey) < crowd(best)) best = grey;
  return best;
}

}  // namespace zeropose
