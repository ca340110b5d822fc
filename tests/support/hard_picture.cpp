#include "tests/support/hard_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/support/block_compression.h"

namespace zeropose::test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;

constexpr double pi = std::numbers::pi;

// Diffraction pattern of a round aperture, cut off softly from 3 to 4 px: what lies beyond is the veil's.
class Diffraction {
 public:
  explicit Diffraction(double first_zero_px) {
    for (std::size_t k = 0; k < table_.size(); ++k) {
      const double r = double(k) / per_px, x = 3.8317059702 * r / first_zero_px;
      const double amplitude = x < 1e-6 ? 1 : 2 * std::cyl_bessel_j(1.0, x) / x;
      const double t = std::clamp(r - 3, 0.0, 1.0);
      table_[k] = amplitude * amplitude * 0.5 * (1 + std::cos(pi * t));
      if (k > 0) total_ += 2 * pi * r * table_[k] / per_px;
    }
  }

  double operator()(double r_px) const {
    const double place = r_px * per_px;
    const auto k = static_cast<std::size_t>(place);
    if (k + 1 >= table_.size()) return 0;
    return (table_[k] + (place - double(k)) * (table_[k + 1] - table_[k])) / total_;
  }

  static constexpr double reach_px = 4;

 private:
  static constexpr int per_px = 128;
  std::array<double, static_cast<std::size_t>(per_px * 4) + 2> table_{};
  double total_ = 0;
};

// Weights at whole cells about the origin, symmetric.
struct Smear {
  int reach = 0;  // cells
  MatrixXd weight;
};

Smear smear_of(int reach) { return {reach, MatrixXd::Zero(2 * reach + 1, 2 * reach + 1)}; }

Smear pixel_box(double fill_factor) {
  const double half = 0.5 * std::sqrt(fill_factor) * cells_per_px;
  Smear smear = smear_of(static_cast<int>(std::ceil(half)));
  const auto share = [half](int k) { return std::clamp(half + 0.5 - std::abs(k), 0.0, 1.0); };
  for (int j = -smear.reach; j <= smear.reach; ++j) {
    for (int i = -smear.reach; i <= smear.reach; ++i) {
      smear.weight(smear.reach + j, smear.reach + i) = share(i) * share(j);
    }
  }
  return smear;
}

Smear confusion_disc(double radius_px) {
  const double radius = radius_px * cells_per_px;
  Smear smear = smear_of(static_cast<int>(std::ceil(radius)) + 1);
  for (int j = -smear.reach; j <= smear.reach; ++j) {
    for (int i = -smear.reach; i <= smear.reach; ++i) {
      smear.weight(smear.reach + j, smear.reach + i) = std::clamp(radius + 0.5 - std::hypot(i, j), 0.0, 1.0);
    }
  }
  return smear;
}

Smear motion_line(const Vector2d& motion_px) {
  const Vector2d cells = motion_px * cells_per_px;
  Smear smear = smear_of(static_cast<int>(std::ceil(0.5 * cells.cwiseAbs().maxCoeff())) + 1);
  const int steps = 4 * static_cast<int>(std::ceil(cells.norm())) + 1;
  for (int k = 0; k < steps; ++k) {
    const Vector2d at = cells * ((k + 0.5) / steps - 0.5) + Vector2d::Constant(smear.reach);
    const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y());
    const double x = at.x() - i, y = at.y() - j;
    smear.weight(j, i) += (1 - x) * (1 - y);
    smear.weight(j, i + 1) += x * (1 - y);
    smear.weight(j + 1, i) += (1 - x) * y;
    smear.weight(j + 1, i + 1) += x * y;
  }
  return smear;
}

MatrixXd smeared(const MatrixXd& kernel, const Smear& smear) {
  MatrixXd result = MatrixXd::Zero(kernel.rows(), kernel.cols());
  const Eigen::Index n = kernel.rows(), reach = smear.reach;
  for (Eigen::Index j = -reach; j <= reach; ++j) {
    for (Eigen::Index i = -reach; i <= reach; ++i) {
      const double weight = smear.weight(reach + j, reach + i);
      if (!(weight > 0)) continue;
      const Eigen::Index rows = n - std::abs(j), cols = n - std::abs(i);
      result.block(std::max<Eigen::Index>(0, j), std::max<Eigen::Index>(0, i), rows, cols) +=
          weight * kernel.block(std::max<Eigen::Index>(0, -j), std::max<Eigen::Index>(0, -i), rows, cols);
    }
  }
  return result;
}

int reach_of(const HardLens& lens) {
  return static_cast<int>(
      std::ceil(Diffraction::reach_px + lens.defocus_px + 0.5 * lens.motion_px.cwiseAbs().maxCoeff()));
}

