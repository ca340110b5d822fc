#include "sim/tyre_look.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int most_steps = 12;
constexpr double close_mm = 1e-4;
constexpr double clearly_beside_mm = 20;  // of the side wall, where its ends need not be met exactly
constexpr double line_sigmas = 5;         // beyond them there is no light
constexpr double stain_edge_mm = 0.7;

struct Touch {
  Vector3d p_O_mm;
  TyreSurface::Height height;
};

// Where the ray from `from` along `d` meets the surface over the wheel's plane.
Touch meet(const TyreSurface& surface, const Vector3d& from, const Vector3d& d) {
  double depth = -from.z() / d.z();
  Touch touch{from + depth * d, {}};
  const double radius_mm = touch.p_O_mm.head<2>().norm();
  if (radius_mm < surface.shape().bead_mm - clearly_beside_mm ||
      radius_mm > surface.shape().tread_mm + clearly_beside_mm)
    return touch;
  for (int step = 0; step < most_steps; ++step) {
    touch.height = surface.at(touch.p_O_mm.head<2>());
    const double off = touch.p_O_mm.z() - touch.height.z_mm;
    if (std::abs(off) < close_mm) break;
    const double outwards = touch.p_O_mm.head<2>().normalized().dot(d.head<2>());
    depth -= off / (d.z() - touch.height.slope * outwards);
    touch.p_O_mm = from + depth * d;
  }
  return touch;
}

// Smooth, about between -1 and 1.
double cloud(const Vector2d& p) {
  return 0.4 * (std::sin(0.11 * p.x() + 0.07 * p.y()) + std::sin(0.05 * p.x() - 0.13 * p.y() + 1) +
                0.5 * std::sin(0.31 * p.x() + 0.23 * p.y() + 2));
}

class Shading {
 public:
  explicit Shading(const TyreScene& scene)
      : scene_(scene),
        X_PO_(scene.projector.X_WP.inverse() * scene.X_WO),
        p_OP_(X_PO_.inverse().translation()) {}

  double grey(const Touch& touch) const {
    const double radius_mm = touch.p_O_mm.head<2>().norm();
    const TyreLight& light = scene_.light;
    if (radius_mm < scene_.tyre.bead_mm) return light.rim_grey * (1 + 0.2 * cloud(touch.p_O_mm.head<2>()));
    if (radius_mm > scene_.tyre.tread_mm) return light.background_grey;
    return reflectance(touch) * (light.ambient_grey + light.line_grey * lit(touch, radius_mm));
  }

 private:
  double reflectance(const Touch& touch) const {
    const Vector2d place = touch.p_O_mm.head<2>();
    double share = 1 + scene_.light.unevenness * cloud(place);
    if (touch.height.letter) share *= scene_.light.letter_gain;
    for (const TyreStain& stain : scene_.stains) {
      const double inside = stain.radius_mm - (place - stain.centre_mm).norm();
      const double covered = std::clamp(0.5 + inside / stain_edge_mm, 0.0, 1.0);
      share *= 1 - covered * (1 - stain.share);
    }
    return share;
  }

  // By all lines together, times the cosine of the light's angle: 0 beyond the terminator.
  double lit(const Touch& touch, double radius_mm) const {
    const Vector3d d_P = X_PO_ * touch.p_O_mm;
    const double away = d_P.norm();
    double sum = 0;
    for (const ProjectedLine& line : scene_.projector.lines) {
      const double off = line.n_P.dot(d_P) / (away * scene_.projector.sigma_rad);
      if (std::abs(off) > line_sigmas) continue;
      const double along = line.along_P.dot(d_P) / d_P.z();
      if (along < line.from || along > line.to) continue;
      sum += line.brightness * std::exp(-off * off / 2);
    }
    if (sum == 0) return 0;
    const Vector2d outwards = touch.p_O_mm.head<2>() / radius_mm;
    const Vector3d normal =
        Vector3d(-touch.height.slope * outwards.x(), -touch.height.slope * outwards.y(), 1);
    const double cosine = normal.normalized().dot((p_OP_ - touch.p_O_mm).normalized());
    return sum * std::max(0.0, cosine);
  }

  const TyreScene& scene_;
  Pose X_PO_;
  Vector3d p_OP_;
};

std::vector<float> bell(double sigma_px) {
  const int reach = static_cast<int>(std::ceil(3.5 * sigma_px));
  std::vector<float> weights;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    weights.push_back(static_cast<float>(std::exp(-i * i / (2 * sigma_px * sigma_px))));
    sum += weights.back();
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

// Along rows, the result transposed: twice is along both.
std::vector<float> blurred(const std::vector<float>& picture, int width, int height,
                           const std::vector<float>& bell) {
  const int reach = static_cast<int>(bell.size() / 2);
  std::vector<float> result(picture.size());
  for (int v = 0; v < height; ++v) {
    const float* row = picture.data() + std::ptrdiff_t{v} * width;
    for (int u = 0; u < width; ++u) {
      float sum = 0;
      for (int i = -reach; i <= reach; ++i)
        sum += bell[static_cast<std::size_t>(i + reach)] * row[std::clamp(u + i, 0, width - 1)];
      result[static_cast<std::size_t>(u) * static_cast<std::size_t>(height) + static_cast<std::size_t>(v)] =
          sum;
    }
  }
  return result;
}

}  // namespace

std::vector<float> tyre_picture(const TyreScene& scene, const PixelRays& rays, const Pose& X_WC) {
  const CameraModel& camera = rays.camera();
  const Pose X_OC = scene.X_WO.inverse() * X_WC;
  const TyreSurface surface(scene.tyre);
  const Shading shading(scene);
  std::vector<float> picture;
  picture.reserve(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector2f& xy = rays.at(u, v);
      const Vector3d d = X_OC.linear() * Vector3d(xy.x(), xy.y(), 1);
      const double grey = shading.grey(meet(surface, X_OC.translation(), d));
      picture.push_back(static_cast<float>(grey * scene.light.illumination.at(u, v)));
    }
  }
  const std::vector<float> weights = bell(scene.blur_sigma_px);
  return blurred(blurred(picture, camera.width_px, camera.height_px, weights), camera.height_px,
                 camera.width_px, weights);
}

}  // namespace zeropose
