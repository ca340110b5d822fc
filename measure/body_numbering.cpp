#include "measure/body_numbering.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "measure/body_plane_match.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t most_matches = 200, most_grown = 40;  // readings that are followed
constexpr double loose = 0.3;  // of the spacing: how far from its place a disc may be at first
constexpr double reach = 2.5;  // of the spacing: what is next to the marks that are matched
constexpr int most_rounds = 15;
constexpr double least_limit_px = 0.5, limit_by_median = 6, limit_share = 0.0025;  // of the diagonal
constexpr double off_table = 0.01;  // of the spacing: how far marks may be off the places of a nominal table
constexpr double most_off_focal = 3;  // sigmas
constexpr double other_share = 0.2;   // of the discs: so many with other numbers make another numbering

struct Expected {
  Vector2d u_px;
  Matrix2d stretch;  // px per mm on the mark's plane
};

// A disc for a mark, and how far it is off in spacings.
struct Offer {
  double off;
  std::size_t mark, disc;
};

class Grower {
 public:
  Grower(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks, const BodyLayout& layout,
         const RoughInternals& before)
      : discs_(discs), marks_(marks), layout_(layout), before_(before) {
    largest_px_ = std::max(2.0, limit_share * std::hypot(before.model.width_px, before.model.height_px));
  }

  // A plane's reading with a pose, before any other plane is looked at.
  std::optional<Numbering> begin(const PlaneMatch& match, const Pose& X_CB) const;
  // How many discs lie about where the marks are expected.
  std::size_t promise(const Numbering& numbering) const { return matched(numbering, loose, 0, true).count; }
  std::optional<Numbering> grow(Numbering numbering) const;
  double limit_px(const Numbering& numbering) const;
  double judging_limit_px(const Numbering& best) const;
  std::size_t count_within(const Numbering& numbering, double limit_px) const;
  void set_radius2(double radius2_mm2) { radius2_mm2_ = radius2_mm2; }

 private:
  std::optional<Expected> expected(const RoughCamera& camera, std::size_t mark) const;
  bool is_near(std::size_t mark, const Numbering& numbering) const;
  void offers_for(std::size_t mark, const Expected& at, double most_off, double most_px,
                  std::vector<Offer>& offers) const;
  // Discs nearest to where the marks are expected; most_px 0: no limit in px.
  Numbering matched(const Numbering& before, double most_off, double most_px, bool everywhere) const;
  bool refit(Numbering& numbering) const;
  std::vector<double> lengths_px(const Numbering& numbering) const;

  std::span<const LatticeDisc> discs_;
  std::span<const BodyMark> marks_;
  const BodyLayout& layout_;
  const RoughInternals& before_;
  double largest_px_ = 2, radius2_mm2_ = 0;
};

std::optional<Expected> Grower::expected(const RoughCamera& camera, std::size_t mark) const {
  const Vector3d p_C = camera.X_CB * marks_[mark].p_B_mm;
  const auto seen = project_with_jacobian(camera.model, p_C);
  if (!seen) return std::nullopt;
  const Vector3d normal = camera.X_CB.linear() * layout_.normals_B[mark];
  // Only a normal that was given has a sign.
  if (!marks_[mark].normal_B.isZero() && normal.dot(p_C) >= 0) return std::nullopt;
  const Vector3d facing = normal.isZero() ? Vector3d(p_C.normalized()) : normal;
  const Vector3d x = facing.unitOrthogonal(), y = facing.cross(x);
  Matrix2d stretch;
  stretch << seen->du_dp * x, seen->du_dp * y;
  if (!(std::abs(stretch.determinant()) > 1e-12)) return std::nullopt;
  return Expected{seen->u_px, stretch};
}

bool Grower::is_near(std::size_t mark, const Numbering& numbering) const {
  const double within = reach * layout_.spacing_mm[mark];
  for (std::size_t other = 0; other < marks_.size(); ++other)
    if (numbering.disc_of[other] != no_disc && (marks_[other].p_B_mm - marks_[mark].p_B_mm).norm() < within)
      return true;
  return false;
}