// What one pixel gathers from the cells round its middle, and in all from each pixel of cells, row by row.
struct Kernel {
  int side_px = 0;
  std::vector<float> cells;
  std::vector<float> blocks;
};

Kernel kernel_from(const MatrixXd& weights) {
  Kernel kernel;
  const auto n = weights.rows();
  kernel.side_px = static_cast<int>(n) / cells_per_px;
  const double sum = weights.sum();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) kernel.cells.push_back(static_cast<float>(weights(j, i) / sum));
  }
  for (Eigen::Index j = 0; j < n; j += cells_per_px) {
    for (Eigen::Index i = 0; i < n; i += cells_per_px) {
      kernel.blocks.push_back(
          static_cast<float>(weights.block<cells_per_px, cells_per_px>(j, i).sum() / sum));
    }
  }
  return kernel;
}

Kernel kernel_of(const HardLens& lens, const HardSensor& sensor) {
  const Diffraction core(lens.first_zero_px);
  const Diffraction wide(lens.second_share > 0 ? lens.second_zero_px : lens.first_zero_px);
  const int n = (2 * reach_of(lens) + 1) * cells_per_px;
  MatrixXd weights(n, n);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double r = std::hypot(i - 0.5 * (n - 1), j - 0.5 * (n - 1)) / cells_per_px;
      weights(j, i) = (1 - lens.second_share) * core(r) + lens.second_share * wide(r);
    }
  }
  weights = smeared(weights, pixel_box(sensor.fill_factor));
  if (lens.defocus_px > 0) weights = smeared(weights, confusion_disc(lens.defocus_px));
  if (lens.motion_px.norm() > 0) weights = smeared(weights, motion_line(lens.motion_px));
  return kernel_from(weights);
}

// Gathers light through the kernel; quick where the cells of a pixel are all alike, quicker where all pixels
// are.
class Gathering {
 public:
  Gathering(const Radiance& radiance, const Kernel& kernel)
      : radiance_(radiance), kernel_(kernel), width_(radiance.width_cells / cells_per_px) {
    const int height = radiance.height_cells / cells_per_px;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width_; ++u) {
        const bool even = is_even(u, v);
        level_.push_back(even ? *cell(u, v) : uneven);
        const bool goes_on = even && u > 0 && level_[level_.size() - 2] == level_.back();
        alike_.push_back(even ? goes_on ? alike_.back() + 1 : 1 : 0);
      }
    }
  }

  // (u, v): the kernel's first pixel, counted from the margin's corner.
  double at(int u, int v) const {
    if (is_flat(u, v)) return double{level_[index(u, v)]};
    double sum = 0;
    const float* weight = kernel_.blocks.data();
    for (int j = 0; j < kernel_.side_px; ++j) {
      const float* level = level_.data() + index(u, v + j);
      float row = 0;
      for (int i = 0; i < kernel_.side_px; ++i, ++weight) {
        row += level[i] != uneven ? *weight * level[i] : of_pixel(u + i, v + j, i, j);
      }
      sum += double{row};
    }
    return sum;
  }

 private:
  static constexpr float uneven = -1;

  std::size_t index(int u, int v) const { return static_cast<std::size_t>(v * width_ + u); }

  bool is_flat(int u, int v) const {
    const float level = level_[index(u, v)];
    for (int j = 0; j < kernel_.side_px; ++j) {
      const std::size_t last = index(u + kernel_.side_px - 1, v + j);
      if (alike_[last] < kernel_.side_px || level_[last] != level) return false;
    }
    return true;
  }

  const float* cell(int u, int v) const {
    return radiance_.cells.data() + std::ptrdiff_t{v} * cells_per_px * radiance_.width_cells +
           std::ptrdiff_t{u} * cells_per_px;
  }

  bool is_even(int u, int v) const {
    const float* row = cell(u, v);
    const float level = *row;
    for (int j = 0; j < cells_per_px; ++j, row += radiance_.width_cells) {
      for (int i = 0; i < cells_per_px; ++i) {
        if (row[i] != level) return false;
      }
    }
    return true;
  }

  float of_pixel(int u, int v, int i, int j) const {
    const int kernel_row = kernel_.side_px * cells_per_px;
    const float *light = cell(u, v), *weight = kernel_.cells.data() + (j * kernel_row + i) * cells_per_px;
    std::array<float, cells_per_px> sums{};
    for (int y = 0; y < cells_per_px; ++y, light += radiance_.width_cells, weight += kernel_row) {
      for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += light[x] * weight[x];
    }
    float sum = 0;
    for (const float part : sums) sum += part;
    return sum;
  }

  const Radiance& radiance_;
  const Kernel& kernel_;
  int width_;
  std::vector<float> level_;  // of a pixel's cells, or uneven
  std::vector<int> alike_;    // how many pixels up to this one, along the row, have its level
};

