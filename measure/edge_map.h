// Places where the grey levels rise steepest, with the direction of the rise.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/search_image.h"

namespace zeropose {

struct EdgePoint {
  Eigen::Vector2f at;    // pixels of the search image, to tenths
  Eigen::Vector2f rise;  // unit vector, from dark to bright
  float steepness = 0;   // grey levels per pixel of the search image
};

// Points of at least that steepness, row by row; and which of them lies in which pixel.
struct EdgeMap {
  int width = 0, height = 0;
  std::vector<EdgePoint> points;
  std::vector<int> index;  // per pixel: into points, -1 for none

  int at(int u, int v) const {
    return u < 0 || v < 0 || u >= width || v >= height ? -1 : index[std::size_t(v * width + u)];
  }
};
EdgeMap edge_map(const SearchImage& image, float least_steepness);

}  // namespace zeropose
