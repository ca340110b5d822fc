#include "sim/disc_image.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int samples_per_px = 4;

// Where a point of the image lies against the outline, seen as straight there.
struct EdgePoint {
  double distance_px = 0;              // negative inside
  Vector2d normal = Vector2d::Zero();  // unit, outward
};

// The disc's outline in the image.
class Outline {
 public:
  Outline(const CameraModel& camera, const FlatDisc& disc)
      : camera_(camera),
        R_MC_(disc.X_CM.linear().transpose()),
        p_MC_(-(R_MC_ * disc.X_CM.translation())),
        radius_mm_(disc.radius_mm) {
    const auto centre = project_with_jacobian(camera, disc.X_CM.translation());
    if (!centre) return;
    centre_px_ = centre->u_px;
    px_per_mm_ = centre->du_dp * disc.X_CM.linear().leftCols<2>();
    mm_per_px_transposed_ = px_per_mm_.inverse().transpose();
  }

  bool has_image() const { return centre_px_.has_value(); }
  const Vector2d& centre_px() const { return *centre_px_; }

  // Half sizes of an upright box round the outline, generous for perspective.
  Vector2d half_box_px() const { return 1.05 * radius_mm_ * px_per_mm_.rowwise().norm(); }

  EdgePoint edge_at(const Vector2d& u_px) const {
    const auto d_C = ray(camera_, u_px);
    if (!d_C) return {far_, Vector2d::UnitX()};
    const Vector3d d_M = R_MC_ * *d_C;
    const Vector2d q = p_MC_.head<2>() - p_MC_.z() / d_M.z() * d_M.head<2>();
    const double r = q.norm();
    if (!(r > 0)) return {std::isfinite(r) ? -far_ : far_, Vector2d::UnitX()};
    const Vector2d gradient = mm_per_px_transposed_ * (q / r);
    const double slope = gradient.norm();
    return {(r - radius_mm_) / slope, gradient / slope};
  }

 private:
  static constexpr double far_ = 1e6;
  const CameraModel& camera_;
  Eigen::Matrix3d R_MC_;
  Vector3d p_MC_;
  double radius_mm_;
  std::optional<Vector2d> centre_px_;
  Matrix2d px_per_mm_ = Matrix2d::Identity();
  Matrix2d mm_per_px_transposed_ = Matrix2d::Identity();
};

