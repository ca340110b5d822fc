#include "tests/support/hard_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace zeropose::test {
namespace {

using Eigen::Vector2d;

constexpr double pi = std::numbers::pi, cell_px = 1.0 / cells_per_px;

// Turns points into the frame of something that lies at an angle.
class Turn {
 public:
  explicit Turn(double angle_rad) : c_(std::cos(angle_rad)), s_(std::sin(angle_rad)) {}
  Vector2d operator()(const Vector2d& p) const { return {c_ * p.x() + s_ * p.y(), -s_ * p.x() + c_ * p.y()}; }

 private:
  double c_, s_;
};

Layer layer_within(const Vector2d& centre_px, double reach_px, double grey) {
  Layer layer;
  layer.low_px = centre_px.array() - reach_px, layer.high_px = centre_px.array() + reach_px;
  layer.grey = grey;
  return layer;
}

double cover_at(const Layer& layer, double distance_px) {
  if (layer.soft_px > 0) {
    const double t = std::clamp(-distance_px / layer.soft_px, 0.0, 1.0);
    return t * t * (3 - 2 * t);
  }
  return distance_px < 0 ? 1 : 0;
}

// Share of a cell that is covered: 4 x 4 points where the outline crosses it.
double cover_of_cell(const Layer& layer, const Vector2d& middle_px) {
  const double distance_px = layer.distance_px(middle_px);
  if (layer.soft_px > 0 || std::abs(distance_px) > 1.2 * cell_px) return cover_at(layer, distance_px);
  constexpr int points = 4;
  double sum = 0;
  for (int j = 0; j < points; ++j) {
    for (int i = 0; i < points; ++i) {
      const Vector2d off((i + 0.5) / points - 0.5, (j + 0.5) / points - 0.5);
      sum += cover_at(layer, layer.distance_px(middle_px + cell_px * off));
    }
  }
  return sum / (points * points);
}

// Paints layers pixel by pixel, cell by cell only where an outline or a slope may be.
class Painter {
 public:
  Painter(Radiance& radiance, double gamma) : to_(radiance), gamma_(gamma) {}

  void paint(const Layer& layer) {
    if (layer.lens > 0) below_ = to_.cells;
    light_ = static_cast<float>(light_of(layer.grey));
    const int width = to_.width_cells / cells_per_px, height = to_.height_cells / cells_per_px;
    const int u0 = std::max(0, first_of(layer.low_px.x())), v0 = std::max(0, first_of(layer.low_px.y()));
    const int u1 = std::min(width - 1, first_of(layer.high_px.x()) + 1);
    const int v1 = std::min(height - 1, first_of(layer.high_px.y()) + 1);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) paint_pixel(layer, u, v);
    }
  }

  double light_of(double grey) const { return std::pow(grey / 255, 1 / gamma_); }

 private:
  int first_of(double place_px) const {
    return static_cast<int>(std::clamp(std::floor(place_px), -1e6, 1e6)) + to_.margin_px;
  }

  void paint_pixel(const Layer& layer, int u, int v) {
    const Vector2d middle(u - to_.margin_px, v - to_.margin_px);
    const double distance_px = layer.distance_px(middle);
    if (distance_px > 1.5) return;
    const bool whole = distance_px < -1.5 - layer.soft_px && layer.lens <= 0;
    for (int j = 0; j < cells_per_px; ++j) {
      for (int i = 0; i < cells_per_px; ++i) {
        const Vector2d at = middle + Vector2d((i + 0.5) * cell_px - 0.5, (j + 0.5) * cell_px - 0.5);
        const double cover = whole ? 1 : cover_of_cell(layer, at);
        if (cover > 0) lay_over(layer, at, u * cells_per_px + i, v * cells_per_px + j, cover);
      }
    }
  }

  void lay_over(const Layer& layer, const Vector2d& at, int x, int y, double cover) {
    float& cell = to_.cells[index(x, y)];
    if (layer.glow > 0) {
      cell += static_cast<float>(cover * layer.glow);
    } else if (layer.lens > 0) {
      const Vector2d centre = 0.5 * (layer.low_px + layer.high_px);
      const double bend = layer.lens * cover;
      cell = below_at(centre + (1 - bend) * (at - centre)) * static_cast<float>(1 - 0.15 * cover);
    } else {
      cell += static_cast<float>(cover * layer.opacity) * (light_ - cell);
    }
  }

  float below_at(const Vector2d& at) const {
    const auto cell = [this](double place_px, int cells) {
      return std::clamp(static_cast<int>(std::floor((place_px + 0.5 + to_.margin_px) * cells_per_px)), 0,
                        cells - 1);
    };
    return below_[index(cell(at.x(), to_.width_cells), cell(at.y(), to_.height_cells))];
  }

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(to_.width_cells) +
           static_cast<std::size_t>(x);
  }

  Radiance& to_;
  double gamma_;
  float light_ = 0;  // of the layer in hand
  std::vector<float> below_;
};

}  // namespace

