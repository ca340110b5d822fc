#include "calib/point_layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Points = std::span<const CalibrationPoint>;

constexpr double thin = 0.01;           // thickness by extent: no depth to calibrate from
constexpr double line = 1e-4;           // width by length: a line
constexpr double small_picture = 0.05;  // of the image's diagonal
constexpr double same_point_px = 10;    // a point seen twice does not move further than this

struct Plane {
  Vector3d centre = Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns by falling extent, right-handed
  Vector3d extent = Vector3d::Zero();
};

Plane plane_through(Points points, const std::vector<std::size_t>& chosen) {
  Plane plane;
  for (const std::size_t i : chosen) plane.centre += points[i].p_W_mm;
  plane.centre /= static_cast<double>(chosen.size());
  MatrixXd spread = MatrixXd::Zero(3, 3);
  for (const std::size_t i : chosen) {
    const Vector3d arm = points[i].p_W_mm - plane.centre;
    spread += arm * arm.transpose();
  }
  const SymmetricEigen eigen = symmetric_eigen(spread / static_cast<double>(chosen.size()));
  for (int k = 0; k < 3; ++k) {
    plane.axes.col(k) = eigen.vectors.col(2 - k);
    plane.extent(k) = std::sqrt(std::max(0.0, eigen.values(2 - k)));
  }
  plane.axes.col(2) = plane.axes.col(0).cross(plane.axes.col(1));
  return plane;
}

double distance(const Plane& plane, const Vector3d& p) {
  return std::abs(plane.axes.col(2).dot(p - plane.centre));
}

// Drops the farthest one after the other, so that one point far off does not tilt the plane for the rest.
std::vector<std::size_t> majority(Points points) {
  std::vector<std::size_t> chosen(points.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = i;
  const std::size_t drop = std::max<std::size_t>(1, points.size() / 20);
  constexpr std::size_t rounds = 20;  // of a long list several at a time
  for (std::size_t dropped = 0; dropped < drop && chosen.size() > 4;) {
    const std::size_t now = std::min(drop - dropped, std::max<std::size_t>(1, drop / rounds));
    const Plane plane = plane_through(points, chosen);
    const auto farther = [&](std::size_t a, std::size_t b) {
      return distance(plane, points[a].p_W_mm) < distance(plane, points[b].p_W_mm);
    };
    std::sort(chosen.begin(), chosen.end(), farther);
    chosen.resize(chosen.size() - now);
    dropped += now;
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

InputFault fault(CalibrationStatus status, std::string reason) { return {status, std::move(reason)}; }

std::optional<InputFault> not_finite(Points points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CalibrationPoint& point = points[i];
    if (!point.p_W_mm.allFinite() || !point.u_px.allFinite() || !point.covariance_px2.allFinite())
      return fault(CalibrationStatus::not_finite,
                   "point " + number(i + 1) + " has a number that is not finite");
    const Eigen::Matrix2d& c = point.covariance_px2;
    if (!(c(0, 0) > 0) || !(c.determinant() > 0) || c(0, 1) != c(1, 0))
      return fault(CalibrationStatus::not_finite,
                   name_of_point(points, i) + " has a covariance that is not symmetric and positive");
  }
  return std::nullopt;
}

std::tuple<double, double, double> key(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// The same point may have been looked at several times; two places for it are a mistake in the table.
std::optional<InputFault> repeated(Points points, std::size_t& different) {
  std::map<std::tuple<double, double, double>, std::size_t> first_with;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [entry, is_new] = first_with.try_emplace(key(points[i].p_W_mm), i);
    if (is_new) continue;
    const double apart = (points[i].u_px - points[entry->second].u_px).norm();
    if (apart > same_point_px)
      return fault(CalibrationStatus::duplicate_points,
                   name_of_point(points, i) + " is the same as point " + number(entry->second + 1) +
                       ", but their pixels are " + number(apart, 1) + " px apart: one of them is wrong");
  }
  different = first_with.size();
  return std::nullopt;
}

std::optional<InputFault> in_one_spot(const CalibrationProblem& problem) {
  const Points points = problem.points;
  Vector2d low = points[0].u_px, high = low;
  for (const CalibrationPoint& point : points) {
    low = low.cwiseMin(point.u_px);
    high = high.cwiseMax(point.u_px);
  }
  const double span = (high - low).norm(), diagonal = std::hypot(problem.width_px, problem.height_px);
  if (span >= small_picture * diagonal) return std::nullopt;
  return fault(CalibrationStatus::all_in_centre,
               "all pixels lie within " + number(span, 1) + " px, " + number(100 * span / diagonal, 1) +
                   " % of the image's diagonal: the lens cannot be determined from so small a part of the "
                   "image; spread the points over it");
}

}  // namespace

PointLayout layout_of(Points points) {
  PointLayout layout;
  if (points.empty()) return layout;
  layout.in_plane = majority(points);
  const Plane plane = plane_through(points, layout.in_plane);
  layout.X_WP.linear() = plane.axes;
  layout.X_WP.translation() = plane.centre;
  layout.extent_mm = plane.extent;
  for (const std::size_t i : layout.in_plane)
    layout.thickness_mm = std::max(layout.thickness_mm, distance(plane, points[i].p_W_mm));
  layout.collinear = !(plane.extent(1) > line * plane.extent(0));
  layout.coplanar = layout.thickness_mm <= thin * plane.extent(0);
  return layout;
}

std::string name_of_point(Points points, std::size_t index) {
  const Vector3d& p = points[index].p_W_mm;
  return "point " + number(index + 1) + " (" + number(p.x()) + ", " + number(p.y()) + ", " + number(p.z()) +
         ") mm";
}

std::optional<InputFault> fault_of(const CalibrationProblem& problem) {
  const Points points = problem.points;
  constexpr std::size_t at_least = 4;
  if (auto found = not_finite(points)) return found;
  std::size_t different = 0;
  if (auto found = repeated(points, different)) return found;
  if (different < at_least)
    return fault(CalibrationStatus::too_few_points,
                 "only " + number(different) + " different points (" + number(points.size()) +
                     " given); even a pose alone needs " + number(at_least));
  if (layout_of(points).collinear)
    return fault(CalibrationStatus::collinear,
                 "the points lie on one line: the rotation about it is free; add points beside it");
  if (!problem.fixed.has_all({Parameter::fx, Parameter::fy})) return in_one_spot(problem);
  return std::nullopt;
}

}  // namespace zeropose
