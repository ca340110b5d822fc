// The straight edge and the slot.
#include "measure/contour_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "measure/normal_bell.h"

namespace zeropose {
namespace {

constexpr float farthest_px = 30;  // no band reaches further

int count_of(double length_px) { return std::max(1, static_cast<int>(std::lround(length_px / stretch_px))); }

// Index of the piece of [0, length) that a place lies in.
int piece_of(double place, double length, int count) {
  return std::clamp(static_cast<int>(place / length * count), 0, count - 1);
}

struct SlotGeometry {
  explicit SlotGeometry(const ShapeParameters& at)
      : u(float(at(0))), v(float(at(1))), a(float(at(2))), b(float(at(3))), c(float(at(4))), d(float(at(5))) {
    half = float(at(6));
  }
  float u, v, a, b, c, d, half;
};

struct SlotAxes {
  Eigen::Vector2d along_px, across_px;  // images of the unit vectors
};

SlotAxes axes_of(const ShapeParameters& at) {
  const double determinant = at(2) * at(5) - at(3) * at(4);
  return {Eigen::Vector2d(at(5), -at(4)) / determinant, Eigen::Vector2d(-at(3), at(2)) / determinant};
}

}  // namespace

ContourShape::Reach ContourShape::reach_of_row(const ShapeParameters& at, double y, double reach_px) const {
  const double reach = radius_px(at) + reach_px;
  if (std::abs(y - at(1)) > reach) return {};
  return {at(0) - reach, at(0) + reach};
}

EdgeShape::EdgeShape(double t0, double t1) : t0_(t0), t1_(t1), stretches_(count_of(t1 - t0)) {}

void EdgeShape::place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const {
  const double c = std::cos(at(1)), s = std::sin(at(1));
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double x = x0 + double(i), t = c * y - s * x;
    row[i].distance_px = static_cast<float>(c * x + s * y - at(0));
    row[i].stretch = t < t0_ || t >= t1_ ? -1 : piece_of(t - t0_, t1_ - t0_, stretches_);
  }
}

void EdgeShape::evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const {
  const auto c = static_cast<float>(std::cos(at(1))), s = static_cast<float>(std::sin(at(1)));
  const auto offset = static_cast<float>(at(0)), inverse = static_cast<float>(1 / blur_px);
  for (std::size_t i = 0; i < contour_block; ++i) {
    const float d = (c * block.x[i] + s * block.y[i] - offset) * inverse;
    const NormalBell bell = normal_bell(d);
    const float slope = bell.density * inverse;
    block.cover[i] = bell.below;
    block.by_shape[0][i] = -slope;
    block.by_shape[1][i] = slope * (c * block.y[i] - s * block.x[i]);
    block.by_blur[i] = -slope * d;
  }
}

// Where the strip along the edge crosses the row.
ContourShape::Reach EdgeShape::reach_of_row(const ShapeParameters& at, double y, double reach_px) const {
  const double c = std::cos(at(1)), s = std::sin(at(1)), far = 2e4;
  if (std::abs(c) * far < 1) return std::abs(s * y - at(0)) < reach_px + 1 ? Reach{-far, far} : Reach{};
  const double middle = (at(0) - s * y) / c, half = reach_px / std::abs(c);
  return {middle - half, middle + half};
}

double EdgeShape::movement_px(const ShapeParameters& from, const ShapeParameters& to) const {
  const ShapeParameters step = to - from;
  return std::abs(step(0)) + std::max(std::abs(t0_), std::abs(t1_)) * std::abs(step(1));
}

SlotShape::SlotShape(const ShapeParameters& about) {
  const SlotAxes axes = axes_of(about);
  straight_ = count_of(2 * about(6) * axes.along_px.norm());
  cap_ = std::max(2, count_of(0.5 * std::numbers::pi * (axes.along_px.norm() + axes.across_px.norm())));
}

bool SlotShape::plausible(const ShapeParameters& at) const {
  const double determinant = at(2) * at(5) - at(3) * at(4);
  if (!(determinant > 1e-6) || !(at(6) > 0) || at(6) > 100) return false;
  const SlotAxes axes = axes_of(at);
  const double a = axes.along_px.norm(), b = axes.across_px.norm();
  return a > 0.7 && b > 0.7 && a < 5 * b && b < 5 * a && determinant * a * b < 2;
}

