#include "measure/grey_field.h"

#include <algorithm>

namespace zeropose {
namespace {

// Elimination of (c[i-1] + 4 c[i] + c[i+1]) / 6 = grey[i]: inverse pivots of the inner ones.
std::vector<float> pivots_of(int n) {
  std::vector<float> pivots(static_cast<std::size_t>(n), 0.25F);
  for (std::size_t i = 2; i < pivots.size(); ++i) pivots[i] = 1 / (4 - pivots[i - 1]);
  return pivots;
}

// Spline coefficients in place, n of them at a distance of step from each other, for lanes neighbours at a
// distance of apart; the ones beyond the ends as well.
void to_coefficients(float* c, int n, std::ptrdiff_t step, int lanes, std::ptrdiff_t apart,
                     const std::vector<float>& pivots) {
  const auto each = [&](auto&& act) {
    for (int k = 0; k < lanes; ++k) act(c + k * apart);
  };
  each([&](float* p) { p[(n - 2) * step] -= p[(n - 1) * step] * (1.0F / 6); });
  for (int i = 1; i < n - 1; ++i) {
    const float pivot = pivots[static_cast<std::size_t>(i)];
    each([&](float* p) { p[i * step] = (6 * p[i * step] - p[(i - 1) * step]) * pivot; });
  }
  for (int i = n - 3; i >= 1; --i) {
    const float pivot = pivots[static_cast<std::size_t>(i)];
    each([&](float* p) { p[i * step] -= pivot * p[(i + 1) * step]; });
  }
  each([&](float* p) {
    p[-step] = 2 * p[0] - p[step];
    p[n * step] = 2 * p[(n - 1) * step] - p[(n - 2) * step];
  });
}

constexpr int lanes_at_once = 8;

using Four = Eigen::Array4f;

// Of the four coefficients about a place t behind the second of them.
inline Four weights_of(float t) {
  const Four constant(1.0F / 6, 2.0F / 3, 1.0F / 6, 0), linear(-0.5F, 0, 0.5F, 0);
  const Four square(0.5F, -1, 0.5F, 0), cube(-1.0F / 6, 0.5F, -0.5F, 1.0F / 6);
  return constant + t * (linear + t * (square + t * cube));
}

}  // namespace

GreyField part_of(const GreyField& field, const PixelWindow& window) {
  GreyField part{window.width(), window.height(), {}};
  part.grey.resize(static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height));
  const int first = std::clamp(-window.u0, 0, part.width),
            last = std::clamp(field.width - window.u0, 0, part.width);
  for (int j = 0; j < part.height; ++j) {
    const float* const from = field.row(std::clamp(window.v0 + j, 0, field.height - 1));
    float* const to = part.row(j);
    std::fill(to, to + first, from[0]);
    std::copy(from + window.u0 + first, from + window.u0 + last, to + first);
    std::fill(to + last, to + part.width, from[field.width - 1]);
  }
  return part;
}

GreyField field_of(const ImageView& image, const PixelWindow& window) {
  const PixelWindow inner{
      std::clamp(window.u0, 0, image.width_px - 1), std::clamp(window.v0, 0, image.height_px - 1),
      std::clamp(window.u1, 0, image.width_px - 1), std::clamp(window.v1, 0, image.height_px - 1)};
  GreyField seen{inner.width(), inner.height(), {}};
  copy_greys(image, inner, seen.grey);
  if (seen.width == window.width() && seen.height == window.height()) return seen;
  return part_of(seen,
                 {window.u0 - inner.u0, window.v0 - inner.v0, window.u1 - inner.u0, window.v1 - inner.v0});
}

