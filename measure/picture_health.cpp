#include "measure/picture_health.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "measure/tally.h"

namespace zeropose {
namespace {

constexpr int stride = 4;  // of rows and columns that are counted

template <typename Pixel>
void count_greys(const ImageView& image, PictureHealth& health) {
  const double per_count = image.grey_per_count();
  const int white = static_cast<int>(std::ceil(saturated_grey / per_count));
  const int black = static_cast<int>(std::floor(dark_grey / per_count));
  std::int64_t pixels = 0, saturated = 0, dark = 0, sum = 0;
  for (int v = 0; v < image.height_px; v += stride) {
    const Pixel* row = image.row<Pixel>(v);
    for (int u = 0; u < image.width_px; u += stride) {
      const int value = row[u];
      ++pixels;
      saturated += value >= white;
      dark += value <= black;
      sum += value;
    }
  }
  if (pixels == 0) return;
  const auto share = [pixels](std::int64_t count) {
    return static_cast<double>(count) / static_cast<double>(pixels);
  };
  health.saturated_share = share(saturated);
  health.dark_share = share(dark);
  health.mean_grey = per_count * share(sum);
}

// --- noise

constexpr int noise_rows = 8;
constexpr int most_bend = 255;  // larger ones are edges

// The median of |a - 2 b + c| of three neighbours, between the whole numbers; pixels at either end of the
// scale have no noise and are left out.
template <typename Pixel>
double noise_of(const ImageView& image) {
  Tally<most_bend + 1> bends;
  std::size_t turn = 0;
  // Deep pixels in steps that keep their noise in the range of the tally.
  const int step = std::max(1, (image.white + 1) / 1024);
  const int rows = std::max(1, image.height_px / noise_rows);
  for (int v = rows / 2; v < image.height_px; v += rows) {
    const Pixel* row = image.row<Pixel>(v);
    for (int u = 1; u + 1 < image.width_px; ++u)
      if (row[u] > 0 && row[u] < image.white)
        bends.add(turn++, std::min(most_bend, std::abs(row[u - 1] - 2 * row[u] + row[u + 1]) / step));
  }
  const double rounding = image.grey_per_count() / std::sqrt(12.0);
  if (turn == 0) return rounding;
  const auto counts = bends.counts();
  const double half = 0.5 * static_cast<double>(turn);
  double below = 0;
  std::size_t middle = 0;
  while (middle < most_bend && below + counts[middle] < half) below += counts[middle++];
  const double part = (half - below) / std::max(1, counts[middle]), at = static_cast<double>(middle);
  // A count of 0 comes from -0.5..0.5, of k from k - 0.5..k + 0.5 and its negative.
  const double bend = step > 1 ? at + part : middle == 0 ? 0.5 * part : at - 0.5 + part;
  return std::max(rounding, image.grey_per_count() * step * bend / (0.6745 * std::sqrt(6.0)));
}

// --- focus

constexpr int band_rows = 2;      // that are averaged
constexpr int band_period = 24;   // from one band to the next
constexpr int reach = 12;         // from an edge to the surfaces on both sides, px
constexpr double least_step = 8;  // grey levels from one side of an edge to the other
constexpr double least_blur_px = 0.3, most_blur_px = 15, blur_factor = 1.02;

// Profiles across an edge as ratios of the step from side to side, for blurs that grow by blur_factor.
struct EdgeModel {
  double blur_px = 0;
  double steepest = 0;  // two pixels apart, at the edge
  double wide = 0;      // means of the four pixels on each side
};

double bell_share(double x_px, double blur_px) { return std::erf(x_px / (std::sqrt(2.0) * blur_px)); }

EdgeModel model_of(double blur_px) {
  const double shown = std::hypot(blur_px, 1 / std::sqrt(12.0));  // a pixel is a square
  const auto mean = [shown](int from) {
    double sum = 0;
    for (int x = from; x < from + 4; ++x) sum += bell_share(x, shown);
    return sum / 4;
  };
  const double far = mean(reach - 3);
  return {blur_px, bell_share(1, shown) / far, mean(1) / far};
}

const std::vector<EdgeModel>& edge_models() {
  static const std::vector<EdgeModel> models = [] {
    std::vector<EdgeModel> list;
    for (double blur_px = least_blur_px; blur_px < most_blur_px; blur_px *= blur_factor)
      list.push_back(model_of(blur_px));
    return list;
  }();
  return models;
}

// The steepest place tells small blurs apart, the wide one large ones in spite of noise.
double blur_of(double steepest, double wide) {
  constexpr double wide_from_px = 2.5;
  const auto& models = edge_models();
  const auto of_wide = std::ranges::lower_bound(models, wide, std::greater<>(), &EdgeModel::wide);
  if (of_wide == models.end()) return most_blur_px;
  if (of_wide->blur_px > wide_from_px) return of_wide->blur_px;
  const auto of_steepest = std::ranges::lower_bound(models, steepest, std::greater<>(), &EdgeModel::steepest);
  return of_steepest == models.end() ? of_wide->blur_px : of_steepest->blur_px;
}

template <typename Pixel>
void average_rows(const ImageView& image, int v, std::vector<float>& profile) {
  const auto scale = static_cast<float>(image.grey_per_count() / band_rows);
  const Pixel *upper = image.row<Pixel>(v), *lower = image.row<Pixel>(v + 1);
  float* __restrict out = profile.data();
  for (int u = 0; u < image.width_px; ++u) out[u] = scale * static_cast<float>(upper[u] + lower[u]);
}

struct Edge {
  float height = 0;  // of the step, over the wide distance
  double blur_px = 0;
};

float mean4(const float* from) { return 0.25F * (from[0] + from[1] + from[2] + from[3]); }
float wide_step(const float* at) { return mean4(at + 1) - mean4(at - 4); }

// The largest difference of pixels two apart near the edge, between the pixels.
double steepest_step(const float* at, float sign) {
  const auto step = [at, sign](int i) { return sign * (at[i + 1] - at[i - 1]); };
  int best = -2;
  for (int i = -1; i <= 2; ++i)
    if (step(i) > step(best)) best = i;
  const double before = step(best - 1), here = step(best), after = step(best + 1);
  const double bend = before - 2 * here + after;
  return bend < 0 ? here - (after - before) * (after - before) / (8 * bend) : here;
}

// steps: room for as many numbers as the profile has.
void add_edges(const std::vector<float>& profile, std::vector<float>& steps, float least,
               std::vector<Edge>& edges) {
  const int width = static_cast<int>(profile.size());
  const float* __restrict from = profile.data();
  float* __restrict step = steps.data();
  for (int u = reach - 1; u <= width - reach; ++u) step[u] = wide_step(from + u);
  for (int u = reach; u < width - reach; ++u) {
    const float* at = from + u;
    const float here = step[u], height = std::abs(here);
    if (height < least || height < std::abs(step[u - 1]) || height <= std::abs(step[u + 1])) continue;
    const float sign = here > 0 ? 1.F : -1.F;
    const double far = sign * (mean4(at + reach - 3) - mean4(at - reach));
    if (far < 0.8 * height) continue;  // a line, no edge
    edges.push_back({height, blur_of(steepest_step(at, sign) / far, height / far)});
  }
}

// The lowest eighth over the edges of at least half of the largest step: those that lie across the rows.
std::optional<double> focus_of(std::vector<Edge> edges) {
  if (edges.empty()) return std::nullopt;
  const float least = 0.5F * std::ranges::max_element(edges, {}, &Edge::height)->height;
  std::erase_if(edges, [least](const Edge& edge) { return edge.height < least; });
  const auto sharp = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 8);
  std::ranges::nth_element(edges, sharp, {}, &Edge::blur_px);
  return sharp->blur_px;
}

template <typename Pixel>
std::optional<double> focus_of(const ImageView& image, double noise_grey) {
  if (image.width_px <= 2 * reach || image.height_px < band_rows) return std::nullopt;
  // The noise of a wide step is half of a pixel's, and there are some ten thousand places.
  const float least = static_cast<float>(std::max(least_step, 3 * noise_grey));
  std::vector<float> profile(static_cast<std::size_t>(image.width_px)), steps(profile.size());
  std::vector<Edge> edges;
  for (int v = 0; v + band_rows <= image.height_px; v += band_period) {
    average_rows<Pixel>(image, v, profile);
    add_edges(profile, steps, least, edges);
  }
  return focus_of(std::move(edges));
}

template <typename Pixel>
PictureHealth health_of(const ImageView& image) {
  PictureHealth health;
  count_greys<Pixel>(image, health);
  health.noise_grey = noise_of<Pixel>(image);
  health.focus_px = focus_of<Pixel>(image, health.noise_grey);
  return health;
}

}  // namespace

PictureHealth picture_health(const ImageView& image) {
  return image.two_bytes() ? health_of<std::uint16_t>(image) : health_of<std::uint8_t>(image);
}

HealthTrend followed(HealthTrend trend, double value) {
  constexpr int first_values = 5, least_in_a_row = 8;
  constexpr double share = 0.2, band = 0.25;
  ++trend.count;
  if (trend.count <= first_values) {
    trend.first += (value - trend.first) / trend.count;
    trend.mean = trend.first;
    return trend;
  }
  trend.mean += share * (value - trend.mean);
  const bool outside = std::abs(trend.mean - trend.first) > band * trend.first;
  trend.in_a_row = outside != trend.changed ? trend.in_a_row + 1 : 0;
  if (trend.in_a_row >= least_in_a_row) {
    trend.changed = outside;
    trend.in_a_row = 0;
  }
  return trend;
}

}  // namespace zeropose
