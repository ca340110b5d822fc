#include "measure/lattice.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector2i;

constexpr std::size_t most_neighbours = 10, most_seeds = 24;
constexpr int enough_visits = 3;           // one seed may have taken diagonals for sides
constexpr double area_ratio = 1.8;         // between the images of neighbours
constexpr double square_tolerance = 0.25;  // of the side: how far a seed's neighbours may be from a square
constexpr double step_tolerance = 0.3;  // of the step: how far a neighbour may be from where it is expected

const std::array<Vector2i, 4> sides{Vector2i(1, 0), Vector2i(0, 1), Vector2i(-1, 0), Vector2i(0, -1)};

// Square root's inverse of a positive definite matrix, in closed form.
Matrix2d whitener(const Matrix2d& S) {
  const double root = std::sqrt(S.determinant()), t = std::sqrt(S.trace() + 2 * root);
  const Matrix2d sqrt_S = (S + root * Matrix2d::Identity()) / t;
  return sqrt_S.inverse();
}

struct Neighbour {
  std::size_t disc;
  Vector2d offset;  // whitened with the disc's own outline: radii
  double distance;
};

struct Seed {
  std::size_t disc;
  Matrix2d steps_px;  // columns: to the neighbours along the two axes
  int neighbours;     // of the eight round it
  double side;        // in radii
};

class Grower {
 public:
  explicit Grower(std::span<const LatticeDisc> discs) : discs_(discs) {
    for (const LatticeDisc& disc : discs) areas_.push_back(std::sqrt(disc.shape_px2.determinant()));
  }

  std::vector<LatticePoint> largest();

 private:
  bool alike(std::size_t a, std::size_t b) const {
    const double ratio = areas_[a] / areas_[b];
    return ratio < area_ratio && ratio > 1 / area_ratio;
  }
  std::vector<Neighbour> neighbours_of(std::size_t disc) const;
  void add_seeds(std::size_t disc, std::vector<Seed>& seeds) const;
  std::vector<LatticePoint> grow(const Seed& seed) const;

  std::span<const LatticeDisc> discs_;
  std::vector<double> areas_;
};

std::vector<Neighbour> Grower::neighbours_of(std::size_t disc) const {
  const Matrix2d W = whitener(discs_[disc].shape_px2);
  std::vector<Neighbour> all;
  for (std::size_t k = 0; k < discs_.size(); ++k) {
    if (k == disc || !alike(k, disc)) continue;
    const Vector2d offset = W * (discs_[k].u_px - discs_[disc].u_px);
    const double distance = offset.norm();
    if (distance > 1.5) all.push_back({k, offset, distance});
  }
  const std::size_t kept = std::min(most_neighbours, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(kept), all.end(),
                    [](const Neighbour& a, const Neighbour& b) {
                      return std::pair(a.distance, a.disc) < std::pair(b.distance, b.disc);
                    });
  all.resize(kept);
  return all;
}

// Neighbours that stand where one of the eight round the disc belongs.
int count_round(const std::vector<Neighbour>& neighbours, const Vector2d& a, const Vector2d& b) {
  int count = 0;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      if (i == 0 && j == 0) continue;
      const Vector2d expected = i * a + j * b;
      count += std::any_of(neighbours.begin(), neighbours.end(), [&](const Neighbour& n) {
        return (n.offset - expected).norm() < step_tolerance * a.norm();
      });
    }
  }
  return count;
}

// The best square of each disc: the shortest sides among those with most neighbours.
void Grower::add_seeds(std::size_t disc, std::vector<Seed>& seeds) const {
  const std::vector<Neighbour> near = neighbours_of(disc);
  const Seed none{disc, Matrix2d::Zero(), 2, 0};
  Seed best = none;
  for (const Neighbour& a : near) {
    const Vector2d turned(-a.offset.y(), a.offset.x());
    for (const Neighbour& b : near) {
      if ((b.offset - turned).norm() > square_tolerance * a.distance) continue;
      const int count = count_round(near, a.offset, b.offset);
      const bool shorter = a.distance < 0.85 * best.side;
      if (count > best.neighbours + (shorter ? -2 : 0) || (count >= 5 && shorter)) {
        best.neighbours = count;
        best.side = a.distance;
        best.steps_px << discs_[a.disc].u_px - discs_[disc].u_px, discs_[b.disc].u_px - discs_[disc].u_px;
      }
    }
  }
  if (best.side > 0) seeds.push_back(best);
}

