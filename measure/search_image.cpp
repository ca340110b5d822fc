#include "measure/search_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

void add_columns(const std::uint16_t* __restrict row, int width, std::uint32_t* __restrict sums) {
  for (int i = 0; i < width; ++i) sums[i] += row[i];
}

// Means of means, each rounded up at a half: the compiler has instructions for these.
void halve(const std::uint8_t* __restrict a, const std::uint8_t* __restrict b, int width,
           std::uint8_t* __restrict both, std::uint8_t* __restrict out) {
  for (int i = 0; i < 2 * width; ++i) both[i] = static_cast<std::uint8_t>((a[i] + b[i] + 1) >> 1);
  for (int i = 0; i < width; ++i)
    out[i] = static_cast<std::uint8_t>((both[2 * i] + both[2 * i + 1] + 1) >> 1);
}

void widen(const std::uint8_t* __restrict greys, int width, std::uint8_t* __restrict lows,
           std::uint8_t* __restrict highs) {
  for (int i = 0; i < width; ++i) {
    lows[i] = std::min(lows[i], greys[i]);
    highs[i] = std::max(highs[i], greys[i]);
  }
}

// Extremes of sixteen neighbours.
template <typename Choose>
std::uint8_t fold(const std::uint8_t* greys, const Choose& choose) {
  std::array<std::uint8_t, SearchImage::tile_width> best;
  std::copy_n(greys, best.size(), best.begin());
  for (std::size_t n = best.size() / 2; n > 0; n /= 2)
    for (std::size_t i = 0; i < n; ++i) best[i] = choose(best[i], best[i + n]);
  return best[0];
}

// Second order in x and y, both scaled to about -1..1.
using Surface = Eigen::Matrix<double, 6, 1>;

Surface terms_at(double x, double y) {
  Surface terms;
  terms << 1, x, y, x * x, x * y, y * y;
  return terms;
}

using FlatTile = SearchImage::FlatTile;

// A first look, cheap: the mean levels of the thirds across and down.
bool light_falls_off(const std::vector<FlatTile>& flat, double over_x, double over_y, double from_grey) {
  std::array<double, 3> across{}, down{}, n_across{}, n_down{};
  for (const FlatTile& tile : flat) {
    const auto i = static_cast<std::size_t>(std::clamp((tile.x + 1) * 1.5, 0.0, 2.0));
    const auto j = static_cast<std::size_t>(std::clamp((tile.y + 1) * 1.5, 0.0, 2.0));
    across[i] += tile.grey, ++n_across[i];
    down[j] += tile.grey, ++n_down[j];
  }
  const auto largest_step = [](const std::array<double, 3>& sum, const std::array<double, 3>& n) {
    const auto mean = [&](std::size_t i) { return sum[i] / std::max(1.0, n[i]); };
    double step = 0;
    for (std::size_t i = 0; i < 2; ++i)
      if (n[i] > 0 && n[i + 1] > 0) step = std::max(step, std::abs(mean(i + 1) - mean(i)));
    return 3 * step;
  };
  return largest_step(across, n_across) * over_x + largest_step(down, n_down) * over_y > from_grey;
}

// Least squares of the tiles that carry one surface: those far off are left out step by step.
bool fit_surface(const std::vector<FlatTile>& flat, Surface& surface) {
  double most = 1e9;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix<double, 6, 6> N = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    Surface g = Surface::Zero();
    for (const FlatTile& tile : flat) {
      const Surface terms = terms_at(tile.x, tile.y);
      if (std::abs(tile.grey - surface.dot(terms)) > most) continue;
      N += terms * terms.transpose();
      g += tile.grey * terms;
    }
    const SmallCholesky<6> solver(N);
    if (N(0, 0) < 12 || !solver.ok()) return false;
    surface = solver.solve(g);
    std::vector<double> off;
    for (const FlatTile& tile : flat)
      off.push_back(std::abs(tile.grey - surface.dot(terms_at(tile.x, tile.y))));
    const auto middle = off.begin() + std::ptrdiff_t(off.size() / 2);
    std::nth_element(off.begin(), middle, off.end());
    most = 3 * *middle + 1;
  }
  return surface.allFinite();
}

}  // namespace

void SearchImage::prepare(const ImageView& image, const PixelWindow& window, int reduction) {
  reduction_ = reduction;
  width_ = window.width() / reduction;
  height_ = window.height() / reduction;
  stride_ = (width_ + tile_width - 1) / tile_width * tile_width;
  const double half = 0.5 * (reduction - 1);
  origin_px_ = {window.u0 + half, window.v0 + half};
  greys_.resize(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(std::max(0, height_)));
  tiles_.clear();
  if (empty()) return;
  if (image.two_bytes()) {
    reduce_words(image, window);
  } else {
    reduce_bytes(image, window);
  }
  for (int v = 0; v < height_; ++v) {
    std::uint8_t* row = greys_.data() + std::ptrdiff_t{v} * stride_;
    std::fill(row + width_, row + stride_, row[width_ - 1]);
  }
  measure_tiles();
}