void blur_lines(std::vector<double>& light, int count, int length, std::ptrdiff_t line, std::ptrdiff_t along,
                double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> weight, before(static_cast<std::size_t>(length));
  double total = 0;
  for (int k = -reach; k <= reach; ++k)
    total += weight.emplace_back(std::exp(-0.5 * k * k / (sigma * sigma)));
  for (int l = 0; l < count; ++l) {
    double* first = light.data() + l * line;
    for (int x = 0; x < length; ++x) before[static_cast<std::size_t>(x)] = first[x * along];
    for (int x = 0; x < length; ++x) {
      double sum = 0;
      for (int k = -reach; k <= reach; ++k) {
        sum += weight[static_cast<std::size_t>(k + reach)] *
               before[static_cast<std::size_t>(std::clamp(x + k, 0, length - 1))];
      }
      first[x * along] = sum / total;
    }
  }
}

void add_veil(Irradiance& picture, double share, double sigma_px) {
  std::vector<double> veil = picture.light;
  blur_lines(veil, picture.height_px, picture.width_px, picture.width_px, 1, sigma_px);
  blur_lines(veil, picture.width_px, picture.height_px, 1, picture.width_px, sigma_px);
  for (std::size_t k = 0; k < veil.size(); ++k) {
    picture.light[k] = (1 - share) * picture.light[k] + share * veil[k];
  }
}

// The lamp's share and the lens's, without the scene.
double light_at(const HardScene& scene, const HardLens& lens, const Vector2d& at_px) {
  const Vector2d middle(0.5 * (scene.width_px - 1), 0.5 * (scene.height_px - 1));
  const Vector2d along(std::cos(scene.light_direction_rad), std::sin(scene.light_direction_rad));
  const double half = middle.cwiseProduct(along.cwiseAbs()).sum();
  const double slope = (scene.light_ratio - 1) / (scene.light_ratio + 1);
  const double lamp = 1 + slope * along.dot(at_px - middle) / half;
  if (!(lens.focal_px > 0)) return lamp;
  const double tangent2 = (at_px - lens.axis_px).squaredNorm() / (lens.focal_px * lens.focal_px);
  return lamp / ((1 + tangent2) * (1 + tangent2));
}

void store(Shot& shot, double light, const HardSensor& sensor) {
  const double value = sensor.white * std::pow(std::clamp(light, 0.0, 1.0), sensor.gamma);
  const long count = std::lround(value);
  if (sensor.white <= 255) {
    shot.bytes.push_back(static_cast<std::uint8_t>(count));
    return;
  }
  const auto wide = static_cast<std::uint16_t>(count);
  std::array<std::uint8_t, 2> bytes{};
  std::memcpy(bytes.data(), &wide, bytes.size());
  shot.bytes.insert(shot.bytes.end(), bytes.begin(), bytes.end());
}

Shot finished(Shot shot, const HardSensor& sensor) {
  if (sensor.quality > 0 && sensor.white <= 255) {
    compress_and_expand(shot.bytes, shot.width_px, shot.height_px, sensor.quality);
  }
  return shot;
}

}  // namespace

Irradiance expose_scene(const HardScene& scene, const HardLens& lens, const HardSensor& sensor) {
  const int reach = reach_of(lens);
  const Radiance radiance = radiance_of(scene, sensor.gamma, reach);
  const Kernel kernel = kernel_of(lens, sensor);
  const Gathering gathering(radiance, kernel);
  Irradiance picture{scene.width_px, scene.height_px, {}};
  for (int v = 0; v < scene.height_px; ++v) {
    for (int u = 0; u < scene.width_px; ++u) picture.light.push_back(gathering.at(u, v));
  }
  if (lens.veil_share > 0) add_veil(picture, lens.veil_share, lens.veil_px);
  for (int v = 0; v < scene.height_px; ++v) {
    for (int u = 0; u < scene.width_px; ++u) {
      picture.light[static_cast<std::size_t>(v * scene.width_px + u)] *=
          light_at(scene, lens, Vector2d(u, v));
    }
  }
  return picture;
}

Shot shoot(const Irradiance& irradiance, const HardSensor& sensor, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Shot shot{irradiance.width_px, irradiance.height_px, sensor.white, {}};
  for (const double light : irradiance.light) {
    const double electrons = light * sensor.full_well;
    const double sigma = std::sqrt(electrons + sensor.read_noise * sensor.read_noise);
    store(shot, (electrons + sigma * normal(random)) / sensor.full_well, sensor);
  }
  return finished(std::move(shot), sensor);
}

Shot shoot_without_noise(const Irradiance& irradiance, const HardSensor& sensor) {
  Shot shot{irradiance.width_px, irradiance.height_px, sensor.white, {}};
  for (const double light : irradiance.light) store(shot, light, sensor);
  return finished(std::move(shot), sensor);
}

}  // namespace zeropose::test