GreyField halved(const GreyField& field) {
  GreyField half{field.width / 2, field.height / 2, {}};
  half.grey.resize(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height));
  std::vector<float> line(static_cast<std::size_t>(field.width) + 2);
  for (int j = 0; j < half.height; ++j) {
    const float *const a = field.row(std::max(0, 2 * j - 1)), *const b = field.row(2 * j),
                       *const c = field.row(2 * j + 1),
                       *const d = field.row(std::min(field.height - 1, 2 * j + 2));
    for (int i = 0; i < field.width; ++i) {
      line[static_cast<std::size_t>(i) + 1] = (a[i] + d[i] + 3 * (b[i] + c[i])) * (1.0F / 64);
    }
    line.front() = line[1];
    line.back() = line[line.size() - 2];
    float* const to = half.row(j);
    const float* from = line.data();
    for (int i = 0; i < half.width; ++i, from += 2) to[i] = from[0] + from[3] + 3 * (from[1] + from[2]);
  }
  return half;
}

GreySpline::GreySpline(const GreyField& field)
    : width_(field.width), height_(field.height), stride_(field.width + 2) {
  coefficients_.resize(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_ + 2));
  float* const first = coefficients_.data() + stride_ + 1;
  for (int v = 0; v < height_; ++v) {
    std::copy_n(field.row(v), width_, first + std::ptrdiff_t{v} * stride_);
  }
  const std::vector<float> across = pivots_of(width_), down = pivots_of(height_);
  for (int v = 0; v < height_; v += lanes_at_once) {
    to_coefficients(first + std::ptrdiff_t{v} * stride_, width_, 1, std::min(lanes_at_once, height_ - v),
                    stride_, across);
  }
  to_coefficients(first - 1, height_, stride_, stride_, 1, down);
}

void GreySpline::line(float u, float v, float du, float dv, int count, float* greys) const {
  using Coefficients = Eigen::Map<const Four>;
  const int last_i = width_ - 2, last_j = height_ - 2;
  const std::ptrdiff_t stride = stride_;
  const float* const coefficients = coefficients_.data();
  for (int k = 0; k < count; ++k) {
    const float x = u + static_cast<float>(k) * du, y = v + static_cast<float>(k) * dv;
    const int i = std::min(static_cast<int>(x), last_i), j = std::min(static_cast<int>(y), last_j);
    const Four across = weights_of(x - static_cast<float>(i)), down = weights_of(y - static_cast<float>(j));
    const float* const first = coefficients + j * stride + i;
    const Four sum =
        down(0) * Coefficients(first) + down(1) * Coefficients(first + stride) +
        (down(2) * Coefficients(first + 2 * stride) + down(3) * Coefficients(first + 3 * stride));
    greys[k] = (across * sum).sum();
  }
}

GreySlopes slopes_of(const GreyField& field) {
  const int w = field.width, h = field.height;
  GreySlopes slopes{{w, h, field.grey}, {w, h, field.grey}};
  const std::vector<float> across = pivots_of(w), down = pivots_of(h);
  std::vector<float> rows(static_cast<std::size_t>(w + 2) * lanes_at_once);
  for (int v = 0; v < h; v += lanes_at_once) {
    const int lanes = std::min(lanes_at_once, h - v);
    for (int k = 0; k < lanes; ++k) std::copy_n(field.row(v + k), w, rows.data() + k * (w + 2) + 1);
    to_coefficients(rows.data() + 1, w, 1, lanes, w + 2, across);
    for (int k = 0; k < lanes; ++k) {
      const float* const c = rows.data() + k * (w + 2);
      float* const to = slopes.along_u.row(v + k);
      for (int i = 0; i < w; ++i) to[i] = 0.5F * (c[i + 2] - c[i]);
    }
  }
  std::vector<float> columns(static_cast<std::size_t>(w) * static_cast<std::size_t>(h + 2));
  std::copy(field.grey.begin(), field.grey.end(), columns.begin() + w);
  to_coefficients(columns.data() + w, h, w, w, 1, down);
  for (int v = 0; v < h; ++v) {
    const float* const c = columns.data() + std::ptrdiff_t{v} * w;
    float* const to = slopes.along_v.row(v);
    for (int i = 0; i < w; ++i) to[i] = 0.5F * (c[i + 2 * w] - c[i]);
  }
  return slopes;
}

}  // namespace zeropose
