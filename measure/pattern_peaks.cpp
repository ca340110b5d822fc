#include "measure/pattern_peaks.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace zeropose {
namespace {

using Eigen::Vector2d;

constexpr int smallest_mask = 5;
constexpr double least_correlation = 0.3;
constexpr double degree = std::numbers::pi / 180;
constexpr double map_covers_rad = 5 * degree, map_step_rad = 8 * degree;  // rotations seen by one map

// Running sums of greys and their squares, from the top left.
class FieldSums {
 public:
  explicit FieldSums(const GreyField& field) : stride_(std::size_t(field.width) + 1) {
    const std::size_t count = stride_ * (std::size_t(field.height) + 1);
    sums_.assign(count, 0.0);
    squares_.assign(count, 0.0);
    for (int v = 0; v < field.height; ++v) {
      const std::size_t at = (std::size_t(v) + 1) * stride_ + 1;
      double sum = 0, square = 0;
      for (std::size_t u = 0; u + 1 < stride_; ++u) {
        const double grey = double{field.row(v)[u]};
        sum += grey;
        square += grey * grey;
        sums_[at + u] = sums_[at + u - stride_] + sum;
        squares_[at + u] = squares_[at + u - stride_] + square;
      }
    }
  }

  // Sum of squares about the mean.
  double spread(int u, int v, int width, int height) const {
    const double sum = box(sums_, u, v, width, height);
    return std::max(0.0, box(squares_, u, v, width, height) - sum * sum / (double(width) * height));
  }

 private:
  double box(const std::vector<double>& sums, int u, int v, int width, int height) const {
    const std::size_t a = std::size_t(v) * stride_ + std::size_t(u), b = a + std::size_t(height) * stride_;
    return sums[b + std::size_t(width)] - sums[b] - sums[a + std::size_t(width)] + sums[a];
  }

  std::size_t stride_;
  std::vector<double> sums_, squares_;
};

constexpr int lanes = 16;
using Lanes = Eigen::Array<float, lanes, 1>;

// Correlation sums at lanes places side by side.
Lanes products_at(const GreyField& field, const GreyField& mask, int u, int v) {
  Lanes sum = Lanes::Zero();
  for (int j = 0; j < mask.height; ++j) {
    const float *const from = field.row(v + j) + u, *const weight = mask.row(j);
    for (int i = 0; i < mask.width; ++i) sum += weight[i] * Eigen::Map<const Lanes>(from + i);
  }
  return sum;
}

float product_at(const GreyField& field, const GreyField& mask, int u, int v) {
  float sum = 0;
  for (int j = 0; j < mask.height; ++j) {
    sum += Eigen::Map<const Eigen::VectorXf>(field.row(v + j) + u, mask.width)
               .dot(Eigen::Map<const Eigen::VectorXf>(mask.row(j), mask.width));
  }
  return sum;
}

bool is_peak(const GreyField& map, int u, int v) {
  const float here = map.row(v)[u];
  for (int j = std::max(0, v - 1); j <= std::min(map.height - 1, v + 1); ++j) {
    for (int i = std::max(0, u - 1); i <= std::min(map.width - 1, u + 1); ++i) {
      const bool before = j < v || (j == v && i < u);
      if (before ? map.row(j)[i] >= here : map.row(j)[i] > here) return false;
    }
  }
  return true;
}

Vector2d middle_of(const CorrelationMask& mask, int u, int v) {
  return Vector2d(u, v) + 0.5 * Vector2d(mask.weights.width - 1, mask.weights.height - 1);
}

void add_peaks(const GreyField& map, const CorrelationMask& mask, std::vector<PatternPeak>& peaks) {
  for (int v = 0; v < map.height; ++v) {
    for (int u = 0; u < map.width; ++u) {
      const double correlation = double{map.row(v)[u]};
      if (correlation > least_correlation && is_peak(map, u, v)) {
        peaks.push_back({{middle_of(mask, u, v), mask.linear}, correlation});
      }
    }
  }
}

// Best first, one of each neighbourhood.
std::vector<PatternPeak> best_of(std::vector<PatternPeak> peaks, std::size_t most) {
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const PatternPeak& a, const PatternPeak& b) { return a.correlation > b.correlation; });
  std::vector<PatternPeak> best;
  for (const PatternPeak& peak : peaks) {
    if (best.size() == most) break;
    const auto near = [&peak](const PatternPeak& other) {
      return (other.warp.middle_px - peak.warp.middle_px).norm() < 2;
    };
    if (std::none_of(best.begin(), best.end(), near)) best.push_back(peak);
  }
  return best;
}

// The best of the masks at most one pixel from where the peak is.
PatternPeak refined(const GreyField& field, const std::vector<CorrelationMask>& masks,
                    const PatternPeak& peak) {
  PatternPeak best = peak;
  for (const CorrelationMask& mask : masks) {
    const Vector2d first = peak.warp.middle_px - middle_of(mask, 0, 0);
    const int u = static_cast<int>(std::lround(first.x())), v = static_cast<int>(std::lround(first.y()));
    for (int j = std::max(0, v - 1); j <= std::min(field.height - mask.weights.height, v + 1); ++j) {
      for (int i = std::max(0, u - 1); i <= std::min(field.width - mask.weights.width, u + 1); ++i) {
        const double correlation = correlation_at(field, mask, i, j);
        if (correlation > best.correlation) best = {{middle_of(mask, i, j), mask.linear}, correlation};
      }
    }
  }
  return best;
}

