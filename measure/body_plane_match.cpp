#include "measure/body_plane_match.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/homography.h"
#include "measure/body_numbering.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double least_roundness = 0.45;  // shorter by longer axis, squared
constexpr double most_alike = 2.5;        // squared radii
constexpr double on_place = 0.25;         // of the spacing: how far from its place a disc may be
constexpr double reach = 1.7;             // of the spacing: what is next to the marks that are matched
constexpr int most_rounds = 12;

Matrix2d whitener(const Matrix2d& S) {
  const double root = std::sqrt(S.determinant()), t = std::sqrt(S.trace() + 2 * root);
  return Matrix2d((S + root * Matrix2d::Identity()) / t).inverse();
}

struct Seen {
  Vector2d u_px;
  Matrix2d stretch;
};

// Nothing beyond the vanishing line; `sign` is that of the denominator at the seed.
std::optional<Seen> seen_through(const Matrix3d& H, const Vector2d& place, double sign) {
  const Vector3d p = H * Vector3d(place.x(), place.y(), 1);
  if (!(p.z() * sign > 0)) return std::nullopt;
  const Vector2d u = p.head<2>() / p.z();
  const Matrix2d stretch = (H.topLeftCorner<2, 2>() - u * H.block<1, 2>(2, 0)) / p.z();
  return Seen{u, stretch};
}

class Matcher {
 public:
  Matcher(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks, const BodyLayout& layout,
          std::size_t plane)
      : discs_(discs), marks_(marks), layout_(layout), index_(plane), plane_(layout.planes[plane]) {}

  // Grown from four discs that are taken for the marks of a cell.
  std::optional<PlaneMatch> grow(const BodyCell& discs, const BodyCell& cell) const;

 private:
  bool begin(const BodyCell& discs, const BodyCell& cell, PlaneMatch& match) const;
  bool fits(std::size_t k, const Matrix2d& stretch, std::size_t disc, const PlaneMatch& match) const;
  std::optional<Matrix3d> map_of(const PlaneMatch& match) const;
  bool extend(const Matrix3d& H, PlaneMatch& match) const;
  std::size_t nearest(const Seen& seen, std::size_t k, const PlaneMatch& match,
                      const std::vector<bool>& used) const;
  bool is_near(std::size_t k, const PlaneMatch& match) const;

  std::span<const LatticeDisc> discs_;
  std::span<const BodyMark> marks_;
  const BodyLayout& layout_;
  std::size_t index_;
  const BodyPlane& plane_;
};

double sign_at(const Matrix3d& H, const Vector2d& place) {
  return (H * Vector3d(place.x(), place.y(), 1)).z() > 0 ? 1 : -1;
}

bool Matcher::fits(std::size_t k, const Matrix2d& stretch, std::size_t disc, const PlaneMatch& match) const {
  const auto radius2 = round_radius2(stretch, discs_[disc].shape_px2);
  if (!radius2) return false;
  const double known = marks_[plane_.marks[k]].radius_mm;
  return alike_radius2(*radius2, known > 0 ? known * known : match.radius2_mm2);
}

// The affine map of the four is enough to see whether they are round.
bool Matcher::begin(const BodyCell& discs, const BodyCell& cell, PlaneMatch& match) const {
  Matrix2d places, pixels;
  const auto side = [](const auto& at, int which) -> Vector2d {
    return which == 0 ? 0.5 * (at(1) - at(0) + at(2) - at(3)) : 0.5 * (at(3) - at(0) + at(2) - at(1));
  };
  const auto place = [&](int k) { return plane_.places[cell[std::size_t(k)]]; };
  const auto pixel = [&](int k) { return discs_[discs[std::size_t(k)]].u_px; };
  places << side(place, 0), side(place, 1);
  pixels << side(pixel, 0), side(pixel, 1);
  match.stretch = pixels * places.inverse();
  double sum = 0;
  for (const std::size_t disc : discs) {
    const auto radius2 = round_radius2(match.stretch, discs_[disc].shape_px2);
    if (!radius2) return false;
    sum += *radius2 / 4;
  }
  match.radius2_mm2 = sum;
  for (std::size_t k = 0; k < 4; ++k)
    if (!fits(cell[k], match.stretch, discs[k], match)) return false;
  match.plane = index_;
  match.disc_of.assign(plane_.marks.size(), no_disc);
  for (std::size_t k = 0; k < 4; ++k) match.disc_of[cell[k]] = discs[k];
  match.count = 4;
  return true;
}

std::optional<Matrix3d> Matcher::map_of(const PlaneMatch& match) const {
  std::vector<ImagedPoint> pairs;
  for (std::size_t k = 0; k < match.disc_of.size(); ++k)
    if (match.disc_of[k] != no_disc)
      pairs.push_back({{plane_.places[k].x(), plane_.places[k].y(), 0}, discs_[match.disc_of[k]].u_px});
  return homography(pairs);
}

bool Matcher::is_near(std::size_t k, const PlaneMatch& match) const {
  const double within = reach * layout_.spacing_mm[plane_.marks[k]];
  for (std::size_t other = 0; other < match.disc_of.size(); ++other)
    if (match.disc_of[other] != no_disc && (plane_.places[other] - plane_.places[k]).norm() < within)
      return true;
  return false;
}