void Grower::offers_for(std::size_t mark, const Expected& at, double most_off, double most_px,
                        std::vector<Offer>& offers) const {
  const Matrix2d back = at.stretch.inverse() / layout_.spacing_mm[mark];
  const double known = marks_[mark].radius_mm;
  for (std::size_t disc = 0; disc < discs_.size(); ++disc) {
    const Vector2d off_px = discs_[disc].u_px - at.u_px;
    const double off = (back * off_px).norm();
    if (!(off < most_off) || (most_px > 0 && off_px.norm() > most_px)) continue;
    const auto radius2 = round_radius2(at.stretch, discs_[disc].shape_px2);
    if (radius2 && alike_radius2(*radius2, known > 0 ? known * known : radius2_mm2_))
      offers.push_back({off, mark, disc});
  }
}

Numbering Grower::matched(const Numbering& before, double most_off, double most_px, bool everywhere) const {
  std::vector<Offer> offers;
  for (std::size_t mark = 0; mark < marks_.size(); ++mark) {
    if (!everywhere && before.disc_of[mark] == no_disc && !is_near(mark, before)) continue;
    if (const auto at = expected(before.camera, mark)) offers_for(mark, *at, most_off, most_px, offers);
  }
  std::sort(offers.begin(), offers.end(), [](const Offer& a, const Offer& b) {
    return std::tie(a.off, a.mark, a.disc) < std::tie(b.off, b.mark, b.disc);
  });
  Numbering next = before;
  next.disc_of.assign(marks_.size(), no_disc);
  next.count = 0;
  std::vector<bool> used(discs_.size());
  for (const Offer& offer : offers) {
    if (next.disc_of[offer.mark] != no_disc || used[offer.disc]) continue;
    next.disc_of[offer.mark] = offer.disc;
    used[offer.disc] = true;
    ++next.count;
  }
  return next;
}

bool Grower::refit(Numbering& numbering) const {
  std::vector<BodyPair> pairs;
  for (std::size_t mark = 0; mark < marks_.size(); ++mark)
    if (numbering.disc_of[mark] != no_disc)
      pairs.push_back({marks_[mark].p_B_mm, discs_[numbering.disc_of[mark]].u_px});
  if (pairs.size() < 4) return false;
  const auto camera = fit_rough_camera(before_, numbering.camera, pairs, largest_px_);
  if (!camera ||
      std::abs(std::log(camera->model.fx_px / before_.model.fx_px)) > most_off_focal * before_.sigma_focal)
    return false;
  numbering.camera = *camera;
  double sum = 0;
  for (const BodyPair& pair : pairs) {
    const auto u_px = project(camera->model, camera->X_CB * pair.p_B_mm);
    if (!u_px) return false;
    sum += (pair.u_px - *u_px).squaredNorm();
  }
  numbering.rms_px = std::sqrt(sum / double(pairs.size()));
  return true;
}

std::vector<double> Grower::lengths_px(const Numbering& numbering) const {
  std::vector<double> lengths;
  for (std::size_t mark = 0; mark < marks_.size(); ++mark) {
    if (numbering.disc_of[mark] == no_disc) continue;
    const auto u_px = project(numbering.camera.model, numbering.camera.X_CB * marks_[mark].p_B_mm);
    if (u_px) lengths.push_back((discs_[numbering.disc_of[mark]].u_px - *u_px).norm());
  }
  return lengths;
}

// How far a disc may be from where it is expected, by how far the others are.
double Grower::limit_px(const Numbering& numbering) const {
  std::vector<double> lengths = lengths_px(numbering);
  if (lengths.empty()) return least_limit_px;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return std::clamp(limit_by_median * *middle, least_limit_px, largest_px_);
}

// A table may be nominal: what another reading leaves must be more than marks may be off their places.
double Grower::judging_limit_px(const Numbering& best) const {
  double sum = 0;
  for (std::size_t mark = 0; mark < marks_.size(); ++mark) {
    if (best.disc_of[mark] == no_disc) continue;
    if (const auto at = expected(best.camera, mark))
      sum += layout_.spacing_mm[mark] * std::sqrt(std::abs(at->stretch.determinant()));
  }
  return std::max(limit_px(best), off_table * sum / double(std::max<std::size_t>(1, best.count)));
}

std::size_t Grower::count_within(const Numbering& numbering, double limit_px) const {
  const std::vector<double> lengths = lengths_px(numbering);
  return static_cast<std::size_t>(
      std::count_if(lengths.begin(), lengths.end(), [&](double length) { return length < limit_px; }));
}

