#include "measure/body_layout.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "calib/symmetric_eigen.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double off_plane = 0.05;      // of the spacing
constexpr double least_across = 0.3;    // of the spacing: three marks that are less than a line
constexpr std::size_t near_enough = 6;  // neighbours looked at
constexpr double least_sine = 0.7;      // between the sides of a cell
constexpr double longest_side = 2.2;    // of the shorter one
constexpr double fourth_off = 0.25;     // of the shorter side: where the fourth corner may be
constexpr double inside = 0.1;          // of the sides: what still counts as in the cell

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<double> spacings_of(std::span<const BodyMark> marks) {
  std::vector<double> spacing(marks.size(), std::numeric_limits<double>::max());
  for (std::size_t i = 0; i < marks.size(); ++i)
    for (std::size_t k = 0; k < marks.size(); ++k)
      if (i != k) spacing[i] = std::min(spacing[i], (marks[i].p_B_mm - marks[k].p_B_mm).norm());
  return spacing;
}

class Planes {
 public:
  Planes(std::span<const BodyMark> marks, const std::vector<double>& spacing)
      : marks_(marks), step_mm_(median(spacing)), free_(marks.size(), true) {}

  // The marks of the largest plane among those that are still free; taken then.
  std::vector<std::size_t> next() {
    std::vector<std::size_t> best;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      if (!free_[i]) continue;
      const std::vector<std::size_t> near = neighbours_of(i);
      for (std::size_t a = 0; a < near.size(); ++a)
        for (std::size_t b = a + 1; b < near.size(); ++b) {
          std::vector<std::size_t> on = on_plane(i, near[a], near[b]);
          if (on.size() > best.size()) best = std::move(on);
        }
    }
    for (const std::size_t mark : best) free_[mark] = false;
    return best;
  }

 private:
  std::vector<std::size_t> neighbours_of(std::size_t i) const {
    std::vector<std::pair<double, std::size_t>> all;
    for (std::size_t k = 0; k < marks_.size(); ++k)
      if (k != i && free_[k]) all.emplace_back((marks_[k].p_B_mm - marks_[i].p_B_mm).norm(), k);
    std::sort(all.begin(), all.end());
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < std::min(near_enough, all.size()); ++k) near.push_back(all[k].second);
    return near;
  }
  std::vector<std::size_t> on_plane(std::size_t i, std::size_t a, std::size_t b) const {
    const Vector3d& p = marks_[i].p_B_mm;
    const Vector3d across = (marks_[a].p_B_mm - p).cross(marks_[b].p_B_mm - p);
    if (!(across.norm() > least_across * step_mm_ * step_mm_)) return {};
    const Vector3d normal = across.normalized();
    std::vector<std::size_t> on;
    for (std::size_t k = 0; k < marks_.size(); ++k)
      if (free_[k] && std::abs(normal.dot(marks_[k].p_B_mm - p)) < off_plane * step_mm_) on.push_back(k);
    return on;
  }

  std::span<const BodyMark> marks_;
  double step_mm_;
  std::vector<bool> free_;
};

BodyPlane plane_of(std::span<const BodyMark> marks, std::vector<std::size_t> on) {
  BodyPlane plane;
  for (const std::size_t mark : on) plane.origin_B += marks[mark].p_B_mm / double(on.size());
  Matrix3d spread = Matrix3d::Zero();
  Vector3d given = Vector3d::Zero();
  for (const std::size_t mark : on) {
    const Vector3d off = marks[mark].p_B_mm - plane.origin_B;
    spread += off * off.transpose();
    given += marks[mark].normal_B;
  }
  const Eigen::MatrixXd vectors = symmetric_eigen(spread).vectors;
  Vector3d normal = vectors.col(0);
  if (normal.dot(given) < 0) normal = -normal;
  const Vector3d x = vectors.col(2);
  plane.axes_B << x, normal.cross(x), normal;
  std::vector<Matrix2d> metric(on.size(), Matrix2d::Identity());
  for (const std::size_t mark : on)
    plane.places.push_back((plane.axes_B.transpose() * (marks[mark].p_B_mm - plane.origin_B)).head<2>());
  plane.cells = cells_of(plane.places, metric);
  plane.marks = std::move(on);
  return plane;
}

