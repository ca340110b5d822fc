// Connected dark or bright regions of a window at one grey level, by run lengths and union-find.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "measure/image.h"
#include "measure/search_image.h"

namespace zeropose {

// A region that may be a mark, in pixels of the search image.
struct Blob {
  PixelWindow box;
  bool touches_window = false;  // then only box and area are given
  std::int64_t area = 0;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Zero();  // of the ellipse with the same second moments
  double misfit_px = 0;  // area between region and ellipse by the length of the outline
};

struct BlobLimits {
  double min_side_px = 0, max_side_px = 0;  // of the box's longer side
};

// Memory kept from one call to the next. Holds no results.
class BlobFinder {
 public:
  // Regions (4-connected) of pixels below the level (or, for bright ones, at or above it) whose box is within
  // the limits, in the order of their first row. A level that falls apart into very many runs (noise about
  // the level) gives none.
  const std::vector<Blob>& find(const SearchImage& image, int level, bool bright, const BlobLimits& limits);

 private:
  struct Run {
    int u0, u1, v;
    int region;
  };
  struct Region {
    int parent;
    PixelWindow box;
    std::int64_t area;
    int blob;  // -1: not of interest
  };
  struct Moments {
    double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, overlap = 0;
  };

  bool cut_into_runs(const SearchImage& image, int level, bool bright);
  void sort_tiles(const SearchImage& image, int tile_row, int level, bool bright);
  void runs_of_row(int v, int width);
  void join_runs();
  int root_of(int region);
  void select(const SearchImage& image, const BlobLimits& limits);
  void measure_moments();
  void measure_misfit();

  std::vector<std::uint64_t> uniform_, bits_;  // one bit per pixel of a row: in the region or not
  std::vector<int> mixed_;                     // tiles that the level crosses
  std::vector<Run> runs_;
  std::vector<std::size_t> row_starts_;
  std::vector<Region> regions_;
  std::vector<Blob> blobs_;
  std::vector<Moments> moments_;
  std::size_t most_runs_ = 0;
};

}  // namespace zeropose
