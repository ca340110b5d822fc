// A window of an image as the search for regions looks at it: 8 bit, reduced to what the smallest mark needs,
// without the light's falling off, and with the range of grey levels of every tile.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "measure/image.h"

namespace zeropose {

class SearchImage {
 public:
  static constexpr int tile_width = 16, tile_height = 8;

  struct TileRange {
    std::uint8_t low = 255, high = 0;
  };

  // x and y within -1..1.
  struct FlatTile {
    double x, y, grey;
  };

  // reduction: 1, 2, 4 or 8 pixels of the image to one. Precondition: the window lies in the image.
  void prepare(const ImageView& image, const PixelWindow& window, int reduction);

  // Takes a surface of second order off where the light falls off by more than that over so many pixels of
  // the image. False: it does not, nothing was done.
  bool flatten(double from_grey, double over_px);

  int width() const { return width_; }
  int height() const { return height_; }
  int reduction() const { return reduction_; }
  bool empty() const { return width_ < 1 || height_ < 1; }
  // Readable up to a multiple of tile_width.
  const std::uint8_t* row(int v) const { return greys_.data() + std::ptrdiff_t{v} * stride_; }
  int tile_columns() const { return stride_ / tile_width; }
  int tile_rows() const { return (height_ + tile_height - 1) / tile_height; }
  const TileRange* tiles(int tile_row) const {
    return tiles_.data() + std::ptrdiff_t{tile_row} * tile_columns();
  }
  Eigen::Vector2d in_image(const Eigen::Vector2d& at) const { return origin_px_ + double(reduction_) * at; }

 private:
  void reduce_bytes(const ImageView& image, const PixelWindow& window);
  void reduce_words(const ImageView& image, const PixelWindow& window);
  void measure_tiles();
  std::vector<FlatTile> flat_tiles() const;

  int width_ = 0, height_ = 0, stride_ = 0, reduction_ = 1;
  Eigen::Vector2d origin_px_ = Eigen::Vector2d::Zero();  // the first pixel's centre
  std::vector<std::uint8_t> greys_;
  std::vector<TileRange> tiles_;
  std::vector<std::uint8_t> lows_, highs_, means_;  // of a row
  std::array<std::vector<std::uint8_t>, 2> halves_;
  std::vector<std::uint32_t> sums_;
};

}  // namespace zeropose