// Neighbours of one point, offsets in its own metric.
struct Near {
  std::size_t point;
  Vector2d offset;
  double distance;
};

std::vector<Near> near_points(std::span<const Vector2d> points, std::size_t i, const Matrix2d& metric) {
  std::vector<Near> all;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector2d offset = metric * (points[k] - points[i]);
    if (k != i) all.push_back({k, offset, offset.norm()});
  }
  std::sort(all.begin(), all.end(), [](const Near& a, const Near& b) {
    return std::pair(a.distance, a.point) < std::pair(b.distance, b.point);
  });
  return all;
}

// The point where the two sides' far corner belongs, or none (the number of points).
std::size_t fourth_of(const std::vector<Near>& near, const Near& a, const Near& b, std::size_t none) {
  const Vector2d expected = a.offset + b.offset;
  double nearest = fourth_off * std::min(a.distance, b.distance);
  std::size_t best = none;
  for (const Near& c : near) {
    if (c.distance > 2 * (a.distance + b.distance)) break;
    const double off = (c.offset - expected).norm();
    if (off < nearest) nearest = off, best = c.point;
  }
  return best;
}

// Another point in the parallelogram: its sides are not those between neighbours.
bool is_empty(const std::vector<Near>& near, const Near& a, const Near& b, std::size_t across) {
  Matrix2d sides;
  sides << a.offset, b.offset;
  const Matrix2d back = sides.inverse();
  return std::none_of(near.begin(), near.end(), [&](const Near& other) {
    if (other.point == a.point || other.point == b.point || other.point == across) return false;
    const Vector2d at = back * other.offset;
    return at.minCoeff() > -inside && at.maxCoeff() < 1 + inside;
  });
}

}  // namespace

std::vector<BodyCell> cells_of(std::span<const Vector2d> points, std::span<const Matrix2d> metric) {
  std::vector<BodyCell> cells;
  std::set<BodyCell> known;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::vector<Near> near = near_points(points, i, metric[i]);
    const std::size_t count = std::min(near_enough, near.size());
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b) {
        const Near &first = near[a], &second = near[b];
        const double area = first.offset.x() * second.offset.y() - first.offset.y() * second.offset.x();
        if (!(area > least_sine * first.distance * second.distance) ||
            std::max(first.distance, second.distance) >
                longest_side * std::min(first.distance, second.distance))
          continue;
        const std::size_t across = fourth_of(near, first, second, points.size());
        if (across == points.size() || across == first.point || across == second.point ||
            !is_empty(near, first, second, across))
          continue;
        const BodyCell cell{i, first.point, across, second.point};
        BodyCell sorted = cell;
        std::sort(sorted.begin(), sorted.end());
        if (known.insert(sorted).second) cells.push_back(cell);
      }
  }
  return cells;
}

BodyLayout layout_of(std::span<const BodyMark> marks) {
  BodyLayout layout;
  layout.spacing_mm = spacings_of(marks);
  layout.normals_B.assign(marks.size(), Vector3d::Zero());
  Planes planes(marks, layout.spacing_mm);
  for (;;) {
    std::vector<std::size_t> on = planes.next();
    if (on.size() < 4) break;
    layout.planes.push_back(plane_of(marks, std::move(on)));
    for (const std::size_t mark : layout.planes.back().marks)
      layout.normals_B[mark] = layout.planes.back().axes_B.col(2);
  }
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (!marks[i].normal_B.isZero()) layout.normals_B[i] = marks[i].normal_B.normalized();
  return layout;
}

}  // namespace zeropose
