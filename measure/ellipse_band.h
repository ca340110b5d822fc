// The pixels that a fit of an ellipse looks at: the band across the outline one by one, the flat rings beside
// it as sums.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "measure/image.h"

namespace zeropose {

// The outline in sixty-four sectors; bit k of a set stands for the k-th.
using OutlineSectors = std::uint64_t;

class SectorOf {
 public:
  static constexpr int count = 64;

  // shape: of the outline x^T shape^-1 x = 1.
  explicit SectorOf(const Eigen::Matrix2d& shape)
      : a_(1 / std::sqrt(shape(0, 0))),
        b_(shape(0, 1) / shape(0, 0)),
        c_(1 / std::sqrt(shape(1, 1) - shape(0, 1) * b_)) {}
  // Of a place relative to the centre: by the angle that it has once the outline is a circle.
  int operator()(double x, double y) const {
    const double angle = std::atan2((y - b_ * x) * c_, x * a_);
    return std::min(count - 1, static_cast<int>((angle / std::numbers::pi + 1) * (count / 2)));
  }

 private:
  double a_, b_, c_;
};

// Sums over a flat ring with e = (1, x, y), x and y relative to the band's origin: all that a level with
// linear shading needs to know of its pixels.
struct FlatRing {
  Eigen::Matrix3d ee = Eigen::Matrix3d::Zero();  // sum e e^T
  Eigen::Vector3d ge = Eigen::Vector3d::Zero();  // sum grey e
  double gg = 0;                                 // sum grey^2
  double count() const { return ee(0, 0); }

  // Sum of squared residuals to the plane grey = plane . e.
  double squares(const Eigen::Vector3d& plane) const {
    return gg - 2 * plane.dot(ge) + plane.dot(ee * plane);
  }
};

struct EllipseBand {
  static constexpr std::size_t outer_rings = 3, inner_rings = 2;

  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  // the outline it was collected for
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Zero();
  double half_width_px = 0;
  int origin_u = 0, origin_v = 0;
  // Pixels across the outline; readable up to a multiple of 16, what is behind count has no meaning.
  std::vector<float> grey, x, y;
  std::size_t count = 0;
  std::array<FlatRing, outer_rings + inner_rings>
      rings;                  // outer ones from the outline outwards, then inner ones
  int saturated = 0;          // pixels of the band at white
  double rounding_grey2 = 0;  // variance of the camera's own steps

  std::size_t size() const { return count; }
};

// Fills the band (reusing its memory): pixels within half_width_px of the outline
// (x - centre)^T shape^-1 (x - centre) = 1, and the rings, without the hidden sectors. False: that reaches
// beyond the image; rings are cut there.
bool collect_band(const ImageView& image, const Eigen::Vector2d& centre_px, const Eigen::Matrix2d& shape_px2,
                  double half_width_px, OutlineSectors hidden, EllipseBand& band);

// Half axes (major, minor) of an ellipse and the direction of the major one, rad.
struct HalfAxes {
  double major_px = 0, minor_px = 0, angle_rad = 0;
};
HalfAxes half_axes(const Eigen::Matrix2d& shape_px2);

}  // namespace zeropose