using Place = std::pair<int, int>;
Place place_of(const Vector2i& at) { return {at.x(), at.y()}; }

// One lattice on its way.
struct Growth {
  std::span<const LatticeDisc> discs;
  std::vector<LatticePoint> points;
  std::vector<Matrix2d> steps_px;  // of each point
  std::map<Place, std::size_t> taken;
  std::vector<bool> used;

  void add(std::size_t disc, const Vector2i& at, const Matrix2d& steps) {
    taken[place_of(at)] = points.size();
    points.push_back({disc, at});
    steps_px.push_back(steps);
    used[disc] = true;
  }
  const Vector2d* pixel_at(const Vector2i& at) const {
    const auto found = taken.find(place_of(at));
    return found == taken.end() ? nullptr : &discs[points[found->second].disc].u_px;
  }
  Matrix2d refined_steps(std::size_t point) const;
};

// Measured at the neighbours on both sides where there are, else on one, else as handed down.
Matrix2d Growth::refined_steps(std::size_t point) const {
  Matrix2d steps = steps_px[point];
  const Vector2d& here = discs[points[point].disc].u_px;
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2i unit = sides[std::size_t(axis)];
    const Vector2d *next = pixel_at(points[point].at + unit), *last = pixel_at(points[point].at - unit);
    if (next && last)
      steps.col(axis) = 0.5 * (*next - *last);
    else if (next)
      steps.col(axis) = *next - here;
    else if (last)
      steps.col(axis) = here - *last;
  }
  return steps;
}

std::vector<LatticePoint> Grower::grow(const Seed& seed) const {
  Growth growth{discs_, {}, {}, {}, std::vector<bool>(discs_.size())};
  growth.add(seed.disc, Vector2i::Zero(), seed.steps_px);
  for (std::size_t point = 0; point < growth.points.size(); ++point) {
    const std::size_t disc = growth.points[point].disc;
    const Matrix2d steps = growth.refined_steps(point);
    if (!(steps.determinant() > 0)) continue;
    const Matrix2d inverse = steps.inverse();
    for (const Vector2i& side : sides) {
      const Vector2i at = growth.points[point].at + side;
      if (growth.taken.contains(place_of(at))) continue;
      const Vector2d expected = discs_[disc].u_px + steps * side.cast<double>();
      double nearest = step_tolerance;
      std::size_t next = discs_.size();
      for (std::size_t k = 0; k < discs_.size(); ++k) {
        if (growth.used[k] || !alike(k, disc)) continue;
        const double off = (inverse * (discs_[k].u_px - expected)).norm();
        if (off < nearest) nearest = off, next = k;
      }
      if (next < discs_.size()) growth.add(next, at, steps);
    }
  }
  return growth.points;
}

std::vector<LatticePoint> Grower::largest() {
  std::vector<Seed> seeds;
  for (std::size_t k = 0; k < discs_.size(); ++k) add_seeds(k, seeds);
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.neighbours > b.neighbours; });
  std::vector<LatticePoint> best;
  std::vector<int> seen(discs_.size());
  std::size_t tried = 0;
  for (const Seed& seed : seeds) {
    if (tried == most_seeds || 4 * best.size() > 3 * discs_.size()) break;
    if (seen[seed.disc] >= enough_visits) continue;
    ++tried;
    const std::vector<LatticePoint> points = grow(seed);
    for (const LatticePoint& point : points) ++seen[point.disc];
    if (points.size() > best.size()) best = points;
  }
  return best.size() < 4 ? std::vector<LatticePoint>{} : best;
}

}  // namespace

std::vector<LatticePoint> grow_lattice(std::span<const LatticeDisc> discs) { return Grower(discs).largest(); }

}  // namespace zeropose
