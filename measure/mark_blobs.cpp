#include "measure/mark_blobs.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace zeropose {
namespace {

// Which of sixteen pixels are below the level (1..255), the first one in the lowest bit.
std::uint64_t below(const std::uint8_t* greys, int level) {
#ifdef __SSE2__
  const __m128i pixels = _mm_loadu_si128(reinterpret_cast<const __m128i*>(greys));
  const __m128i highest = _mm_set1_epi8(static_cast<char>(level - 1));
  return static_cast<std::uint64_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(_mm_min_epu8(pixels, highest), pixels)));
#else
  std::uint64_t bits = 0;
  for (int i = 0; i < 16; ++i) bits |= std::uint64_t{greys[i] < level} << i;
  return bits;
#endif
}

}  // namespace

const std::vector<Blob>& BlobFinder::find(const SearchImage& image, int level, bool bright,
                                          const BlobLimits& limits) {
  blobs_.clear();
  if (image.empty() || !cut_into_runs(image, std::clamp(level, 1, 255), bright)) return blobs_;
  join_runs();
  select(image, limits);
  measure_moments();
  measure_misfit();
  return blobs_;
}

// Tiles that lie on one side of the level as a whole need no look at their pixels.
bool BlobFinder::cut_into_runs(const SearchImage& image, int level, bool bright) {
  const int tiles_per_word = 64 / SearchImage::tile_width;
  runs_.clear();
  row_starts_.clear();
  most_runs_ = 200 + static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) / 24;
  const std::uint64_t flip = bright ? 0xFFFF : 0;
  for (int v = 0; v < image.height(); ++v) {
    if (v % SearchImage::tile_height == 0) sort_tiles(image, v / SearchImage::tile_height, level, bright);
    bits_ = uniform_;
    const std::uint8_t* greys = image.row(v);
    for (const int tile : mixed_)
      bits_[std::size_t(tile / tiles_per_word)] |=
          (below(greys + tile * SearchImage::tile_width, level) ^ flip)
          << (tile % tiles_per_word * SearchImage::tile_width);
    row_starts_.push_back(runs_.size());
    runs_of_row(v, image.width());
    if (runs_.size() > most_runs_) return false;
  }
  row_starts_.push_back(runs_.size());
  return true;
}

void BlobFinder::sort_tiles(const SearchImage& image, int tile_row, int level, bool bright) {
  const int tiles_per_word = 64 / SearchImage::tile_width;
  uniform_.assign(std::size_t((image.tile_columns() + tiles_per_word - 1) / tiles_per_word), 0);
  mixed_.clear();
  const SearchImage::TileRange* tiles = image.tiles(tile_row);
  for (int tile = 0; tile < image.tile_columns(); ++tile) {
    const bool all_below = tiles[tile].high < level, none_below = tiles[tile].low >= level;
    if (!all_below && !none_below) {
      mixed_.push_back(tile);
    } else if (all_below != bright) {
      uniform_[std::size_t(tile / tiles_per_word)] |= std::uint64_t{0xFFFF}
                                                      << (tile % tiles_per_word * SearchImage::tile_width);
    }
  }
}

// Runs start and end where a bit differs from the one before.
void BlobFinder::runs_of_row(int v, int width) {
  int start = -1;
  std::uint64_t before = 0;
  for (std::size_t word = 0; word < bits_.size(); ++word) {
    std::uint64_t turns = bits_[word] ^ (bits_[word] << 1 | before);
    before = bits_[word] >> 63;
    for (; turns != 0; turns &= turns - 1) {
      const int at = static_cast<int>(64 * word) + std::countr_zero(turns);
      if (at >= width) break;
      if (start < 0) {
        start = at;
      } else {
        runs_.push_back({start, at - 1, v, -1});
        start = -1;
      }
    }
  }
  if (start >= 0) runs_.push_back({start, width - 1, v, -1});
}

int BlobFinder::root_of(int region) {
  while (regions_[std::size_t(region)].parent != region) {
    auto& parent = regions_[std::size_t(region)].parent;
    parent = regions_[std::size_t(parent)].parent;
    region = parent;
  }
  return region;
}

