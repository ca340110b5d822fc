// Maximum-likelihood fit of a blurred outline with straight edges to the pixels round it (spec 50 M0; the
// model of spec 88 for other outlines than the ellipse).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "measure/contour_shape.h"
#include "measure/image.h"

namespace zeropose {

// Grey levels 0..255 of a window, row by row.
struct GreyWindow {
  PixelWindow pixels;  // in the image
  std::vector<float> grey;
  double rounding_variance = 1.0 / 12;  // of one count

  float at(int i, int j) const {  // column and row in the window
    return grey[static_cast<std::size_t>(j) * static_cast<std::size_t>(pixels.width()) +
                static_cast<std::size_t>(i)];
  }
  int width() const { return pixels.width(); }
  int height() const { return pixels.height(); }
};

struct ContourStart {
  int origin_i = 0, origin_j = 0;  // column and row in the window that the parameters refer to
  ShapeParameters shape = ShapeParameters::Zero();
  double blur_px = 0.8;
};

struct ContourFit {
  bool converged = false;
  ShapeParameters shape = ShapeParameters::Zero();
  Eigen::Matrix<double, most_shape_parameters, most_shape_parameters> covariance =
      Eigen::Matrix<double, most_shape_parameters, most_shape_parameters>::Zero();
  double mark_grey = 0, background_grey = 0;  // at the origin
  double blur_px = 0;                         // sigma of the edge
  // Grey levels, rms: residuals across the outline, those of the usual stretch of it, those of the flat cells
  // beside it that took part (0 if none did).
  double edge_rms = 0, noise_rms = 0, flat_rms = 0;
  double outline_px = 0;        // how far the stretches in use are from the outline, rms by what they know
  double outline_noise_px = 0;  // what the noise alone makes of that
  double outline_share = 0;     // of the stretches that fit and were used
  std::vector<bool> stretch_used;
  double saturated_share = 0;  // of the pixels across the outline that stand at white
  double pixels = 0;           // that took part
  int iterations = 0;
};

namespace contour {

enum Unknown { blur = most_shape_parameters, background, mark, gx, gy };
inline constexpr int unknowns = gy + 1;
using Unknowns = Eigen::Matrix<double, unknowns, 1>;
using Information = Eigen::Matrix<double, unknowns, unknowns>;

// Normal equations of the step: N step = g. Parameters the shape does not have: 1 in the diagonal of N.
struct NormalSums {
  Information N = Information::Zero();
  Unknowns g = Unknowns::Zero();
  double squares = 0, count = 0;
};

// Sums over flat pixels with e = (1, x, y), from the origin: all that a level with linear shading needs to
// know of them.
struct FlatSums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;  // e e^T
  double g = 0, gx = 0, gy = 0, gg = 0;                // grey e, grey^2

  void add(double grey, double px, double py);
  void add(const FlatSums& other);
};

// Pixels near an outline: those across it as columns, those beside it as sums by cell, a cell being one
// stretch and one layer of distance on one side.
struct PixelBand {
  std::vector<float> grey, x, y;
  std::vector<int> stretch;
  std::vector<FlatSums> flat;
  double core_px = 0;  // half the width of the layer across the outline
  std::size_t saturated = 0;
  std::size_t size() const { return grey.size(); }
};

// What of it takes part: pixels across the outline, and flat ones by what they show.
struct ActivePixels {
  std::vector<std::uint32_t> edge;
  FlatSums background, mark;
};

// What the judge of the cells wants of each pixel.
struct PixelResiduals {
  std::vector<float> residual, slope;  // grey levels; grey levels per px across the outline
};

}  // namespace contour

// Memory kept from one fit to the next to spare allocations. Holds no results.
struct ContourWorkspace {
  contour::PixelBand band;
  std::vector<ContourPlace> row;
  contour::ActivePixels active;
  std::vector<std::uint32_t> all;
  contour::PixelResiduals residuals;
};

// Model: (1 + g . x) (M + (B - M) cover(x; shape, s)), x from the origin. Unknown: the shape, blur s, levels
// B and M, relative shading g. Pixels within contour_core_px of the outline count stretch by stretch; those
// up to 9.5 px further out, cell by cell, where they are as flat as the model says. Stretches that do not fit
// (residuals or a displacement beyond noise and contour_rough_px) are left out. Covariance: inverse
// information times the residual variance, which is never taken below that of rounding. Not converged: no
// minimum near the start, or less than contour_least_share of the outline left.
inline constexpr double contour_least_share = 0.7, contour_rough_px = 0.2;
inline double contour_core_px(double blur_px) { return std::max(2.5, 3.2 * blur_px); }
ContourFit fit_contour(const GreyWindow& window, const ContourShape& shape, const ContourStart& start,
                       ContourWorkspace& workspace);

}  // namespace zeropose
