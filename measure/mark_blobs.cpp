#include "measure/mark_blobs.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

namespace zeropose {
namespace {

constexpr std::size_t lead = 8;  // zeros before the pixels of a row, and at least as many behind

// Eight bytes, the first one lowest.
std::uint64_t eight_at(const std::uint8_t* bytes) {
  std::uint64_t eight = 0;
  std::memcpy(&eight, bytes, 8);
  if constexpr (std::endian::native == std::endian::big) eight = __builtin_bswap64(eight);
  return eight;
}

}  // namespace

const std::vector<Blob>& BlobFinder::find(const ImageView& image, const PixelWindow& window, int level,
                                          bool bright, const BlobLimits& limits) {
  blobs_.clear();
  if (window.empty() || !cut_into_runs(image, window, level, bright)) return blobs_;
  join_runs();
  select(window, limits);
  measure_moments();
  measure_misfit();
  return blobs_;
}

bool BlobFinder::cut_into_runs(const ImageView& image, const PixelWindow& window, int level, bool bright) {
  const auto width = static_cast<std::size_t>(window.width());
  row_.assign(lead + (width + 8) / 8 * 8 + 8, 0);
  runs_.clear();
  row_starts_.clear();
  most_runs_ = 200 + width * static_cast<std::size_t>(window.height()) / 24;
  const auto threshold = static_cast<std::uint8_t>(std::clamp(level, 0, 255));
  const std::uint8_t flip = bright ? 1 : 0;
  for (int v = window.v0; v <= window.v1; ++v) {
    const std::uint8_t* pixels = image.row(v) + window.u0;
    std::uint8_t* __restrict out = row_.data() + lead;
    for (std::size_t i = 0; i < width; ++i) {
      out[i] = static_cast<std::uint8_t>((pixels[i] < threshold ? 1 : 0) ^ flip);
    }
    row_starts_.push_back(runs_.size());
    if (!runs_of_row(v, window.u0, width)) return false;
  }
  row_starts_.push_back(runs_.size());
  return true;
}

// Runs start and end where a byte differs from the one before; the zeros round the row close the outer ones.
bool BlobFinder::runs_of_row(int v, int u0, std::size_t width) {
  int start = -1;
  for (std::size_t i = lead; i <= lead + width; i += 8) {
    std::uint64_t turns = eight_at(&row_[i]) ^ eight_at(&row_[i - 1]);
    for (; turns != 0; turns &= turns - 1) {
      const int at = u0 + static_cast<int>(i - lead) + std::countr_zero(turns) / 8;
      if (start < 0) {
        start = at;
      } else {
        runs_.push_back({start, at - 1, v, -1});
        start = -1;
      }
    }
  }
  return runs_.size() <= most_runs_;
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

void BlobFinder::select(const PixelWindow& window, const BlobLimits& limits) {
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
    blob.touches_window = region.box.u0 == window.u0 || region.box.v0 == window.v0 ||
                          region.box.u1 == window.u1 || region.box.v1 == window.v1;
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
