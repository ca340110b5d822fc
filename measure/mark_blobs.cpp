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

constexpr int tiles_per_word = 64 / SearchImage::tile_width;

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

// Tiles that lie on one side of the level as a whole need no look at their pixels, and rows of nothing else
// are all alike.
bool BlobFinder::cut_into_runs(const SearchImage& image, int level, bool bright) {
  const auto width = static_cast<std::size_t>(image.width()),
             height = static_cast<std::size_t>(image.height());
  const std::size_t most_turns = 2 * (200 + width * height / 24);
  if (turns_.size() < most_turns + width + 2) turns_.resize(most_turns + width + 2);
  turn_count_ = 0;
  strips_.clear();
  for (int tile_row = 0; tile_row < image.tile_rows(); ++tile_row) {
    const bool mixed = sort_tiles(image, tile_row, level, bright);
    const int first = tile_row * SearchImage::tile_height;
    const int last = std::min(image.height(), first + SearchImage::tile_height) - 1;
    for (int v = first; v <= last; v = strips_.back().v1 + 1) {
      strips_.push_back({v, mixed ? v : last, turn_count_ / 2});
      runs_of_row(image.row(v), image.width(), level, bright);
      if (turn_count_ > most_turns) return false;
    }
  }
  strips_.push_back({image.height(), image.height(), turn_count_ / 2});
  return true;
}

// True if there are some that the level crosses.
bool BlobFinder::sort_tiles(const SearchImage& image, int tile_row, int level, bool bright) {
  const int columns = image.tile_columns();
  uniform_.assign(std::size_t((columns + tiles_per_word - 1) / tiles_per_word), 0);
  mixed_.assign(uniform_.size(), 0);
  const SearchImage::TileRange* tiles = image.tiles(tile_row);
  bool any_mixed = false;
  for (int tile = 0; tile < columns; ++tile) {
    const bool all_below = tiles[tile].high < level, none_below = tiles[tile].low >= level;
    const bool mixed = !all_below && !none_below, inside = !mixed && all_below != bright;
    const auto word = static_cast<std::size_t>(tile / tiles_per_word);
    const int place = tile % tiles_per_word;
    mixed_[word] |= std::uint32_t{mixed} << place;
    uniform_[word] |= (inside ? std::uint64_t{0xFFFF} : 0) << (place * SearchImage::tile_width);
    any_mixed = any_mixed || mixed;
  }
  return any_mixed;
}

// Runs start and end where a bit differs from the one before.
void BlobFinder::runs_of_row(const std::uint8_t* greys, int width, int level, bool bright) {
  const std::uint64_t flip = bright ? 0xFFFF : 0;
  const int words = (width + 63) / 64;
  std::uint64_t before = 0;
  int* turn = turns_.data() + turn_count_;
  for (int word = 0; word < words; ++word) {
    std::uint64_t bits = uniform_[std::size_t(word)];
    for (std::uint32_t tiles = mixed_[std::size_t(word)]; tiles != 0; tiles &= tiles - 1) {
      const int first = std::countr_zero(tiles) * SearchImage::tile_width;
      bits |= (below(greys + 64 * word + first, level) ^ flip) << first;
    }
    if (width - 64 * word < 64) bits &= (std::uint64_t{1} << (width - 64 * word)) - 1;
    for (std::uint64_t turns = bits ^ (bits << 1 | before); turns != 0; turns &= turns - 1)
      *turn++ = 64 * word + std::countr_zero(turns);
    before = bits >> 63;
  }
  if (before != 0) *turn++ = width;
  turn_count_ = static_cast<std::size_t>(turn - turns_.data());
}

int BlobFinder::root_of(int region) {
  while (regions_[std::size_t(region)].parent != region) {
    auto& parent = regions_[std::size_t(region)].parent;
    parent = regions_[std::size_t(parent)].parent;
    region = parent;
  }
  return region;
}

// The region of a run by those that it touches in the strip above, or a new one.
int BlobFinder::join_with_above(std::size_t run, std::size_t& above, std::size_t above_end) {
  const int from = turns_[2 * run], past = turns_[2 * run + 1];
  int region = -1;
  while (above < above_end && turns_[2 * above + 1] <= from) ++above;
  for (std::size_t a = above; a < above_end && turns_[2 * a] < past; ++a) {
    const int root = root_of(region_of_run_[a]);
    if (region < 0 || region == root) {
      region = root;
    } else {
      regions_[std::size_t(std::max(region, root))].parent = std::min(region, root);
      region = std::min(region, root);
    }
  }
  if (region >= 0) return region;
  regions_.push_back({static_cast<int>(regions_.size()), {from, 0, from, 0}, 0, -1});
  return static_cast<int>(regions_.size()) - 1;
}

void BlobFinder::join_runs() {
  regions_.clear();
  region_of_run_.resize(turn_count_ / 2);
  std::size_t above = 0;
  for (std::size_t k = 0; k + 1 < strips_.size(); ++k) {
    const Strip& strip = strips_[k];
    for (std::size_t run = strip.first_run; run < strips_[k + 1].first_run; ++run) {
      const std::size_t regions = regions_.size();
      const int index = join_with_above(run, above, strip.first_run);
      region_of_run_[run] = index;
      Region& region = regions_[std::size_t(index)];
      if (regions < regions_.size()) region.box.v0 = strip.v0;
      region.box.u0 = std::min(region.box.u0, turns_[2 * run]);
      region.box.u1 = std::max(region.box.u1, turns_[2 * run + 1] - 1);
      region.box.v1 = strip.v1;
      region.area += std::int64_t{turns_[2 * run + 1] - turns_[2 * run]} * (strip.v1 - strip.v0 + 1);
    }
    above = strip.first_run;
  }
}

