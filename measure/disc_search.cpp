#include "measure/disc_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "measure/covered_outline.h"
#include "measure/mark_fit.h"

namespace zeropose {
namespace {

constexpr std::size_t most_candidates = 64;  // fits per window and look, where one is wanted
constexpr double widest_covered = 24;        // a window in units of the mark: where outlines are put together
constexpr double rival_contrast = 0.4;       // of the best one's: then it is a rival

// How near to a found mark a failed one came.
int telling(const MarkFinding& finding) {
  switch (finding.status) {
    case MarkStatus::no_candidate:  // with a size: an ellipse, but too large or too flat
      return finding.diameter_px > 0 ? 2 : 0;
    case MarkStatus::too_small:
      return 1;
    case MarkStatus::not_converged:
      return 2;
    case MarkStatus::low_contrast:
      return 3;
    case MarkStatus::blurred:
      return 4;
    case MarkStatus::cut_off:
      return 5;
    default:
      return 0;
  }
}

bool stands(const MarkFinding& finding) {
  return finding.status == MarkStatus::found || finding.status == MarkStatus::saturated;
}

// The same thing, taken up twice from different grey levels, or once with its glint and once without.
bool same_place(const MarkFinding& a, const MarkFinding& b) {
  const double room = a.status == b.status ? 0.5 : 0.5 + 0.1 * a.diameter_px;
  return (a.u_px - b.u_px).norm() < room && std::abs(a.diameter_px - b.diameter_px) < 2 * room;
}

MarkSight sight_of(const ImageView& image, const MarkSearch& search, const CandidateSearch& seen,
                   HowMany wanted, MarkWorkspace& workspace) {
  const std::size_t most = wanted.one() ? most_candidates : wanted.most;
  MarkSight sight;
  sight.nearest.status = seen.reason;
  for (std::size_t k = 0; k < seen.candidates.size(); ++k) {
    const MarkCandidate& candidate = seen.candidates[k];
    // The contrasts descend: what follows is no rival any more.
    if (wanted.one() && !sight.standing.empty() &&
        candidate.contrast < rival_contrast * sight.standing.front().contrast)
      break;
    if (k >= most) {
      sight.crowded = true;
      break;
    }
    sight.take(fit_mark(image, search, candidate.start, workspace.ellipse, workspace.tolerance));
  }
  sight.crowded = sight.crowded || seen.crowded;
  return sight;
}

// Levels so far apart that a rival could slip through call for a closer look.
bool decided(const MarkSight& sight, const CandidateSearch& seen) {
  const MarkFinding best = sight.only();
  return best.status == MarkStatus::ambiguous ||
         (stands(best) && seen.step_grey < 0.75 * rival_contrast * best.contrast);
}

// At finer and finer grey levels until it is sure which one it is.
MarkSight look_for_one(const ImageView& image, const MarkSearch& search, std::optional<CandidateSearch> seen,
                       MarkWorkspace& workspace) {
  MarkSight sight;
  while (seen) {
    sight = sight_of(image, search, *seen, {}, workspace);
    if (decided(sight, *seen)) break;
    seen = workspace.candidates.finer(image, search);
  }
  return sight;
}

// At grey levels so fine that the least contrast does not slip through.
MarkSight look_for_all(const ImageView& image, const MarkSearch& search, CandidateSearch seen,
                       std::size_t most, MarkWorkspace& workspace) {
  while (!(seen.step_grey < 0.75 * search.min_contrast)) {
    auto finer = workspace.candidates.finer(image, search);
    if (!finer) break;
    seen = std::move(*finer);
  }
  return sight_of(image, search, seen, {most}, workspace);
}

MarkSight look_at_regions(const ImageView& image, const MarkSearch& search, CandidateSearch seen,
                          HowMany wanted, MarkWorkspace& workspace) {
  return wanted.one() ? look_for_one(image, search, std::move(seen), workspace)
                      : look_for_all(image, search, std::move(seen), wanted.most, workspace);
}

double grey_near(const ImageView& image, const Eigen::Vector2d& at) {
  return image.grey_at(std::clamp(static_cast<int>(std::lround(at.x())), 0, image.width_px - 1),
                       std::clamp(static_cast<int>(std::lround(at.y())), 0, image.height_px - 1));
}

// The middle grey level on an ellipse of that share of the size, where the outline can be seen.
double grey_at_share(const ImageView& image, const EllipseStart& start, double share) {
  const Eigen::LLT<Eigen::Matrix2d> root(start.shape_px2);
  std::array<double, SectorOf::count> greys{};
  std::size_t n = 0;
  for (int k = 0; k < SectorOf::count; ++k) {
    if ((start.hidden >> k & 1) != 0) continue;
    const double angle = ((k + 0.5) / (SectorOf::count / 2) - 1) * std::numbers::pi;
    const Eigen::Vector2d on = root.matrixL() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    greys[n++] = grey_near(image, start.centre_px + share * on);
  }
  if (n == 0) return 0;
  std::nth_element(greys.begin(), greys.begin() + std::ptrdiff_t(n / 2), greys.begin() + std::ptrdiff_t(n));
  return greys[n / 2];
}

// A disc is of one surface; what has another one inside is a ring. A ball may have its highlight.
bool filled(const ImageView& image, const MarkSearch& search, const EllipseStart& start) {
  if (search.kind == MarkKind::ball) return true;
  const double contrast = start.background_grey - start.mark_grey;
  for (const double share : {0.35, 0.65})
    if ((grey_at_share(image, start, share) - start.mark_grey) / contrast > 0.4) return false;
  return true;
}

void look_at_outlines(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                      MarkWorkspace& workspace, MarkSight& sight) {
  for (const CoveredOutline& outline : covered_outlines(image, window, search)) {
    EllipseStart start = outline.start;
    const double rim = std::max(0.0, 1 - 2.5 / half_axes(start.shape_px2).minor_px);
    start.mark_grey = grey_at_share(image, start, rim);
    start.background_grey = grey_at_share(image, start, 2 - rim);
    const double contrast = (start.background_grey - start.mark_grey) * (search.bright ? -1 : 1);
    if (!(contrast > 0.5 * search.min_contrast) || !filled(image, search, start)) continue;
    const MarkFinding finding =
        fit_covered_mark(image, search, start, workspace.ellipse, workspace.tolerance);
    // What is none after all says less than the regions do.
    if (stands(finding) || finding.status == MarkStatus::blurred) sight.take(finding);
  }
}

}  // namespace

void MarkSight::take(const MarkFinding& finding) {
  if (!stands(finding)) {
    if (telling(finding) >= telling(nearest)) nearest = finding;
    return;
  }
  const auto known = std::find_if(standing.begin(), standing.end(),
                                  [&](const MarkFinding& other) { return same_place(other, finding); });
  if (known != standing.end()) {
    if (known->status != MarkStatus::saturated) return;
    standing.erase(known);
  }
  const auto behind = std::find_if(standing.begin(), standing.end(), [&](const MarkFinding& other) {
    return other.contrast < finding.contrast;
  });
  standing.insert(behind, finding);
}

bool MarkSight::found() const {
  return std::any_of(standing.begin(), standing.end(),
                     [](const MarkFinding& finding) { return finding.status == MarkStatus::found; });
}

MarkFinding MarkSight::only() const {
  if (standing.empty()) return nearest;
  MarkFinding best = standing.front();
  const bool rival = standing.size() > 1 && standing[1].contrast > rival_contrast * best.contrast;
  if (rival || crowded) best.status = MarkStatus::ambiguous;
  return best;
}

MarkSight look_for_discs(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         HowMany wanted, MarkWorkspace& workspace) {
  CandidateFinder& finder = workspace.candidates;
  workspace.tolerance.noise_grey =
      2 * noise_grey(image, window) + 0.5;  // shot noise: more where it is bright
  MarkSight sight = look_at_regions(image, search, finder.first(image, window, search), wanted, workspace);
  if (sight.found()) return sight;
  if (auto seen = finder.flattened(image, search)) {
    MarkSight flat = look_at_regions(image, search, *std::move(seen), wanted, workspace);
    flat.take(sight.nearest);
    for (const MarkFinding& finding : sight.standing) flat.take(finding);
    sight = std::move(flat);
    if (sight.found()) return sight;
  }
  if (std::max(window.width(), window.height()) <= widest_covered * search.max_diameter_px)
    look_at_outlines(image, window, search, workspace, sight);
  return sight;
}

}  // namespace zeropose
