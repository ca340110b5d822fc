#include "measure/board_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t enough_for_bend = 12;
constexpr double largest_bend = 0.6, bend_prior = 0.3;
constexpr double prior_sigma = 2e-4;  // of a pixel in units of half the diagonal, for the weight of the prior

struct Scaled {
  std::vector<Vector2d> places, pixels;  // both near the range -1..1
};

struct Unknowns {
  Matrix3d H = Matrix3d::Identity();  // scaled places to scaled undistorted pixels, H(2, 2) = 1
  double bend = 0;
};

// Linear start without a bend; rows weighted by the denominators of the solution before.
bool start_linearly(const Scaled& data, Unknowns& at) {
  for (int round = 0; round < 3; ++round) {
    MatrixXd N = MatrixXd::Zero(8, 8);
    VectorXd g = VectorXd::Zero(8);
    for (std::size_t k = 0; k < data.places.size(); ++k) {
      const Vector2d &q = data.places[k], &u = data.pixels[k];
      const double w = round == 0 ? 1 : at.H(2, 0) * q.x() + at.H(2, 1) * q.y() + 1;
      if (!(std::abs(w) > 1e-6)) return false;
      VectorXd row(8);
      for (int axis = 0; axis < 2; ++axis) {
        row.setZero();
        row.segment<3>(3 * axis) << q.x(), q.y(), 1;
        row.tail<2>() = -u(axis) * q;
        N.selfadjointView<Eigen::Lower>().rankUpdate(row, 1 / (w * w));
        g += row * (u(axis) / (w * w));
      }
    }
    const Eigen::LDLT<MatrixXd> solver(N.selfadjointView<Eigen::Lower>());
    const VectorXd h = solver.solve(g);
    if (solver.info() != Eigen::Success || !h.allFinite() || !(solver.rcond() > 1e-14)) return false;
    at.H << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), 1;
  }
  return true;
}

// In distorted units, to first order: the difference on the undistorted side times the lens's scale there.
std::optional<Vector2d> residual(const Unknowns& at, const Vector2d& q, const Vector2d& u) {
  const Vector3d p = at.H * Vector3d(q.x(), q.y(), 1);
  const double scale = 1 + at.bend * u.squaredNorm();
  if (!(p.z() > 1e-9) || !(scale > 0.1)) return std::nullopt;
  return Vector2d(scale * p.head<2>() / p.z() - u);
}

double median_length(const Scaled& data, const Unknowns& at) {
  std::vector<double> lengths;
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    if (const auto r = residual(at, data.places[k], data.pixels[k])) lengths.push_back(r->norm());
  }
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

// One robust Gauss-Newton step over the homography and the bend (Cauchy's weights).
bool step(const Scaled& data, bool with_bend, Unknowns& at) {
  const int n = with_bend ? 9 : 8;
  MatrixXd N = MatrixXd::Zero(n, n);
  VectorXd g = VectorXd::Zero(n), row(n);
  const double scale = 2 * median_length(data, at) + 1e-9;
  for (std::size_t k = 0; k < data.places.size(); ++k) {
    const Vector2d &q = data.places[k], &u = data.pixels[k];
    const auto r = residual(at, q, u);
    if (!r) continue;
    const double weight = 1 / (1 + r->squaredNorm() / (scale * scale));
    const Vector3d p = at.H * Vector3d(q.x(), q.y(), 1);
    const double lens = (1 + at.bend * u.squaredNorm()) / p.z();
    for (int axis = 0; axis < 2; ++axis) {
      const double along = p(axis) / p.z();
      row.setZero();
      row.segment<3>(3 * axis) = lens * Vector3d(q.x(), q.y(), 1);
      row.segment<2>(6) = -lens * along * q;
      if (with_bend) row(8) = u.squaredNorm() * along;
      N.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      g -= weight * (*r)(axis)*row;
    }
  }
  if (with_bend) {
    const double prior = std::pow(std::max(prior_sigma, scale / 2) / bend_prior, 2);
    N(8, 8) += prior;
    g(8) -= prior * at.bend;
  }
  const Eigen::LDLT<MatrixXd> solver(N.selfadjointView<Eigen::Lower>());
  const VectorXd d = solver.solve(g);
  if (solver.info() != Eigen::Success || !d.allFinite()) return false;
  at.H += (Matrix3d() << d(0), d(1), d(2), d(3), d(4), d(5), d(6), d(7), 0).finished();
  if (with_bend) at.bend = std::clamp(at.bend + d(8), -largest_bend, largest_bend);
  return true;
}

}  // namespace

