// The corner and the cross: edges that meet. Where they do the blurred picture is that of two correlated
// normal variables.
#include <algorithm>
#include <cmath>
#include <utility>

#include "measure/contour_shape.h"
#include "measure/normal_bell.h"

namespace zeropose {
namespace {

constexpr double tip_px = 3;          // pixels this near to a corner are a stretch of their own
constexpr float excess_reach = 4.2F;  // in blurs

int count_of(double length_px) { return std::max(1, static_cast<int>(std::lround(length_px / stretch_px))); }

int piece_of(double place, double length, int count) {
  return std::clamp(static_cast<int>(place / length * count), 0, count - 1);
}

// Directions and correlation in single precision.
struct Arms {
  explicit Arms(const ShapeParameters& at)
      : u(float(at(0))),
        v(float(at(1))),
        c1(float(std::cos(at(2)))),
        s1(float(std::sin(at(2)))),
        c2(float(std::cos(at(3)))),
        s2(float(std::sin(at(3)))) {}
  float u, v, c1, s1, c2, s2;
};

double opening_of(const ShapeParameters& at) { return at(3) - at(2); }

}  // namespace

CornerShape::CornerShape(double first_px, double second_px)
    : length_{first_px, second_px}, count_{count_of(first_px), count_of(second_px)} {}

bool CornerShape::plausible(const ShapeParameters& at) const {
  return opening_of(at) > 0.3 && opening_of(at) < 2.85;
}

void CornerShape::place_row(const ShapeParameters& at, double x0, double y,
                            std::span<ContourPlace> row) const {
  const double c1 = std::cos(at(2)), s1 = std::sin(at(2)), c2 = std::cos(at(3)), s2 = std::sin(at(3));
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double dx = x0 + double(i) - at(0), dy = y - at(1), far = std::sqrt(dx * dx + dy * dy);
    const double h1 = c1 * dy - s1 * dx, h2 = s2 * dx - c2 * dy;  // into the mark
    const double t1 = c1 * dx + s1 * dy, t2 = c2 * dx + s2 * dy;
    const double away1 = t1 > 0 ? std::abs(h1) : far, away2 = t2 > 0 ? std::abs(h2) : far;
    const bool first = away1<away2, inside = h1> 0 && h2 > 0;
    const double away = std::min(away1, away2), t = first ? t1 : t2;
    const std::size_t arm = first ? 0 : 1;
    row[i].distance_px = static_cast<float>(inside ? -away : away);
    if (far < tip_px || t <= 0) {
      row[i].stretch = count_[0] + count_[1];
    } else {
      row[i].stretch =
          t > length_[arm] ? -1 : (first ? 0 : count_[0]) + piece_of(t, length_[arm], count_[arm]);
    }
  }
}

void CornerShape::evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const {
  const Arms k(at);
  const double rho = -std::cos(opening_of(at)), sine = std::sin(opening_of(at));
  const auto r = static_cast<float>(rho), iq = static_cast<float>(1 / sine),
             inverse = static_cast<float>(1 / blur_px);
  const BinormalExcess excess(rho);
  alignas(64) float h[contour_block], g[contour_block];
  for (std::size_t i = 0; i < contour_block; ++i) {
    const float dx = block.x[i] - k.u, dy = block.y[i] - k.v;
    h[i] = (k.c1 * dy - k.s1 * dx) * inverse;
    g[i] = (k.s2 * dx - k.c2 * dy) * inverse;
    const NormalBell first = normal_bell(h[i]), second = normal_bell(g[i]);
    const float p1 = first.density * normal_bell((g[i] - r * h[i]) * iq).below * inverse;
    const float p2 = second.density * normal_bell((h[i] - r * g[i]) * iq).below * inverse;
    block.cover[i] = 1 - first.below * second.below;
    block.by_shape[0][i] = p2 * k.s2 - p1 * k.s1;
    block.by_shape[1][i] = p1 * k.c1 - p2 * k.c2;
    block.by_shape[2][i] = p1 * (k.c1 * dx + k.s1 * dy);
    block.by_shape[3][i] = -p2 * (k.c2 * dx + k.s2 * dy);
    block.by_blur[i] = p1 * h[i] + p2 * g[i];
  }
  for (std::size_t i = 0; i < contour_block; ++i) {
    if (std::abs(h[i]) > excess_reach || std::abs(g[i]) > excess_reach) continue;
    block.cover[i] -= static_cast<float>(excess(h[i], g[i]));
    const auto turn = static_cast<float>(binormal_density(h[i], g[i], rho) * sine);
    block.by_shape[2][i] += turn;
    block.by_shape[3][i] -= turn;
  }
}

double CornerShape::movement_px(const ShapeParameters& from, const ShapeParameters& to) const {
  const ShapeParameters step = to - from;
  return step.head<2>().norm() + std::max(length_[0] * std::abs(step(2)), length_[1] * std::abs(step(3)));
}

CrossShape::CrossShape(const std::array<double, 4>& arms_px) : arm_(arms_px), first_{} {
  for (std::size_t k = 0; k < 4; ++k) first_[k + 1] = first_[k] + 2 * count_of(arm_[k]);
}

bool CrossShape::plausible(const ShapeParameters& at) const {
  return at(4) > 0.7 && std::abs(std::sin(opening_of(at))) > 0.3;
}

