// The blurred ellipse with shading: its values, derivatives and normal equations over the pixels of a band.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cstddef>

#include "measure/ellipse_band.h"

namespace zeropose::ellipse_model {

constexpr int unknowns = 10;
enum Unknown { cu, cv, p11, p12, p22, blur, background, mark, gx, gy };
using Unknowns = Eigen::Matrix<double, unknowns, 1>;
using Information = Eigen::Matrix<double, unknowns, unknowns>;

// Limits of what counts as an edge's blur.
inline constexpr double smallest_blur_px = 0.25, largest_blur_px = 6;

// cu cv relative to the band's origin; P = R^2 times the inverse shape, so that its elements are near 1.
struct State {
  Unknowns at = Unknowns::Zero();
  double R2 = 1;
  double blur_c = 0, blur_s = 0;  // shape of the blur (BlurShape); not estimated here

  Eigen::Matrix2d shape() const {
    Eigen::Matrix2d P;
    P << at(p11), at(p12), at(p12), at(p22);
    return R2 * P.inverse();
  }
  bool plausible() const {
    return at.allFinite() && at(p11) > 0 && at(p11) * at(p22) - at(p12) * at(p12) > 1e-4 &&
           at(blur) > smallest_blur_px && at(blur) < largest_blur_px;
  }
};

enum class Wanted { all, gradient };

// Normal equations of the step: N step = g.
struct Normal {
  Information N = Information::Zero();
  Unknowns g = Unknowns::Zero();
  double squares = 0, count = 0;
};

// Displacement of the outline by sector: least squares of the residuals on the slope across the outline.
struct Sectors {
  static constexpr std::size_t count = 16;
  std::array<float, count> rs{}, ss{};  // sums of residual times slope, slope squared
};

// Takes every stride-th block of the band. The sectors are filled when only the gradient is wanted: that is
// the way of the last steps.
void evaluate_edge(const EllipseBand& band, const State& state, Wanted wanted, Normal& normal,
                   Sectors& sectors, std::size_t stride = 1);

}  // namespace zeropose::ellipse_model
