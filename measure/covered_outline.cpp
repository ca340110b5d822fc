#include "measure/covered_outline.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "measure/edge_map.h"
#include "measure/search_image.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double least_seen_share = 0.6;
constexpr double least_steepness_share = 0.2;  // of the least contrast, grey levels per pixel
constexpr int most_first_points = 160, trials_per_point = 16;
constexpr std::size_t most_outlines = 6, most_partners = 6000;
constexpr double most_off = 0.75;  // of a point from its outline, pixels of the search image

// Twenty pixels across are enough to tell an arc from a straight line.
int reduction_for(const MarkSearch& search) {
  int reduction = 1;
  while (reduction < 8 && search.min_diameter_px >= 40 * reduction) reduction *= 2;
  return reduction;
}

// Edge points as the search needs them: inwards points into the mark.
struct Point {
  Vector2d at, inwards;
};

struct Ellipse {
  Vector2d centre = Vector2d::Zero();
  Matrix2d shape = Matrix2d::Zero();
  int seen = 0;      // sectors with an edge point
  double score = 0;  // that number, each the less the further its point lies off
  OutlineSectors hidden = 0;
};

struct Limits {
  double smallest, largest, least_ratio;

  bool hold(const Matrix2d& shape) const {
    const HalfAxes axes = half_axes(shape);
    return std::isfinite(axes.major_px) && 2 * axes.major_px > smallest && 2 * axes.major_px < largest &&
           axes.minor_px > least_ratio * axes.major_px && axes.minor_px > 1.8;
  }
};

// Two points of one convex outline look at each other.
bool face_each_other(const Point& a, const Point& b, double nearest, double furthest) {
  const Vector2d way = b.at - a.at;
  const double distance = way.norm();
  return distance > nearest && distance < furthest && way.dot(a.inwards) > 0.05 * distance &&
         way.dot(b.inwards) < -0.05 * distance;
}

// The centre lies on the line through the middle of two points and the meeting point of their tangents.
struct CentreLine {
  Vector2d through, direction;
};

CentreLine centre_line(const Point& a, const Point& b) {
  const Vector2d ta(-a.inwards.y(), a.inwards.x()), tb(-b.inwards.y(), b.inwards.x());
  const Vector2d way = b.at - a.at, middle = 0.5 * (a.at + b.at);
  const double turn = ta.x() * tb.y() - ta.y() * tb.x();
  const double along = way.x() * tb.y() - way.y() * tb.x();
  // Homogeneous: parallel tangents meet far away in their own direction.
  const Vector2d direction = turn * (a.at - middle) + along * ta;
  return {middle, direction.normalized()};
}

// An ellipse about its centre through three points.
std::optional<Matrix2d> shape_through(const Vector2d& centre, const std::array<const Point*, 3>& points) {
  Eigen::Matrix3d A;
  for (int i = 0; i < 3; ++i) {
    const Vector2d x = points[std::size_t(i)]->at - centre;
    A.row(i) << x.x() * x.x(), 2 * x.x() * x.y(), x.y() * x.y();
  }
  const double det = A.determinant();
  if (!(std::abs(det) > 1e-9)) return std::nullopt;
  const Eigen::Vector3d k = A.inverse() * Eigen::Vector3d::Ones();
  Matrix2d P;
  P << k(0), k(1), k(1), k(2);
  if (!(k(0) > 0) || !(P.determinant() > 0)) return std::nullopt;
  return P.inverse();
}

