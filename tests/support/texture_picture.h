// Pictures of a random texture under an affine map: the texture is a formula (spots, plates and bars), laid
// out anew for each picture and gathered over square pixels under a numerically integrated Gaussian lens
// blur. No pixel of one picture makes a pixel of another.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tests/support/mark_picture.h"

namespace zeropose::test {

struct TextureFeature {
  enum Shape { spot, plate, bar } shape = spot;  // Gaussian; disc; rectangle. The last two with sharp edges.
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double size = 1;   // sigma; radius; half length
  double width = 1;  // bar: half width
  double angle_rad = 0;
  double grey = 0;
};

struct Texture {
  double background = 115;
  std::vector<TextureFeature> features;
};

// half_size: features lie in the square of +- half_size about the origin, about one in 16 px^2.
Texture random_texture(double half_size, std::uint64_t seed, double contrast = 1);

// Image place = place_px + linear * texture place; grey = gain * texture + offset.
struct TextureLook {
  Eigen::Vector2d place_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  double gain = 1, offset_grey = 0;
  double blur_sigma_px = 0.7;
};

Picture paint_texture(const Texture& texture, const TextureLook& look, int width_px, int height_px);

}  // namespace zeropose::test
