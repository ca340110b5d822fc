#include "measure/edge_points.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

constexpr int largest_side_px = 300;  // windows beyond are looked at in means of 2 x 2, 3 x 3 .. pixels
constexpr double noise_medians = 3;   // 3.5 sigma if most of the window is plain
constexpr double strongest_share = 0.25;

struct GreyPlane {
  int width = 0, height = 0;
  std::vector<float> value;

  float at(int i, int j) const { return value[std::size_t(j) * std::size_t(width) + std::size_t(i)]; }
  float& at(int i, int j) { return value[std::size_t(j) * std::size_t(width) + std::size_t(i)]; }
};

GreyPlane plane_of(int width, int height) {
  return {width, height, std::vector<float>(std::size_t(width) * std::size_t(height), 0.0F)};
}

GreyPlane means_of(const GreyWindow& window, int factor) {
  if (factor == 1) return {window.width(), window.height(), window.grey};
  GreyPlane out = plane_of(window.width() / factor, window.height() / factor);
  const float scale = 1 / float(factor * factor);
  for (int j = 0; j < out.height * factor; ++j) {
    for (int i = 0; i < out.width * factor; ++i) out.at(i / factor, j / factor) += scale * window.at(i, j);
  }
  return out;
}

struct Slopes {
  GreyPlane x, y, size;
};

// Slope along each axis of the picture smoothed by the binomial filter of five: sigma 1 px.
Slopes slopes_of(const GreyPlane& grey) {
  const int w = grey.width, h = grey.height;
  GreyPlane smooth = plane_of(w, h), steep = plane_of(w, h);
  for (int j = 0; j < h; ++j) {
    const float* g = &grey.value[std::size_t(j) * std::size_t(w)];
    float *s = &smooth.value[std::size_t(j) * std::size_t(w)],
          *d = &steep.value[std::size_t(j) * std::size_t(w)];
    for (int i = 2; i < w - 2; ++i) {
      s[i] = (g[i - 2] + g[i + 2] + 4 * (g[i - 1] + g[i + 1]) + 6 * g[i]) * (1.0F / 16);
      d[i] = (g[i + 2] - g[i - 2] + 2 * (g[i + 1] - g[i - 1])) * (1.0F / 8);
    }
  }
  Slopes out{plane_of(w, h), plane_of(w, h), plane_of(w, h)};
  for (int j = 2; j < h - 2; ++j) {
    for (int i = 2; i < w - 2; ++i) {
      const float x = (steep.at(i, j - 2) + steep.at(i, j + 2) +
                       4 * (steep.at(i, j - 1) + steep.at(i, j + 1)) + 6 * steep.at(i, j)) *
                      (1.0F / 16);
      const float y =
          (smooth.at(i, j + 2) - smooth.at(i, j - 2) + 2 * (smooth.at(i, j + 1) - smooth.at(i, j - 1))) *
          (1.0F / 8);
      out.x.at(i, j) = x;
      out.y.at(i, j) = y;
      out.size.at(i, j) = std::sqrt(x * x + y * y);
    }
  }
  return out;
}

float threshold_of(const GreyPlane& size, double least) {
  std::vector<float> sorted;
  sorted.reserve(size.value.size());
  for (int j = 2; j < size.height - 2; ++j) {
    for (int i = 2; i < size.width - 2; i += 2) sorted.push_back(size.at(i, j));
  }
  if (sorted.empty()) return static_cast<float>(least);
  const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double noise = noise_medians * *middle;
  const double strongest = *std::max_element(size.value.begin(), size.value.end());
  return static_cast<float>(std::max(least, std::min(noise, strongest_share * strongest)));
}

// Between the two neighbours on one side of a pixel, one step of the longer axis along its slope.
float beside(const GreyPlane& size, int i, int j, float nx, float ny, int sign) {
  const bool flat = std::abs(nx) >= std::abs(ny);
  const int si = nx < 0 ? -sign : sign, sj = ny < 0 ? -sign : sign;
  const float part = flat ? std::abs(ny / nx) : std::abs(nx / ny);
  const float straight = flat ? size.at(i + si, j) : size.at(i, j + sj);
  return (1 - part) * straight + part * size.at(i + si, j + sj);
}

}  // namespace

std::vector<SlopePoint> find_edge_points(const GreyWindow& window, double least_slope) {
  const int factor = 1 + std::max(window.width(), window.height()) / largest_side_px;
  const Slopes slopes = slopes_of(means_of(window, factor));
  const float threshold = threshold_of(slopes.size, factor * least_slope);
  const auto scale = static_cast<float>(factor), first = 0.5F * (scale - 1);
  std::vector<SlopePoint> points;
  for (int j = 3; j < slopes.size.height - 3; ++j) {
    for (int i = 3; i < slopes.size.width - 3; ++i) {
      const float size = slopes.size.at(i, j);
      if (!(size > 0) || size < threshold) continue;
      const float nx = slopes.x.at(i, j) / size, ny = slopes.y.at(i, j) / size;
      const float before = beside(slopes.size, i, j, nx, ny, -1),
                  after = beside(slopes.size, i, j, nx, ny, 1);
      if (size < before || size <= after) continue;
      const float step = 0.5F * (before - after) / (before - 2 * size + after);
      const float shift = step / std::max(std::abs(nx), std::abs(ny));
      points.push_back({first + scale * (float(i) + shift * nx), first + scale * (float(j) + shift * ny),
                        size / scale, nx, ny});
    }
  }
  return points;
}

}  // namespace zeropose