std::optional<Ellipse> ellipse_through(const std::array<const Point*, 3>& points, const Limits& limits) {
  Matrix2d N = Matrix2d::Zero();
  Vector2d g = Vector2d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const CentreLine line = centre_line(*points[i], *points[(i + 1) % 3]);
    if (!line.direction.allFinite()) return std::nullopt;
    const Vector2d normal(-line.direction.y(), line.direction.x());
    N += normal * normal.transpose();
    g += normal * normal.dot(line.through);
  }
  if (!(N.determinant() > 1e-3)) return std::nullopt;
  Ellipse ellipse;
  ellipse.centre = N.inverse() * g;
  const auto shape = shape_through(ellipse.centre, points);
  if (!shape || !limits.hold(*shape)) return std::nullopt;
  ellipse.shape = *shape;
  const Matrix2d P = ellipse.shape.inverse();
  for (const Point* point : points) {
    const Vector2d outwards = (P * (point->at - ellipse.centre)).normalized();
    if (outwards.dot(point->inwards) > -0.85) return std::nullopt;
  }
  return ellipse;
}

class Outlines {
 public:
  Outlines(const SearchImage& image, const MarkSearch& search);
  std::vector<Ellipse> find();

 private:
  struct Near {
    const Point* point = nullptr;
    double off = most_off;
  };
  Near point_near(const Vector2d& at, const Vector2d& outwards) const;
  void look_along(Ellipse& ellipse, std::vector<const Point*>* seen = nullptr) const;
  void refine(Ellipse& ellipse) const;
  void keep(const Ellipse& ellipse);

  EdgeMap map_;
  std::vector<Point> points_;
  Limits limits_;
  std::vector<Ellipse> kept_;
  std::array<Vector2d, SectorOf::count> circle_;
};

Outlines::Outlines(const SearchImage& image, const MarkSearch& search)
    : map_(edge_map(image, static_cast<float>(least_steepness_share * search.min_contrast))),
      limits_{search.min_diameter_px / image.reduction() - 2, search.max_diameter_px / image.reduction() + 2,
              search.min_axis_ratio - 0.05} {
  const float sign = search.bright ? 1 : -1;
  for (const EdgePoint& point : map_.points)
    points_.push_back({point.at.cast<double>(), (sign * point.rise).cast<double>()});
  for (std::size_t k = 0; k < circle_.size(); ++k) {
    const double angle = ((double(k) + 0.5) / (SectorOf::count / 2) - 1) * std::numbers::pi;
    circle_[k] = {std::cos(angle), std::sin(angle)};
  }
}

Outlines::Near Outlines::point_near(const Vector2d& at, const Vector2d& outwards) const {
  const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
  Near best;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du) {
      const int index = map_.at(u + du, v + dv);
      if (index < 0) continue;
      const Point& point = points_[std::size_t(index)];
      const double off = std::abs(outwards.dot(point.at - at));
      if (off < best.off && outwards.dot(point.inwards) < -0.85) best = {&point, off};
    }
  return best;
}

// Which sectors of the outline have an edge point in the right place and direction.
void Outlines::look_along(Ellipse& ellipse, std::vector<const Point*>* seen) const {
  const Eigen::LLT<Matrix2d> root(ellipse.shape);
  const Matrix2d L = root.matrixL(), P = ellipse.shape.inverse();
  ellipse.seen = 0;
  ellipse.score = 0;
  ellipse.hidden = 0;
  for (std::size_t k = 0; k < circle_.size(); ++k) {
    const Vector2d on = L * circle_[k];
    const Near near = point_near(ellipse.centre + on, (P * on).normalized());
    if (near.point == nullptr) {
      ellipse.hidden |= OutlineSectors{1} << k;
    } else {
      ++ellipse.seen;
      ellipse.score += 1 - near.off * near.off / (most_off * most_off);
      if (seen != nullptr) seen->push_back(near.point);
    }
  }
}