// Weights of the samples for one pixel: Gaussian by the box of a pixel, symmetric, sum 1.
std::vector<double> pixel_kernel(double blur_sigma_px) {
  const double sigma = blur_sigma_px * samples_per_px;
  const int reach = static_cast<int>(std::ceil(5 * sigma));
  std::vector<double> kernel(static_cast<std::size_t>(2 * reach + samples_per_px), 0.0);
  double sum = 0;
  for (int offset = -reach; offset <= reach; ++offset) {
    const double weight = sigma > 0 ? std::exp(-0.5 * offset * offset / (sigma * sigma)) : 1;
    for (int s = 0; s < samples_per_px; ++s) kernel[static_cast<std::size_t>(offset + reach + s)] += weight;
    sum += samples_per_px * weight;
  }
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

// An upright block of pixels and the samples it needs round it.
struct Block {
  int u0 = 0, v0 = 0, width = 0, height = 0;  // px
  int guard = 0;                              // samples on each side
  double u(int column) const { return u0 - 0.5 + (column - guard + 0.5) / samples_per_px; }
  double v(int row) const { return v0 - 0.5 + (row - guard + 0.5) / samples_per_px; }
  int columns() const { return width * samples_per_px + 2 * guard; }
  int rows() const { return height * samples_per_px + 2 * guard; }
};

Block block_round(const Outline& outline, const CameraModel& camera, double margin_px, int guard) {
  const Vector2d half = outline.half_box_px() + Vector2d::Constant(margin_px);
  const auto cut = [](double value, int size) {
    return static_cast<int>(std::lround(std::clamp(value, 0.0, static_cast<double>(size - 1))));
  };
  Block block;
  block.u0 = cut(outline.centre_px().x() - half.x(), camera.width_px);
  block.v0 = cut(outline.centre_px().y() - half.y(), camera.height_px);
  block.width = cut(outline.centre_px().x() + half.x(), camera.width_px) - block.u0 + 1;
  block.height = cut(outline.centre_px().y() + half.y(), camera.height_px) - block.v0 + 1;
  block.guard = guard;
  return block;
}

// The part of a sample's square inside the outline, exact for a straight edge.
double share_inside(const EdgePoint& edge) {
  const double inside = -edge.distance_px * samples_per_px;
  const double wide = edge.normal.cwiseAbs().maxCoeff(), narrow = edge.normal.cwiseAbs().minCoeff();
  const double missing = (wide + narrow) / 2 - std::abs(inside);  // to the square's last corner
  if (missing <= 0) return inside > 0 ? 1 : 0;
  if (missing >= narrow) return 0.5 + inside / wide;
  const double corner = missing * missing / (2 * wide * narrow);
  return inside > 0 ? 1 - corner : corner;
}

double sample_grey(const FlatDisc& disc, const Outline& outline, const Illumination& light, double u,
                   double v) {
  const double share = share_inside(outline.edge_at({u, v}));
  return light.at(u, v) * (disc.surface_grey + share * (disc.grey - disc.surface_grey));
}

// One value per pixel across, one row per row of samples: already blurred along the rows.
std::vector<double> blurred_rows(const Block& block, const FlatDisc& disc, const Outline& outline,
                                 const Illumination& light, const std::vector<double>& kernel) {
  std::vector<double> rows, samples(static_cast<std::size_t>(block.columns()));
  rows.reserve(static_cast<std::size_t>(block.rows() * block.width));
  for (int row = 0; row < block.rows(); ++row) {
    for (int column = 0; column < block.columns(); ++column)
      samples[static_cast<std::size_t>(column)] =
          sample_grey(disc, outline, light, block.u(column), block.v(row));
    for (int pixel = 0; pixel < block.width; ++pixel) {
      const double* first = samples.data() + pixel * samples_per_px;
      double sum = 0;
      for (std::size_t tap = 0; tap < kernel.size(); ++tap) sum += kernel[tap] * first[tap];
      rows.push_back(sum);
    }
  }
  return rows;
}

}  // namespace

void render_disc(const CameraModel& camera, const FlatDisc& disc, const Illumination& light,
                 double blur_sigma_px, std::vector<float>& picture) {
  const Outline outline(camera, disc);
  if (!outline.has_image()) return;
  const std::vector<double> kernel = pixel_kernel(blur_sigma_px);
  const int guard = (static_cast<int>(kernel.size()) - samples_per_px) / 2;
  const double reach_px = static_cast<double>(guard) / samples_per_px + 1;
  const Block block = block_round(outline, camera, reach_px, guard);
  const std::vector<double> rows = blurred_rows(block, disc, outline, light, kernel);
  for (int v = 0; v < block.height; ++v) {
    for (int u = 0; u < block.width; ++u) {
      if (outline.edge_at(Vector2d(block.u0 + u, block.v0 + v)).distance_px > reach_px) continue;
      const double* first = rows.data() + static_cast<std::ptrdiff_t>(v) * samples_per_px * block.width + u;
      double sum = 0;
      for (std::size_t tap = 0; tap < kernel.size(); ++tap)
        sum += kernel[tap] * first[static_cast<std::ptrdiff_t>(tap) * block.width];
      picture[static_cast<std::size_t>(block.v0 + v) * static_cast<std::size_t>(camera.width_px) +
              static_cast<std::size_t>(block.u0 + u)] = static_cast<float>(sum);
    }
  }
}

}  // namespace zeropose
