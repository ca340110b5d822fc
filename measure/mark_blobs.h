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
  // Rows v0..v1 that the level cuts alike; its runs follow on first_run.
  struct Strip {
    int v0, v1;
    std::size_t first_run;
  };
  struct Region {
    int parent;
    PixelWindow box;
    std::int64_t area;
    int blob;  // -1: not of interest
  };
  // A run of a region of interest.
  struct Piece {
    int blob;
    int from, past, v0, v1;  // columns from..past-1
  };
  struct Moments {
    double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, overlap = 0;
  };

  bool cut_into_runs(const SearchImage& image, int level, bool bright);
  bool sort_tiles(const SearchImage& image, int tile_row, int level, bool bright);
  void runs_of_row(const std::uint8_t* greys, int width, int level, bool bright);
  void join_runs();
  int join_with_above(std::size_t run, std::size_t& above, std::size_t above_end);
  int root_of(int region);
  void select(const SearchImage& image, const BlobLimits& limits);
  void measure_moments();
  void measure_misfit();

  std::vector<std::uint64_t>
      uniform_;  // one bit per pixel of a row: in the region, where its tile is of one kind
  std::vector<std::uint32_t> mixed_;  // of every word's tiles those that the level crosses, as bits
  std::vector<int> turns_;            // columns where a run starts and where it has ended, by turns
  std::size_t turn_count_ = 0;
  std::vector<Strip> strips_;  // and one behind the last
  std::vector<int> region_of_run_;
  std::vector<Region> regions_;
  std::vector<Blob> blobs_;
  std::vector<Piece> pieces_;
  std::vector<Moments> moments_;
};

}  // namespace zeropose