void SlotShape::place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const {
  const double half = at(6), dy = y - at(1);
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double dx = x0 + double(i) - at(0);
    const double along = at(2) * dx + at(3) * dy, eta = at(4) * dx + at(5) * dy;
    const double beyond = std::abs(along) - half, xi = beyond > 0 ? std::copysign(beyond, along) : 0.0;
    const double rho = std::max(1e-6, std::sqrt(xi * xi + eta * eta)), nx = xi / rho, ny = eta / rho;
    const double mx = at(2) * nx + at(4) * ny, my = at(3) * nx + at(5) * ny;
    row[i].distance_px = static_cast<float>((rho - 1) / std::sqrt(mx * mx + my * my));
    if (std::abs(row[i].distance_px) > farthest_px) {
      row[i].stretch = -1;
    } else if (beyond > 0) {
      const int piece = piece_of(1 + eta / (beyond + std::abs(eta)), 2, cap_);  // near enough the angle
      row[i].stretch = 2 * straight_ + (along > 0 ? 0 : cap_) + piece;
    } else {
      row[i].stretch = (eta > 0 ? 0 : straight_) + piece_of(along + half, 2 * half, straight_);
    }
  }
}

void SlotShape::evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const {
  const SlotGeometry k(at);
  const auto inverse = static_cast<float>(1 / blur_px);
  for (std::size_t i = 0; i < contour_block; ++i) {
    const float dx = block.x[i] - k.u, dy = block.y[i] - k.v;
    const float along = k.a * dx + k.b * dy, eta = k.c * dx + k.d * dy;
    const float cap = std::abs(along) > k.half ? 1.0F : 0.0F, side = along < 0 ? -1.0F : 1.0F;
    const float xi = cap * (along - side * k.half);
    const float rho = std::sqrt(xi * xi + eta * eta + 1e-12F), ir = 1 / rho, nx = xi * ir, ny = eta * ir;
    const float mx = k.a * nx + k.c * ny, my = k.b * nx + k.d * ny;  // gradient of rho
    const float im = 1 / std::sqrt(mx * mx + my * my + 1e-12F), d = (rho - 1) * im;
    const NormalBell bell = normal_bell(d * inverse);
    const float slope = bell.density * inverse;
    // d = (rho - 1) / |m|, m = M^T n: derivatives through rho and n by (xi, eta), and through m by M.
    const float mm = d * im * im, tx = k.a * mx + k.b * my, ty = k.c * mx + k.d * my;
    const float turn = (tx * ny - ty * nx) * ir;  // of |m|^2 / 2, when n turns
    const float by_xi = cap * slope * (im * nx - mm * turn * ny);
    const float by_eta = slope * (im * ny + cap * mm * turn * nx), by_m = slope * mm;
    block.cover[i] = bell.below;
    block.by_shape[0][i] = -(by_xi * k.a + by_eta * k.c);
    block.by_shape[1][i] = -(by_xi * k.b + by_eta * k.d);
    block.by_shape[2][i] = by_xi * dx - by_m * mx * nx;
    block.by_shape[3][i] = by_xi * dy - by_m * my * nx;
    block.by_shape[4][i] = by_eta * dx - by_m * mx * ny;
    block.by_shape[5][i] = by_eta * dy - by_m * my * ny;
    block.by_shape[6][i] = -by_xi * side;
    block.by_blur[i] = -slope * d * inverse;
  }
}

double SlotShape::movement_px(const ShapeParameters& from, const ShapeParameters& to) const {
  const SlotAxes a = axes_of(from), b = axes_of(to);
  return (to - from).head<2>().norm() + ((1 + to(6)) * b.along_px - (1 + from(6)) * a.along_px).norm() +
         (b.across_px - a.across_px).norm();
}

double SlotShape::radius_px(const ShapeParameters& at) const {
  const SlotAxes axes = axes_of(at);
  return (1 + at(6)) * axes.along_px.norm() + axes.across_px.norm();
}

}  // namespace zeropose