std::vector<CorrelationMask> masks_about(const GreyField& patch, const GreySpline& spline, double rotation) {
  std::vector<CorrelationMask> masks;
  for (const double turn : {0.0, -5 * degree, 5 * degree}) {
    for (const double scale : {1.0, 0.95, 1.05}) {
      CorrelationMask mask = mask_of(patch, spline, rotation + turn, scale);
      if (!mask.weights.grey.empty()) masks.push_back(std::move(mask));
    }
  }
  return masks;
}

}  // namespace

CorrelationMask mask_of(const GreyField& patch, const GreySpline& spline, double rotation_rad, double scale) {
  CorrelationMask mask;
  const double c = std::cos(rotation_rad), s = std::sin(rotation_rad);
  mask.linear << scale * c, -scale * s, scale * s, scale * c;
  const double w = 0.5 * (patch.width - 1), h = 0.5 * (patch.height - 1);
  const bool swapped = std::abs(s) > std::abs(c);
  const double across = swapped ? h : w, down = swapped ? w : h;
  const double shrink = scale * std::min({(w + 0.01) / (std::abs(c) * across + std::abs(s) * down),
                                          (h + 0.01) / (std::abs(s) * across + std::abs(c) * down), 1.0});
  const int width = static_cast<int>(2 * across * shrink + 1e-6) + 1;
  const int height = static_cast<int>(2 * down * shrink + 1e-6) + 1;
  if (std::min(width, height) < smallest_mask) return mask;
  mask.weights = {width, height, {}};
  const Eigen::Matrix2d back = mask.linear.inverse();
  double sum = 0, squares = 0;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const Vector2d x = Vector2d(w, h) + back * (Vector2d(i, j) - 0.5 * Vector2d(width - 1, height - 1));
      const float grey =
          spline.at(float(std::clamp(x.x(), 0.0, 2 * w)), float(std::clamp(x.y(), 0.0, 2 * h)));
      mask.weights.grey.push_back(grey);
      sum += double{grey};
      squares += double{grey} * double{grey};
    }
  }
  const double count = double(width) * height, spread = squares - sum * sum / count;
  if (!(spread > 1e-6 * count)) mask.weights = {};
  const auto mean = float(sum / count), by = float(1 / std::sqrt(std::max(spread, 1e-12)));
  for (float& weight : mask.weights.grey) weight = (weight - mean) * by;
  return mask;
}

GreyField correlation_map(const GreyField& field, const CorrelationMask& mask, double least_sigma) {
  const int w = mask.weights.width, h = mask.weights.height;
  GreyField map{field.width - w + 1, field.height - h + 1, {}};
  if (w == 0 || map.width < 1 || map.height < 1) return {};
  map.grey.assign(std::size_t(map.width) * std::size_t(map.height), 0.0F);
  const FieldSums sums(field);
  const double least = std::max(1e-3, double(w) * h * least_sigma * least_sigma);
  const auto scaled = [&](float product, int u, int v) {
    const double spread = sums.spread(u, v, w, h);
    return spread < least ? 0.0F : product / static_cast<float>(std::sqrt(spread));
  };
  for (int v = 0; v < map.height; ++v) {
    int u = 0;
    for (; u + lanes <= map.width; u += lanes) {
      const Lanes products = products_at(field, mask.weights, u, v);
      for (int k = 0; k < lanes; ++k) map.row(v)[u + k] = scaled(products(k), u + k, v);
    }
    for (; u < map.width; ++u) map.row(v)[u] = scaled(product_at(field, mask.weights, u, v), u, v);
  }
  return map;
}

double correlation_at(const GreyField& field, const CorrelationMask& mask, int u, int v) {
  const int w = mask.weights.width, h = mask.weights.height;
  float sum = 0, squares = 0, product = 0;
  for (int j = 0; j < h; ++j) {
    const Eigen::Map<const Eigen::VectorXf> greys(field.row(v + j) + u, w), weights(mask.weights.row(j), w);
    sum += greys.sum();
    squares += greys.squaredNorm();
    product += greys.dot(weights);
  }
  const float spread = squares - sum * sum / float(w * h);
  return spread > 1e-3F ? double{product} / std::sqrt(double{spread}) : 0;
}

std::vector<PatternPeak> pattern_peaks(const GreyField& field, const GreyField& patch,
                                       const PeakSearch& search) {
  std::vector<PatternPeak> peaks;
  const GreySpline spline(patch);
  const int beside =
      std::max(0, static_cast<int>(std::ceil((search.tolerance_rad - map_covers_rad) / map_step_rad)));
  for (int k = -beside; k <= beside; ++k) {
    const CorrelationMask mask = mask_of(patch, spline, search.rotation_rad + k * map_step_rad, 1);
    add_peaks(correlation_map(field, mask, search.least_sigma), mask, peaks);
  }
  peaks = best_of(std::move(peaks), search.most);
  std::vector<CorrelationMask> masks;
  double rotation = search.rotation_rad + 1;  // of the masks
  for (PatternPeak& peak : peaks) {
    const double turn = rotation_of(peak.warp);
    if (masks.empty() || turn != rotation) masks = masks_about(patch, spline, turn);
    rotation = turn;
    peak = refined(field, masks, peak);
  }
  return best_of(std::move(peaks), search.most);
}

}  // namespace zeropose