// Least squares of the points on it: x^T P x + q x = 1 about the centre, in units of its size.
void Outlines::refine(Ellipse& ellipse) const {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  for (int round = 0; round < 2; ++round) {
    std::vector<const Point*> seen;
    Ellipse better = ellipse;
    look_along(better, &seen);
    const double size = half_axes(ellipse.shape).major_px;
    Eigen::Matrix<double, 5, 5> N = Eigen::Matrix<double, 5, 5>::Zero();
    Vector5 g = Vector5::Zero();
    for (const Point* point : seen) {
      const Vector2d x = (point->at - ellipse.centre) / size;
      Vector5 row;
      row << x.x() * x.x(), 2 * x.x() * x.y(), x.y() * x.y(), x.x(), x.y();
      N += row * row.transpose();
      g += row;
    }
    const SmallCholesky<5> solver(N);
    if (!solver.ok()) return;
    const Vector5 k = solver.solve(g);
    Matrix2d P;
    P << k(0), k(1), k(1), k(2);
    if (!(k(0) > 0) || !(P.determinant() > 1e-6)) return;
    const Vector2d off = -0.5 * P.inverse() * k.tail<2>();
    const double scale = 1 + off.dot(P * off);
    better.centre = ellipse.centre + size * off;
    better.shape = size * size * scale * P.inverse();
    if (!limits_.hold(better.shape)) return;
    look_along(better);
    if (better.score < ellipse.score) return;
    ellipse = better;
  }
}

// One for each place, the most complete.
void Outlines::keep(const Ellipse& ellipse) {
  const double size = std::sqrt(ellipse.shape.trace());
  for (Ellipse& known : kept_) {
    const double other = std::sqrt(known.shape.trace());
    if ((known.centre - ellipse.centre).norm() > 0.05 * size || std::abs(size - other) > 0.05 * size)
      continue;
    if (ellipse.score > known.score) known = ellipse;
    return;
  }
  kept_.push_back(ellipse);
}

std::vector<Ellipse> Outlines::find() {
  std::minstd_rand random(1);
  const std::size_t stride = std::max<std::size_t>(1, points_.size() / most_first_points);
  const std::size_t partner_stride = 1 + points_.size() / most_partners;
  const double nearest = std::max(3.0, 0.15 * limits_.smallest);
  std::vector<const Point*> partners;
  for (std::size_t first = 0; first < points_.size(); first += stride) {
    partners.clear();
    for (std::size_t other = first % partner_stride; other < points_.size(); other += partner_stride)
      if (face_each_other(points_[first], points_[other], nearest, limits_.largest))
        partners.push_back(&points_[other]);
    if (partners.size() < 8) continue;
    for (int trial = 0; trial < trials_per_point; ++trial) {
      const Point* a = partners[random() % partners.size()];
      const Point* b = partners[random() % partners.size()];
      if (!face_each_other(*a, *b, nearest, limits_.largest)) continue;
      auto ellipse = ellipse_through({&points_[first], a, b}, limits_);
      if (!ellipse) continue;
      look_along(*ellipse);
      if (ellipse->seen < SectorOf::count / 3) continue;
      refine(*ellipse);
      if (ellipse->seen >= least_seen_share * SectorOf::count) keep(*ellipse);
    }
  }
  std::stable_sort(kept_.begin(), kept_.end(),
                   [](const Ellipse& a, const Ellipse& b) { return a.score > b.score; });
  if (kept_.size() > most_outlines) kept_.resize(most_outlines);
  return kept_;
}

}  // namespace

std::vector<CoveredOutline> covered_outlines(const ImageView& image, const PixelWindow& window,
                                             const MarkSearch& search) {
  std::vector<CoveredOutline> result;
  SearchImage reduced;
  reduced.prepare(image, window, reduction_for(search));
  if (reduced.empty()) return result;
  const double scale = reduced.reduction();
  for (const Ellipse& ellipse : Outlines(reduced, search).find()) {
    CoveredOutline outline;
    outline.start.centre_px = reduced.in_image(ellipse.centre);
    outline.start.shape_px2 = scale * scale * ellipse.shape;
    outline.start.hidden = ellipse.hidden;
    outline.seen = ellipse.seen;
    result.push_back(outline);
  }
  return result;
}

}  // namespace zeropose
