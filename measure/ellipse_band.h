// The pixels that a fit of an ellipse looks at: the band across the outline one by one, the flat rings beside
// it as sums.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "measure/image.h"

namespace zeropose {

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
      rings;          // outer ones from the outline outwards, then inner ones
  int saturated = 0;  // pixels of the band at 255

  std::size_t size() const { return count; }
};

// Fills the band (reusing its memory): pixels within half_width_px of the outline
// (x - centre)^T shape^-1 (x - centre) = 1, and the rings. False: that reaches beyond the image; rings are
// cut there.
bool collect_band(const ImageView& image, const Eigen::Vector2d& centre_px, const Eigen::Matrix2d& shape_px2,
                  double half_width_px, EllipseBand& band);

// Half axes (major, minor) of an ellipse and the direction of the major one, rad.
struct HalfAxes {
  double major_px = 0, minor_px = 0, angle_rad = 0;
};
HalfAxes half_axes(const Eigen::Matrix2d& shape_px2);

}  // namespace zeropose