// Halves as often as it takes, rows in pairs: in one byte each, which rounds once more at every step.
void SearchImage::reduce_bytes(const ImageView& image, const PixelWindow& window) {
  for (int v = 0; v < height_; ++v) {
    std::uint8_t* out = greys_.data() + std::ptrdiff_t{v} * stride_;
    const std::uint8_t* source = image.row(window.v0 + v * reduction_) + window.u0;
    std::ptrdiff_t step = image.stride_bytes;
    int rows = reduction_, width = width_ * reduction_;
    if (rows == 1) std::copy_n(source, width, out);
    means_.resize(static_cast<std::size_t>(width));
    for (std::size_t k = 0; rows > 1; k = 1 - k) {
      rows /= 2, width /= 2;
      halves_[k].resize(static_cast<std::size_t>(rows * width));
      for (int r = 0; r < rows; ++r) {
        std::uint8_t* half = rows == 1 ? out : halves_[k].data() + std::ptrdiff_t{r} * width;
        halve(source + 2 * r * step, source + (2 * r + 1) * step, width, means_.data(), half);
      }
      source = halves_[k].data();
      step = width;
    }
  }
}

void SearchImage::reduce_words(const ImageView& image, const PixelWindow& window) {
  const float scale =
      static_cast<float>(image.grey_per_count()) / static_cast<float>(reduction_ * reduction_);
  for (int v = 0; v < height_; ++v) {
    sums_.assign(static_cast<std::size_t>(width_ * reduction_), 0);
    for (int k = 0; k < reduction_; ++k)
      add_columns(image.row<std::uint16_t>(window.v0 + v * reduction_ + k) + window.u0, width_ * reduction_,
                  sums_.data());
    std::uint8_t* out = greys_.data() + std::ptrdiff_t{v} * stride_;
    for (int i = 0; i < width_; ++i) {
      const auto* first = sums_.data() + std::ptrdiff_t{i} * reduction_;
      const auto sum = static_cast<float>(std::accumulate(first, first + reduction_, std::uint32_t{0}));
      out[i] = static_cast<std::uint8_t>(std::min(255.0F, sum * scale + 0.5F));
    }
  }
}

void SearchImage::measure_tiles() {
  tiles_.resize(static_cast<std::size_t>(tile_columns()) * static_cast<std::size_t>(tile_rows()));
  lows_.resize(static_cast<std::size_t>(stride_));
  highs_.resize(static_cast<std::size_t>(stride_));
  for (int tile_row = 0; tile_row < tile_rows(); ++tile_row) {
    const int from = tile_row * tile_height, to = std::min(height_, from + tile_height);
    std::copy_n(row(from), stride_, lows_.data());
    std::copy_n(row(from), stride_, highs_.data());
    for (int v = from + 1; v < to; ++v) widen(row(v), stride_, lows_.data(), highs_.data());
    TileRange* tiles = tiles_.data() + std::ptrdiff_t{tile_row} * tile_columns();
    for (int column = 0; column < tile_columns(); ++column) {
      const auto first = static_cast<std::size_t>(column) * tile_width;
      tiles[column] = {fold(&lows_[first], [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); }),
                       fold(&highs_[first], [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); })};
    }
  }
}

// Tiles whose range is like that of the flat ones, with their place in -1..1.
std::vector<SearchImage::FlatTile> SearchImage::flat_tiles() const {
  std::vector<int> ranges;
  for (const TileRange& tile : tiles_) ranges.push_back(tile.high - tile.low);
  const auto quarter = ranges.begin() + std::ptrdiff_t(ranges.size() / 4);
  std::nth_element(ranges.begin(), quarter, ranges.end());
  const int most = *quarter + *quarter / 2 + 2;
  std::vector<FlatTile> flat;
  for (int row = 0; row < tile_rows(); ++row)
    for (int column = 0; column < tile_columns(); ++column) {
      const TileRange& tile = tiles(row)[column];
      if (tile.high - tile.low > most) continue;
      flat.push_back({2.0 * (column + 0.5) * tile_width / stride_ - 1,
                      2.0 * (row + 0.5) * tile_height / height_ - 1, 0.5 * (tile.low + tile.high)});
    }
  return flat;
}

bool SearchImage::flatten(double from_grey, double over_px) {
  if (tiles_.size() < 24) return false;
  const std::vector<FlatTile> flat = flat_tiles();
  const double over_x = over_px / reduction_ / stride_, over_y = over_px / reduction_ / height_;
  if (!(light_falls_off(flat, over_x, over_y, 0.5 * from_grey))) return false;
  Surface surface = Surface::Zero();
  if (!fit_surface(flat, surface)) return false;
  const double fall = 2 * std::hypot((std::abs(surface(1)) + std::abs(surface(3))) * over_x,
                                     (std::abs(surface(2)) + std::abs(surface(5))) * over_y);
  if (!(fall > from_grey)) return false;
  for (int v = 0; v < height_; ++v) {
    std::uint8_t* __restrict row = greys_.data() + std::ptrdiff_t{v} * stride_;
    const double y = 2 * (v + 0.5) / height_ - 1;
    const auto a = static_cast<float>(surface(0) + y * (surface(2) + y * surface(5)) - 128);
    const auto b = static_cast<float>(surface(1) + y * surface(4)), c = static_cast<float>(surface(3));
    const float scale = 2.0F / static_cast<float>(stride_);
    for (int u = 0; u < stride_; ++u) {
      const float x = scale * (static_cast<float>(u) + 0.5F) - 1;
      const float grey = static_cast<float>(row[u]) - (a + x * (b + x * c)) + 0.5F;
      row[u] = static_cast<std::uint8_t>(std::clamp(grey, 0.0F, 255.0F));
    }
  }
  measure_tiles();
  return true;
}

}  // namespace zeropose