void CrossShape::place_row(const ShapeParameters& at, double x0, double y,
                           std::span<ContourPlace> row) const {
  const double c1 = std::cos(at(2)), s1 = std::sin(at(2)), c2 = std::cos(at(3)), s2 = std::sin(at(3));
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double dx = x0 + double(i) - at(0), dy = y - at(1);
    const double e1 = c1 * dy - s1 * dx, e2 = c2 * dy - s2 * dx;
    const bool first = std::abs(e1) < std::abs(e2);
    const double e = first ? e1 : e2, t = first ? c1 * dx + s1 * dy : c2 * dx + s2 * dy;
    const std::size_t arm = (first ? 0U : 2U) + (t < 0 ? 1U : 0U);
    const int count = (first_[arm + 1] - first_[arm]) / 2;
    row[i].distance_px = static_cast<float>(std::abs(e) - at(4));
    row[i].stretch = std::abs(t) > arm_[arm]
                         ? -1
                         : first_[arm] + (e < 0 ? count : 0) + piece_of(std::abs(t), arm_[arm], count);
  }
}

namespace {

// Both bars' edges in blurs from each pixel: (w - e) / s and (-w - e) / s.
struct BarEdges {
  alignas(64) float high1[contour_block], low1[contour_block], high2[contour_block], low2[contour_block];
};

// Where edges of both bars are near: what the product of the bars' covers misses.
void add_excess(const BarEdges& edges, double rho, double sine, ContourBlock& block) {
  const BinormalExcess excess(rho);
  for (std::size_t i = 0; i < contour_block; ++i) {
    for (const auto& [x, sign_x] : {std::pair{edges.high1[i], 1}, std::pair{edges.low1[i], -1}}) {
      if (std::abs(x) > excess_reach) continue;
      for (const auto& [y, sign_y] : {std::pair{edges.high2[i], 1}, std::pair{edges.low2[i], -1}}) {
        if (std::abs(y) > excess_reach) continue;
        const int sign = sign_x * sign_y;
        block.cover[i] += static_cast<float>(sign * excess(x, y));
        const auto turn = static_cast<float>(sign * binormal_density(x, y, rho) * sine);
        block.by_shape[2][i] += turn;
        block.by_shape[3][i] -= turn;
      }
    }
  }
}

}  // namespace

// The mark's share is the first bar's plus the second one's less what both cover: a parallelogram, by four
// terms of two variables.
void CrossShape::evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const {
  const Arms k(at);
  const double rho = std::cos(opening_of(at));
  const auto r = static_cast<float>(rho), iq = static_cast<float>(1 / std::sqrt(1 - rho * rho)),
             w = static_cast<float>(at(4)), inverse = static_cast<float>(1 / blur_px);
  const auto beside = [r, iq](float high, float low, float t) {  // of the other bar, on an edge of this one
    return 1 - normal_bell((high - r * t) * iq).below + normal_bell((low - r * t) * iq).below;
  };
  BarEdges edges;
  for (std::size_t i = 0; i < contour_block; ++i) {
    const float dx = block.x[i] - k.u, dy = block.y[i] - k.v;
    const float e1 = k.c1 * dy - k.s1 * dx, e2 = k.c2 * dy - k.s2 * dx;
    const float h1 = (w - e1) * inverse, l1 = (-w - e1) * inverse;
    const float h2 = (w - e2) * inverse, l2 = (-w - e2) * inverse;
    const NormalBell H1 = normal_bell(h1), L1 = normal_bell(l1), H2 = normal_bell(h2), L2 = normal_bell(l2);
    const float a1 = H1.density * beside(h2, l2, h1), b1 = L1.density * beside(h2, l2, l1);
    const float a2 = H2.density * beside(h1, l1, h2), b2 = L2.density * beside(h1, l1, l2);
    const float p1 = (a1 - b1) * inverse,
                p2 = (a2 - b2) * inverse;  // cover by distance from the middle lines
    edges.high1[i] = h1, edges.low1[i] = l1, edges.high2[i] = h2, edges.low2[i] = l2;
    block.cover[i] = (1 - H1.below + L1.below) * (1 - H2.below + L2.below);
    block.by_shape[0][i] = p1 * k.s1 + p2 * k.s2;
    block.by_shape[1][i] = -(p1 * k.c1 + p2 * k.c2);
    block.by_shape[2][i] = -p1 * (k.c1 * dx + k.s1 * dy);
    block.by_shape[3][i] = -p2 * (k.c2 * dx + k.s2 * dy);
    block.by_shape[4][i] = -(a1 + b1 + a2 + b2) * inverse;
    block.by_blur[i] = (a1 * h1 - b1 * l1 + a2 * h2 - b2 * l2) * inverse;
  }
  add_excess(edges, rho, std::sin(opening_of(at)), block);
}

double CrossShape::movement_px(const ShapeParameters& from, const ShapeParameters& to) const {
  const ShapeParameters step = to - from;
  return step.head<2>().norm() + std::abs(step(4)) +
         std::max(std::max(arm_[0], arm_[1]) * std::abs(step(2)),
                  std::max(arm_[2], arm_[3]) * std::abs(step(3)));
}

double CornerShape::radius_px(const ShapeParameters&) const { return std::max(length_[0], length_[1]); }

double CrossShape::radius_px(const ShapeParameters& at) const {
  return *std::max_element(arm_.begin(), arm_.end()) + at(4);
}

}  // namespace zeropose