std::optional<Numbering> Grower::begin(const PlaneMatch& match, const Pose& X_CB) const {
  Numbering numbering;
  numbering.disc_of.assign(marks_.size(), no_disc);
  const BodyPlane& plane = layout_.planes[match.plane];
  for (std::size_t k = 0; k < match.disc_of.size(); ++k) numbering.disc_of[plane.marks[k]] = match.disc_of[k];
  numbering.count = match.count;
  numbering.camera = {before_.model, X_CB, 0};
  if (!refit(numbering)) return std::nullopt;
  return numbering;
}

// Ring by ring with a loose limit, then everywhere, then with the limit that the residuals allow.
std::optional<Numbering> Grower::grow(Numbering numbering) const {
  bool everywhere = false;
  for (int round = 0; round < most_rounds; ++round) {
    Numbering next = matched(numbering, loose, 0, everywhere);
    const bool same = next.disc_of == numbering.disc_of;
    if (same && everywhere) break;
    everywhere = everywhere || same;
    if (!refit(next)) return std::nullopt;
    numbering = std::move(next);
  }
  for (int round = 0; round < 3; ++round) {
    numbering = matched(numbering, loose, limit_px(numbering), true);
    if (!refit(numbering)) return std::nullopt;
  }
  return numbering;
}

bool is_other(const Numbering& a, const Numbering& b) {
  std::size_t different = 0, shared = 0;
  for (std::size_t mark = 0; mark < a.disc_of.size(); ++mark) {
    if (b.disc_of[mark] == no_disc) continue;
    const auto found = std::find(a.disc_of.begin(), a.disc_of.end(), b.disc_of[mark]);
    if (found == a.disc_of.end()) continue;
    ++shared;
    different += std::size_t(found - a.disc_of.begin()) != mark ? 1 : 0;
  }
  return shared == 0 || double(different) > other_share * double(std::min(a.count, b.count));
}

bool is_better(const Numbering& a, const Numbering& b) {
  return a.count != b.count ? a.count > b.count : a.rms_px < b.rms_px;
}

// What one guess of the internals makes of the readings.
void follow(std::span<const PlaneMatch> matches, Grower& grower, const BodyLayout& layout,
            const RoughInternals& before, std::vector<Numbering>& grown) {
  struct Begun {
    std::size_t promise;
    double radius2_mm2;
    Numbering numbering;
  };
  std::vector<Begun> begun;
  for (const PlaneMatch& match : matches) {
    const BodyPlane& plane = layout.planes[match.plane];
    const Vector3d middle_B = plane.origin_B + plane.axes_B.leftCols<2>() * match.middle_mm;
    grower.set_radius2(match.radius2_mm2);
    for (const Pose& X_CB :
         poses_of_plane(before.model, middle_B, plane.axes_B, match.middle_px, match.stretch)) {
      if (auto numbering = grower.begin(match, X_CB))
        begun.push_back({grower.promise(*numbering), match.radius2_mm2, std::move(*numbering)});
    }
  }
  std::stable_sort(begun.begin(), begun.end(),
                   [](const Begun& a, const Begun& b) { return a.promise > b.promise; });
  if (begun.size() > most_grown) begun.resize(most_grown);
  for (Begun& start : begun) {
    grower.set_radius2(start.radius2_mm2);
    if (auto numbering = grower.grow(std::move(start.numbering))) grown.push_back(std::move(*numbering));
  }
}

}  // namespace

Numberings number_discs(std::span<const LatticeDisc> discs, std::span<const BodyMark> marks,
                        const BodyLayout& layout, std::span<const RoughInternals> before) {
  std::vector<PlaneMatch> matches = match_planes(discs, marks, layout);
  std::stable_sort(matches.begin(), matches.end(),
                   [](const PlaneMatch& a, const PlaneMatch& b) { return a.count > b.count; });
  if (matches.size() > most_matches) matches.resize(most_matches);
  std::vector<Numbering> grown;
  for (const RoughInternals& guess : before) {
    Grower grower(discs, marks, layout, guess);
    follow(matches, grower, layout, guess, grown);
  }
  std::stable_sort(grown.begin(), grown.end(), is_better);
  Numberings result;
  if (grown.empty()) return result;
  result.best = grown.front();
  // All by the limit of the best: a wrong reading that explains the discs roughly does not explain them.
  const Grower judge(discs, marks, layout, before.front());
  const double limit_px = judge.judging_limit_px(result.best);
  for (const Numbering& other : grown)
    if (is_other(result.best, other))
      result.next_best = std::max(result.next_best, judge.count_within(other, limit_px));
  return result;
}

}  // namespace zeropose
