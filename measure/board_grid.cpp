#include "measure/board_grid.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "measure/ellipse_band.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector2i;

constexpr double on_grid = 0.15;         // of a step: how far from its place a disc across a gap may be
constexpr int widest_gap = 4;            // steps
constexpr int window = 2;                // steps: what counts as round a point
constexpr std::size_t enough_round = 8;  // points, to know where the one in their middle belongs
constexpr double model_px = 0.01;        // what remains of the plane's and the fit's model beside the noise
constexpr double least_sigmas = 8, sigmas_by_median = 6;
constexpr double least_stretch = 0.6, most_stretch = 1.7;  // of an outline's shape against the plane's

class GridFinder {
 public:
  GridFinder(std::span<const MarkFinding> discs, int width_px, int height_px)
      : discs_(discs), width_px_(width_px), height_px_(height_px), banned_(discs.size()) {}

  BoardGrid find();

 private:
  bool fit();
  void measure_radius();
  bool shape_fits(std::size_t disc, const Vector2d& place) const;
  bool drop_other_shapes();
  bool drop_worst();
  bool extend();
  std::optional<Vector2d> residual(const LatticePoint& point) const;
  std::optional<Vector2d> expected_residual(std::size_t index, const std::vector<Vector2d>& residuals) const;
  void drop(std::size_t index);

  std::span<const MarkFinding> discs_;
  int width_px_, height_px_;
  std::vector<bool> banned_;  // once thrown out
  BoardGrid grid_;
  double radius2_ = 0;  // of the discs, in steps
};

void GridFinder::drop(std::size_t index) {
  banned_[grid_.points[index].disc] = true;
  grid_.points.erase(grid_.points.begin() + static_cast<std::ptrdiff_t>(index));
}

bool GridFinder::fit() {
  std::vector<PlanePair> pairs;
  for (const LatticePoint& point : grid_.points)
    pairs.push_back({point.at.cast<double>(), discs_[point.disc].u_px});
  grid_.plane = BoardPlane::fit(pairs, width_px_, height_px_);
  if (!grid_.plane) return false;
  measure_radius();
  return radius2_ > 0;
}

void GridFinder::measure_radius() {
  std::vector<double> all;
  for (const LatticePoint& point : grid_.points) {
    const auto J = grid_.plane->stretch(point.at.cast<double>());
    if (J) all.push_back(std::sqrt(discs_[point.disc].shape_px2.determinant()) / std::abs(J->determinant()));
  }
  radius2_ = 0;
  if (all.empty()) return;
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  radius2_ = *middle;
}

// The outline seen through the plane is a circle of the common radius, but for half a pixel.
bool GridFinder::shape_fits(std::size_t disc, const Vector2d& place) const {
  const auto J = grid_.plane->stretch(place);
  if (!J || !(std::abs(J->determinant()) > 0)) return false;
  const Matrix2d back = J->inverse();
  const HalfAxes axes = half_axes(Matrix2d(back * discs_[disc].shape_px2 * back.transpose() / radius2_));
  const double room = 1 / std::sqrt(0.25 * discs_[disc].shape_px2.trace());  // half a pixel, both ways
  return axes.minor_px * axes.minor_px > least_stretch - room &&
         axes.major_px * axes.major_px < most_stretch + room;
}

bool GridFinder::drop_other_shapes() {
  bool dropped = false;
  for (std::size_t k = grid_.points.size(); k-- > 0;) {
    if (shape_fits(grid_.points[k].disc, grid_.points[k].at.cast<double>())) continue;
    drop(k);
    dropped = true;
  }
  return dropped;
}

std::optional<Vector2d> GridFinder::residual(const LatticePoint& point) const {
  const auto expected = grid_.plane->pixel(point.at.cast<double>());
  if (!expected) return std::nullopt;
  return Vector2d(discs_[point.disc].u_px - *expected);
}

// A lens that is not quite the model's leaves residuals that vary slowly: what those round a point say of it,
// linear in the place.
std::optional<Vector2d> GridFinder::expected_residual(std::size_t index,
                                                      const std::vector<Vector2d>& residuals) const {
  Matrix3d N = Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> g = Eigen::Matrix<double, 3, 2>::Zero();
  std::size_t count = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const Vector2i off = grid_.points[k].at - grid_.points[index].at;
    if (k == index || off.cwiseAbs().maxCoeff() > window) continue;
    const Eigen::Vector3d row(1, off.x(), off.y());
    N += row * row.transpose();
    g += row * residuals[k].transpose();
    ++count;
  }
  if (count < enough_round) return std::nullopt;
  const Eigen::LDLT<Matrix3d> solver(N);
  const Vector2d expected = solver.solve(g).row(0);
  if (!(solver.rcond() > 1e-6) || !expected.allFinite()) return std::nullopt;
  return expected;
}

bool GridFinder::drop_worst() {
  std::vector<Vector2d> residuals;
  for (const LatticePoint& point : grid_.points) {
    const auto r = residual(point);
    residuals.push_back(r ? *r : Vector2d(1e6, 1e6));
  }
  std::vector<double> sigmas;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const auto expected = expected_residual(k, residuals);
    const double variance = 0.5 * discs_[grid_.points[k].disc].covariance_px2.trace() + model_px * model_px;
    sigmas.push_back((residuals[k] - expected.value_or(Vector2d::Zero())).norm() / std::sqrt(variance));
  }
  if (sigmas.size() < 6) return false;
  std::vector<double> sorted = sigmas;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const auto worst = std::max_element(sigmas.begin(), sigmas.end());
  if (*worst < std::max(least_sigmas, sigmas_by_median * *middle)) return false;
  drop(static_cast<std::size_t>(worst - sigmas.begin()));
  return true;
}

// Takes in what lies on the grid though no chain of neighbours leads there.
bool GridFinder::extend() {
  std::vector<bool> used(discs_.size());
  for (const LatticePoint& point : grid_.points) used[point.disc] = true;
  const std::size_t before = grid_.points.size();
  for (std::size_t disc = 0; disc < discs_.size(); ++disc) {
    if (used[disc] || banned_[disc]) continue;
    const auto place = grid_.plane->place(discs_[disc].u_px);
    if (!place || place->cwiseAbs().maxCoeff() > 1e6) continue;
    const Vector2i at = place->array().round().cast<int>();
    if ((*place - at.cast<double>()).norm() > on_grid || !shape_fits(disc, *place)) continue;
    int nearest = std::numeric_limits<int>::max();
    for (const LatticePoint& point : grid_.points)
      nearest = std::min(nearest, (point.at - at).cwiseAbs().maxCoeff());
    if (nearest > 0 && nearest <= widest_gap) grid_.points.push_back({disc, at});
  }
  return grid_.points.size() > before;
}

BoardGrid GridFinder::find() {
  std::vector<LatticeDisc> discs;
  for (const MarkFinding& disc : discs_) discs.push_back({disc.u_px, disc.shape_px2});
  grid_.points = grow_lattice(discs);
  for (std::size_t round = 0; round < 2 * discs.size() + 4; ++round) {
    if (grid_.points.size() < 4 || !fit()) return {};
    if (drop_other_shapes() || drop_worst() || extend()) continue;
    return grid_;
  }
  return {};
}

}  // namespace

BoardGrid find_grid(std::span<const MarkFinding> discs, int width_px, int height_px) {
  return GridFinder(discs, width_px, height_px).find();
}

}  // namespace zeropose
