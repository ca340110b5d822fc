#include "tests/support/texture_picture.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

namespace zeropose::test {
namespace {

constexpr int fineness = 5;         // samples per pixel and axis
constexpr double edge_width = 0.4;  // two samples: the area of a sharp figure comes out right

double covered(double inside) { return std::clamp(inside / edge_width + 0.5, 0.0, 1.0); }

// c, s: direction of a bar.
double value_of(const TextureFeature& f, const Eigen::Vector2d& off, double c, double s) {
  const double square = off.squaredNorm();
  if (f.shape == TextureFeature::spot) {
    const double t = 0.5 * square / (f.size * f.size);
    return t < 10 ? f.grey * std::exp(-t) : 0;
  }
  if (f.shape == TextureFeature::plate) return f.grey * covered(f.size - std::sqrt(square));
  return f.grey * covered(f.size - std::abs(c * off.x() + s * off.y())) *
         covered(f.width - std::abs(c * off.y() - s * off.x()));
}

double reach_of(const TextureFeature& f) {
  if (f.shape == TextureFeature::spot) return 4.5 * f.size;
  return std::hypot(f.size, f.shape == TextureFeature::bar ? f.width : 0) + edge_width;
}

// Fine samples with a margin all round.
struct FineGrid {
  int margin, width, height;  // samples
  std::vector<double> grey;

  double place(int k) const { return (k - margin + 0.5) / fineness - 0.5; }
  int sample(double place) const {
    return static_cast<int>(std::lround((place + 0.5) * fineness - 0.5)) + margin;
  }
};

void add_feature(const TextureFeature& f, const TextureLook& look, FineGrid& grid) {
  const Eigen::Vector2d middle = look.place_px + look.linear * f.at;
  const double reach = reach_of(f);
  const double across = reach * look.linear.row(0).norm(), down = reach * look.linear.row(1).norm();
  const int i0 = std::max(0, grid.sample(middle.x() - across)),
            j0 = std::max(0, grid.sample(middle.y() - down));
  const int i1 = std::min(grid.width - 1, grid.sample(middle.x() + across));
  const int j1 = std::min(grid.height - 1, grid.sample(middle.y() + down));
  const Eigen::Matrix2d back = look.linear.inverse();
  const double c = std::cos(f.angle_rad), s = std::sin(f.angle_rad);
  for (int j = j0; j <= j1; ++j) {
    for (int i = i0; i <= i1; ++i) {
      const Eigen::Vector2d off = back * (Eigen::Vector2d(grid.place(i), grid.place(j)) - middle);
      grid.grey[static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.width) +
                static_cast<std::size_t>(i)] += value_of(f, off, c, s);
    }
  }
}

// Weights of the fine samples of one pixel: Gauss over the pixel's box, by summation.
std::vector<double> spread_of(double sigma, int margin) {
  std::vector<double> spread(static_cast<std::size_t>(2 * margin + fineness), 0.0);
  double total = 0;
  for (std::size_t k = 0; k < spread.size(); ++k) {
    const double x = (static_cast<double>(k) - margin + 0.5) / fineness - 0.5;
    for (int m = 0; m < 64; ++m) {
      const double y = (x - 0.5 + (m + 0.5) / 64) / sigma;
      spread[k] += std::exp(-0.5 * y * y);
    }
    total += spread[k];
  }
  for (double& weight : spread) weight /= total;
  return spread;
}

double between(double low, double high, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

}  // namespace

Texture random_texture(double half_size, std::uint64_t seed, double contrast) {
  std::mt19937_64 random(seed);
  Texture texture;
  const int count = static_cast<int>(4 * half_size * half_size / 16);
  for (int k = 0; k < count; ++k) {
    TextureFeature f;
    f.shape = k % 3 == 0 ? TextureFeature::spot : k % 3 == 1 ? TextureFeature::plate : TextureFeature::bar;
    f.at = {between(-half_size, half_size, random), between(-half_size, half_size, random)};
    f.size = f.shape == TextureFeature::bar ? between(2, 7, random) : between(1.2, 3.5, random);
    f.width = between(0.7, 2, random);
    f.angle_rad = between(0, 3.1416, random);
    f.grey = contrast * between(12, 40, random) * (between(-1, 1, random) < 0 ? -1 : 1);
    texture.features.push_back(f);
  }
  return texture;
}

Picture paint_texture(const Texture& texture, const TextureLook& look, int width_px, int height_px) {
  const int margin = static_cast<int>(std::ceil((4.5 * look.blur_sigma_px + 0.5) * fineness));
  FineGrid grid{margin, width_px * fineness + 2 * margin, height_px * fineness + 2 * margin, {}};
  const auto width = static_cast<std::size_t>(grid.width);
  grid.grey.assign(width * static_cast<std::size_t>(grid.height), texture.background);
  for (const TextureFeature& feature : texture.features) add_feature(feature, look, grid);
  const std::vector<double> spread = spread_of(look.blur_sigma_px, margin);
  const auto w = static_cast<std::size_t>(width_px), h = static_cast<std::size_t>(height_px);
  std::vector<double> across(w * static_cast<std::size_t>(grid.height), 0.0);
  for (std::size_t j = 0; j < static_cast<std::size_t>(grid.height); ++j) {
    for (std::size_t u = 0; u < w; ++u) {
      const double* const from = grid.grey.data() + j * width + u * fineness;
      for (std::size_t k = 0; k < spread.size(); ++k) across[j * w + u] += spread[k] * from[k];
    }
  }
  Picture picture{width_px, height_px, std::vector<double>(w * h, 0.0)};
  for (std::size_t v = 0; v < h; ++v) {
    for (std::size_t k = 0; k < spread.size(); ++k) {
      const double* const from = across.data() + (v * fineness + k) * w;
      for (std::size_t u = 0; u < w; ++u) picture.grey[v * w + u] += spread[k] * from[u];
    }
  }
  for (double& grey : picture.grey) grey = look.gain * grey + look.offset_grey;
  return picture;
}

}  // namespace zeropose::test