Radiance radiance_of(const HardScene& scene, double gamma, int margin_px) {
  Radiance radiance;
  radiance.margin_px = margin_px;
  radiance.width_cells = (scene.width_px + 2 * margin_px) * cells_per_px;
  radiance.height_cells = (scene.height_px + 2 * margin_px) * cells_per_px;
  Painter painter(radiance, gamma);
  radiance.cells.assign(
      static_cast<std::size_t>(radiance.width_cells) * static_cast<std::size_t>(radiance.height_cells),
      static_cast<float>(painter.light_of(scene.ground_grey)));
  for (const Layer& layer : scene.layers) painter.paint(layer);
  return radiance;
}

Layer disc_layer(const Vector2d& centre_px, double diameter_px, double axis_ratio, double angle_rad,
                 double grey) {
  Layer layer = layer_within(centre_px, diameter_px / 2 + 1, grey);
  const Turn turn(angle_rad);
  const double a = diameter_px / 2, b = a * axis_ratio;
  layer.distance_px = [=](const Vector2d& at) {
    const Vector2d p = turn(at - centre_px);
    const Vector2d q(p.x() / a, p.y() / b);
    const double rho = q.norm(), slope = Vector2d(q.x() / a, q.y() / b).norm();
    return rho < 0.05 ? -b : (rho - 1) * rho / slope;
  };
  return layer;
}

Layer bar_layer(const Vector2d& centre_px, double half_length_px, double half_width_px, double angle_rad,
                double grey) {
  Layer layer = layer_within(centre_px, std::hypot(half_length_px, half_width_px) + 1, grey);
  const Turn turn(angle_rad);
  layer.distance_px = [=](const Vector2d& at) {
    const Vector2d p = turn(at - centre_px);
    return std::max(std::abs(p.x()) - half_length_px, std::abs(p.y()) - half_width_px);
  };
  return layer;
}

Layer polygon_layer(const Vector2d& centre_px, double radius_px, int corners, double angle_rad, double grey) {
  Layer layer = layer_within(centre_px, radius_px + 1, grey);
  std::vector<Vector2d> normals;
  for (int k = 0; k < corners; ++k) {
    const double turn = angle_rad + 2 * pi * k / corners;
    normals.emplace_back(std::cos(turn), std::sin(turn));
  }
  const double inner = radius_px * std::cos(pi / corners);
  layer.distance_px = [=](const Vector2d& at) {
    double most = -inner;
    for (const Vector2d& normal : normals) most = std::max(most, normal.dot(at - centre_px) - inner);
    return most;
  };
  return layer;
}

Layer splash_layer(const Vector2d& centre_px, double radius_px, double grey, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Layer layer = layer_within(centre_px, 1.9 * radius_px + 1, grey);
  std::array<double, 4> size{}, phase{};
  for (std::size_t k = 0; k < size.size(); ++k) {
    size[k] = 0.45 * unit(random) / (1 + 0.6 * double(k)), phase[k] = pi * unit(random);
  }
  layer.distance_px = [=](const Vector2d& at) {
    const Vector2d p = at - centre_px;
    const double turn = std::atan2(p.y(), p.x());
    double share = 1;
    for (std::size_t k = 0; k < size.size(); ++k)
      share += size[k] * std::cos(double(k + 2) * turn + phase[k]);
    return p.norm() - radius_px * std::max(0.2, share);
  };
  return layer;
}

Layer glint_layer(const Vector2d& centre_px, double length_px, double width_px, double angle_rad,
                  double glow) {
  Layer layer = disc_layer(centre_px, length_px, width_px / length_px, angle_rad, 0);
  layer.soft_px = 0.5 * width_px;
  layer.glow = glow;
  return layer;
}

std::vector<Layer> drop_layers(const Vector2d& centre_px, double radius_px, double lens) {
  Layer drop = disc_layer(centre_px, 2 * radius_px, 1, 0, 0);
  drop.lens = lens;
  drop.soft_px = 0.6 * radius_px;
  Layer rim = layer_within(centre_px, radius_px + 2, 235);
  rim.distance_px = [=](const Vector2d& at) {
    // Brighter towards the light, top left.
    const Vector2d p = at - centre_px;
    const double half = 0.35 - 0.55 * (p.x() + p.y()) / (1.5 * std::max(p.norm(), 1e-9));
    return std::abs(p.norm() - radius_px) - half;
  };
  rim.opacity = 0.6;
  return {drop, rim};
}

}  // namespace zeropose::test