std::size_t Matcher::nearest(const Seen& seen, std::size_t k, const PlaneMatch& match,
                             const std::vector<bool>& used) const {
  const Matrix2d back = seen.stretch.inverse();
  double best = on_place * layout_.spacing_mm[plane_.marks[k]];
  std::size_t found = no_disc;
  for (std::size_t disc = 0; disc < discs_.size(); ++disc) {
    if (used[disc]) continue;
    const double off = (back * (discs_[disc].u_px - seen.u_px)).norm();
    if (off < best && fits(k, seen.stretch, disc, match)) best = off, found = disc;
  }
  return found;
}

bool Matcher::extend(const Matrix3d& H, PlaneMatch& match) const {
  std::vector<bool> used(discs_.size());
  double sign = 0;
  for (std::size_t k = 0; k < match.disc_of.size(); ++k) {
    if (match.disc_of[k] == no_disc) continue;
    used[match.disc_of[k]] = true;
    sign = sign_at(H, plane_.places[k]);
  }
  const PlaneMatch before = match;
  for (std::size_t k = 0; k < match.disc_of.size(); ++k) {
    if (match.disc_of[k] != no_disc || !is_near(k, before)) continue;
    const auto seen = seen_through(H, plane_.places[k], sign);
    if (!seen) continue;
    match.disc_of[k] = nearest(*seen, k, match, used);
    if (match.disc_of[k] == no_disc) continue;
    used[match.disc_of[k]] = true;
    ++match.count;
  }
  return match.count > before.count;
}

// Where the four are by their affine map.
Matrix3d affine_of(const PlaneMatch& match, const Vector2d& place, const Vector2d& u_px) {
  Matrix3d A = Matrix3d::Identity();
  A.topLeftCorner<2, 2>() = match.stretch;
  A.topRightCorner<2, 1>() = u_px - match.stretch * place;
  return A;
}

std::optional<PlaneMatch> Matcher::grow(const BodyCell& discs, const BodyCell& cell) const {
  PlaneMatch match;
  if (!begin(discs, cell, match)) return std::nullopt;
  // The cheap map of the four decides whether it is worth while: most readings have no next mark.
  PlaneMatch next = match;
  Vector2d place = Vector2d::Zero(), u_px = Vector2d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    place += plane_.places[cell[k]] / 4;
    u_px += discs_[discs[k]].u_px / 4;
  }
  const Matrix3d affine = affine_of(match, place, u_px);
  if (!extend(affine, next) && plane_.marks.size() > 4) return std::nullopt;
  std::optional<Matrix3d> H = map_of(match);
  for (int round = 0; round < most_rounds && H && extend(*H, match); ++round) H = map_of(match);
  if (!H) return std::nullopt;
  match.middle_mm.setZero();
  for (std::size_t k = 0; k < match.disc_of.size(); ++k)
    if (match.disc_of[k] != no_disc) match.middle_mm += plane_.places[k] / double(match.count);
  const auto middle = seen_through(*H, match.middle_mm, sign_at(*H, match.middle_mm));
  if (!middle || !middle->u_px.allFinite() || !middle->stretch.allFinite()) return std::nullopt;
  match.middle_px = middle->u_px;
  match.stretch = middle->stretch;
  return match;
}

// The cell begun at each of its corners, and both ways round.
std::array<BodyCell, 8> turned(const BodyCell& cell) {
  std::array<BodyCell, 8> all;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      all[k][corner] = cell[(k + corner) % 4];
      all[4 + k][corner] = cell[(k + 4 - corner) % 4];
    }
  }
  return all;
}

bool is_part_of(const BodyCell& discs, const BodyCell& cell, const PlaneMatch& match) {
  for (std::size_t k = 0; k < 4; ++k)
    if (match.disc_of[cell[k]] != discs[k]) return false;
  return true;
}

}  // namespace

std::optional<double> round_radius2(const Matrix2d& stretch, const Matrix2d& shape_px2) {
  const Matrix2d back = stretch.inverse();
  const Matrix2d S = back * shape_px2 * back.transpose();
  const double mean = 0.5 * S.trace(), spread = std::hypot(0.5 * (S(0, 0) - S(1, 1)), S(0, 1));
  if (!(mean - spread > least_roundness * (mean + spread))) return std::nullopt;
  return std::sqrt(S.determinant());
}

bool alike_radius2(double a, double b) { return a < most_alike * b && b < most_alike * a; }

std::vector<PlaneMatch> match_planes(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks,
                                     const BodyLayout& layout) {
  std::vector<Vector2d> pixels;
  std::vector<Matrix2d> metric;
  for (const LatticeDisc& disc : discs) {
    pixels.push_back(disc.u_px);
    metric.push_back(whitener(disc.shape_px2));
  }
  std::vector<PlaneMatch> matches;
  const std::vector<BodyCell> seen = cells_of(pixels, metric);
  for (std::size_t plane = 0; plane < layout.planes.size(); ++plane) {
    const Matcher matcher(discs, marks, layout, plane);
    const auto first = static_cast<std::ptrdiff_t>(matches.size());
    for (const BodyCell& four : seen)
      for (const BodyCell& cell : layout.planes[plane].cells)
        for (const BodyCell& reading : turned(cell)) {
          if (std::any_of(matches.begin() + first, matches.end(),
                          [&](const PlaneMatch& match) { return is_part_of(four, reading, match); }))
            continue;
          if (auto match = matcher.grow(four, reading)) matches.push_back(std::move(*match));
        }
  }
  return matches;
}

}  // namespace zeropose