std::optional<BoardPlane> BoardPlane::fit(std::span<const PlanePair> pairs, int width_px, int height_px) {
  if (pairs.size() < 4) return std::nullopt;
  BoardPlane plane;
  plane.middle_px_ = 0.5 * Vector2d(width_px - 1, height_px - 1);
  plane.unit_px_ = 0.5 * std::hypot(width_px, height_px);
  Vector2d low = pairs[0].place, high = low;
  for (const PlanePair& pair : pairs) low = low.cwiseMin(pair.place), high = high.cwiseMax(pair.place);
  const Vector2d centre = 0.5 * (low + high);
  const double size = 0.5 * (high - low).maxCoeff();
  if (!(size > 0)) return std::nullopt;
  Scaled data;
  for (const PlanePair& pair : pairs) {
    data.places.push_back((pair.place - centre) / size);
    data.pixels.push_back((pair.u_px - plane.middle_px_) / plane.unit_px_);
  }
  Unknowns at;
  if (!start_linearly(data, at)) return std::nullopt;
  for (int round = 0; round < 10; ++round) {
    if (!step(data, pairs.size() >= enough_for_bend, at)) return std::nullopt;
  }
  plane.bend_ = at.bend;
  plane.H_ =
      at.H *
      (Matrix3d() << 1 / size, 0, -centre.x() / size, 0, 1 / size, -centre.y() / size, 0, 0, 1).finished();
  plane.inverse_ = plane.H_.inverse();
  if (!plane.H_.allFinite() || !plane.inverse_.allFinite()) return std::nullopt;
  return plane;
}

// Distorted = undistorted * 2 / (1 + sqrt(1 - 4 K r^2)): the inverse of the division model.
std::optional<Vector2d> BoardPlane::pixel(const Vector2d& place) const {
  const Vector3d p = H_ * Vector3d(place.x(), place.y(), 1);
  if (!(p.z() > 1e-9)) return std::nullopt;
  const Vector2d undistorted = p.head<2>() / p.z();
  const double root2 = 1 - 4 * bend_ * undistorted.squaredNorm();
  if (!(root2 >= 0)) return std::nullopt;
  return Vector2d(middle_px_ + unit_px_ * 2 / (1 + std::sqrt(root2)) * undistorted);
}

std::optional<Vector2d> BoardPlane::place(const Vector2d& u_px) const {
  const Vector2d u = (u_px - middle_px_) / unit_px_;
  const double scale = 1 + bend_ * u.squaredNorm();
  if (!(scale > 0.1)) return std::nullopt;
  const Vector3d q = inverse_ * Vector3d(u.x() / scale, u.y() / scale, 1);
  if (!(std::abs(q.z()) > 1e-12)) return std::nullopt;
  return Vector2d(q.head<2>() / q.z());
}

std::optional<Matrix2d> BoardPlane::stretch(const Vector2d& place) const {
  constexpr double h = 1e-3;
  Matrix2d J;
  for (int axis = 0; axis < 2; ++axis) {
    const auto after = pixel(place + h * Vector2d::Unit(axis)),
               before = pixel(place - h * Vector2d::Unit(axis));
    if (!after || !before) return std::nullopt;
    J.col(axis) = (*after - *before) / (2 * h);
  }
  return J;
}

}  // namespace zeropose