void BlobFinder::join_runs() {
  regions_.clear();
  for (std::size_t row = 0; row + 1 < row_starts_.size(); ++row) {
    std::size_t above = row == 0 ? 0 : row_starts_[row - 1];
    const std::size_t above_end = row == 0 ? 0 : row_starts_[row];
    for (std::size_t r = row_starts_[row]; r < row_starts_[row + 1]; ++r) {
      Run& run = runs_[r];
      while (above < above_end && runs_[above].u1 < run.u0) ++above;
      for (std::size_t a = above; a < above_end && runs_[a].u0 <= run.u1; ++a) {
        const int root = root_of(runs_[a].region);
        if (run.region < 0) {
          run.region = root;
        } else {
          const int own = root_of(run.region);
          regions_[std::size_t(std::max(own, root))].parent = std::min(own, root);
        }
      }
      if (run.region < 0) {
        run.region = static_cast<int>(regions_.size());
        regions_.push_back({run.region, {run.u0, run.v, run.u1, run.v}, 0, -1});
      }
    }
  }
}

void BlobFinder::select(const SearchImage& image, const BlobLimits& limits) {
  for (Run& run : runs_) {
    run.region = root_of(run.region);
    Region& region = regions_[std::size_t(run.region)];
    region.box.u0 = std::min(region.box.u0, run.u0);
    region.box.u1 = std::max(region.box.u1, run.u1);
    region.box.v1 = std::max(region.box.v1, run.v);
    region.area += run.u1 - run.u0 + 1;
  }
  for (std::size_t k = 0; k < regions_.size(); ++k) {
    Region& region = regions_[k];
    const int side = std::max(region.box.width(), region.box.height());
    if (region.parent != static_cast<int>(k) || side < limits.min_side_px || side > limits.max_side_px)
      continue;
    Blob blob;
    blob.box = region.box;
    blob.area = region.area;
    blob.touches_window = region.box.u0 == 0 || region.box.v0 == 0 || region.box.u1 == image.width() - 1 ||
                          region.box.v1 == image.height() - 1;
    region.blob = static_cast<int>(blobs_.size());
    blobs_.push_back(blob);
  }
}

void BlobFinder::measure_moments() {
  moments_.assign(blobs_.size(), {});
  for (const Run& run : runs_) {
    const int index = regions_[std::size_t(run.region)].blob;
    if (index < 0) continue;
    const Blob& blob = blobs_[std::size_t(index)];
    Moments& m = moments_[std::size_t(index)];
    const double n = run.u1 - run.u0 + 1, first = run.u0 - blob.box.u0, v = run.v - blob.box.v0;
    const double su = n * first + n * (n - 1) / 2;
    m.n += n;
    m.u += su;
    m.v += n * v;
    m.uu += n * first * first + first * n * (n - 1) + (n - 1) * n * (2 * n - 1) / 6;
    m.uv += su * v;
    m.vv += n * v * v;
  }
  for (std::size_t k = 0; k < blobs_.size(); ++k) {
    const Moments& m = moments_[k];
    const Eigen::Vector2d mean(m.u / m.n, m.v / m.n);
    Blob& blob = blobs_[k];
    blob.centre_px = mean + Eigen::Vector2d(blob.box.u0, blob.box.v0);
    // Each pixel is a square with the variance 1/12 of its own.
    Eigen::Matrix2d covariance;
    covariance << m.uu / m.n + 1.0 / 12, m.uv / m.n, m.uv / m.n, m.vv / m.n + 1.0 / 12;
    blob.shape_px2 = 4 * (covariance - mean * mean.transpose());
  }
}

void BlobFinder::measure_misfit() {
  for (const Run& run : runs_) {
    const int index = regions_[std::size_t(run.region)].blob;
    if (index < 0) continue;
    const Blob& blob = blobs_[std::size_t(index)];
    const Eigen::Matrix2d& S = blob.shape_px2;
    const double y = run.v - blob.centre_px.y();
    const double half2 = S.determinant() * (1 - y * y / S(1, 1)) / S(1, 1);
    if (!(half2 > 0)) continue;
    const double middle = blob.centre_px.x() + S(0, 1) / S(1, 1) * y, half = std::sqrt(half2);
    const double from = std::max(run.u0 - 0.5, middle - half), to = std::min(run.u1 + 0.5, middle + half);
    moments_[std::size_t(index)].overlap += std::max(0.0, to - from);
  }
  for (std::size_t k = 0; k < blobs_.size(); ++k) {
    Blob& blob = blobs_[k];
    const double root = std::sqrt(std::max(0.0, blob.shape_px2.determinant()));
    const double between = static_cast<double>(blob.area) + std::numbers::pi * root - 2 * moments_[k].overlap;
    const double length = 2 * std::numbers::pi * std::sqrt(0.5 * blob.shape_px2.trace());
    blob.misfit_px = between / length;
  }
}

}  // namespace zeropose
