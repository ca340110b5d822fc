#include "measure/sharpness.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace zeropose {
namespace {

constexpr int block_px = 4, step_px = 2;
constexpr int near_px = 4, far_px = 24;
constexpr double least_difference = 12;  // grey levels over the far distance
constexpr double most_px = 30;           // beyond it an edge is none

// Means of blocks every two pixels, row by row.
struct Blocks {
  int columns = 0, rows = 0;
  std::vector<double> means;
  double at(int column, int row) const {
    return means[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(column)];
  }
};

Blocks blocks_of(const ImageView& image, const PixelWindow& window) {
  Blocks blocks;
  if (window.width() < block_px || window.height() < block_px) return blocks;
  blocks.columns = (window.width() - block_px) / step_px + 1;
  blocks.rows = (window.height() - block_px) / step_px + 1;
  for (int row = 0; row < blocks.rows; ++row)
    for (int column = 0; column < blocks.columns; ++column) {
      double sum = 0;
      for (int v = 0; v < block_px; ++v)
        for (int u = 0; u < block_px; ++u)
          sum += image.grey_at(window.u0 + step_px * column + u, window.v0 + step_px * row + v);
      blocks.means.push_back(sum / (block_px * block_px));
    }
  return blocks;
}

// Along rows and columns.
double largest_difference(const Blocks& blocks, int distance_px) {
  const int steps = distance_px / step_px;
  double largest = 0;
  for (int row = 0; row < blocks.rows; ++row)
    for (int column = 0; column < blocks.columns; ++column) {
      const double here = blocks.at(column, row);
      if (column + steps < blocks.columns)
        largest = std::max(largest, std::abs(here - blocks.at(column + steps, row)));
      if (row + steps < blocks.rows)
        largest = std::max(largest, std::abs(here - blocks.at(column, row + steps)));
    }
  return largest;
}

// Of a straight edge with this blur: the difference over the near distance by that over the far one.
double ratio_of_edge(double sigma_px) {
  const double root = 2 * std::sqrt(2.0) * sigma_px;
  return std::erf(near_px / root) / std::erf(far_px / root);
}

}  // namespace

std::optional<double> sharpest_edge_px(const ImageView& image, const PixelWindow& window) {
  const Blocks blocks = blocks_of(image, window);
  const double far = largest_difference(blocks, far_px), near = largest_difference(blocks, near_px);
  if (!(far >= least_difference)) return std::nullopt;
  double sigma_px = 0.1;
  while (sigma_px < most_px && ratio_of_edge(sigma_px) > near / far) sigma_px += 0.1;
  return sigma_px;
}

}  // namespace zeropose