// Parts of a region stand behind the one that they were joined to.
void BlobFinder::select(const SearchImage& image, const BlobLimits& limits) {
  for (std::size_t k = regions_.size(); k-- > 0;) {
    const Region& part = regions_[k];
    Region& whole = regions_[std::size_t(part.parent)];
    if (&whole == &part) continue;
    whole.box.u0 = std::min(whole.box.u0, part.box.u0);
    whole.box.v0 = std::min(whole.box.v0, part.box.v0);
    whole.box.u1 = std::max(whole.box.u1, part.box.u1);
    whole.box.v1 = std::max(whole.box.v1, part.box.v1);
    whole.area += part.area;
  }
  for (std::size_t k = 0; k < regions_.size(); ++k) {
    Region& region = regions_[k];
    if (region.parent != static_cast<int>(k)) {
      region.blob = regions_[std::size_t(region.parent)].blob;
      continue;
    }
    const int side = std::max(region.box.width(), region.box.height());
    if (side < limits.min_side_px || side > limits.max_side_px) continue;
    Blob blob;
    blob.box = region.box;
    blob.area = region.area;
    blob.touches_window = region.box.u0 == 0 || region.box.v0 == 0 || region.box.u1 == image.width() - 1 ||
                          region.box.v1 == image.height() - 1;
    if (!blob.touches_window) region.blob = static_cast<int>(blobs_.size());
    blobs_.push_back(blob);
  }
  pieces_.clear();
  if (blobs_.empty()) return;
  for (std::size_t k = 0; k + 1 < strips_.size(); ++k) {
    for (std::size_t run = strips_[k].first_run; run < strips_[k + 1].first_run; ++run) {
      const int blob = regions_[std::size_t(region_of_run_[run])].blob;
      if (blob >= 0)
        pieces_.push_back({blob, turns_[2 * run], turns_[2 * run + 1], strips_[k].v0, strips_[k].v1});
    }
  }
}

void BlobFinder::measure_moments() {
  moments_.assign(blobs_.size(), {});
  for (const Piece& piece : pieces_) {
    const Blob& blob = blobs_[std::size_t(piece.blob)];
    Moments& m = moments_[std::size_t(piece.blob)];
    const double n = piece.past - piece.from, first = piece.from - blob.box.u0;
    const double rows = piece.v1 - piece.v0 + 1, top = piece.v0 - blob.box.v0;
    const double su = n * first + n * (n - 1) / 2, sv = rows * top + rows * (rows - 1) / 2;
    m.n += n * rows;
    m.u += su * rows;
    m.v += n * sv;
    m.uu += (n * first * first + first * n * (n - 1) + (n - 1) * n * (2 * n - 1) / 6) * rows;
    m.uv += su * sv;
    m.vv += n * (rows * top * top + top * rows * (rows - 1) + (rows - 1) * rows * (2 * rows - 1) / 6);
  }
  for (std::size_t k = 0; k < blobs_.size(); ++k) {
    const Moments& m = moments_[k];
    Blob& blob = blobs_[k];
    if (blob.touches_window) continue;
    const Eigen::Vector2d mean(m.u / m.n, m.v / m.n);
    blob.centre_px = mean + Eigen::Vector2d(blob.box.u0, blob.box.v0);
    // Each pixel is a square with the variance 1/12 of its own.
    Eigen::Matrix2d covariance;
    covariance << m.uu / m.n + 1.0 / 12, m.uv / m.n, m.uv / m.n, m.vv / m.n + 1.0 / 12;
    blob.shape_px2 = 4 * (covariance - mean * mean.transpose());
  }
}

void BlobFinder::measure_misfit() {
  for (const Piece& piece : pieces_) {
    const Blob& blob = blobs_[std::size_t(piece.blob)];
    const Eigen::Matrix2d& S = blob.shape_px2;
    for (int v = piece.v0; v <= piece.v1; ++v) {
      const double y = v - blob.centre_px.y();
      const double half2 = S.determinant() * (1 - y * y / S(1, 1)) / S(1, 1);
      if (!(half2 > 0)) continue;
      const double middle = blob.centre_px.x() + S(0, 1) / S(1, 1) * y, half = std::sqrt(half2);
      const double from = std::max(piece.from - 0.5, middle - half),
                   to = std::min(piece.past - 0.5, middle + half);
      moments_[std::size_t(piece.blob)].overlap += std::max(0.0, to - from);
    }
  }
  for (std::size_t k = 0; k < blobs_.size(); ++k) {
    Blob& blob = blobs_[k];
    if (blob.touches_window) continue;
    const double root = std::sqrt(std::max(0.0, blob.shape_px2.determinant()));
    const double between = static_cast<double>(blob.area) + std::numbers::pi * root - 2 * moments_[k].overlap;
    const double length = 2 * std::numbers::pi * std::sqrt(0.5 * blob.shape_px2.trace());
    blob.misfit_px = between / length;
  }
}

}  // namespace zeropose
