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

// One: eight levels tell at once a mark that has six tenths of the window's range. All: so fine that the
// least contrast does not slip through.
LevelPlan plan_for(const MarkSearch& search, HowMany wanted) {
  if (wanted.one()) return {LevelPlan{}.widest_step_grey, 8};
  return {0.75 * search.min_contrast / CandidateFinder::step_grey_by_step, 255};
}

MarkSight look_at_regions(const ImageView& image, const MarkSearch& search, CandidateSearch seen,
                          HowMany wanted, MarkWorkspace& workspace) {
  return wanted.one() ? look_for_one(image, search, std::move(seen), workspace)
                      : sight_of(image, search, seen, wanted, workspace);
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

MarkSight look_for_discs(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         HowMany wanted, MarkWorkspace& workspace) {
  CandidateFinder& finder = workspace.candidates;
  workspace.tolerance.noise_grey =
      2 * noise_grey(image, window) + 0.5;  // shot noise: more where it is bright
  const LevelPlan plan = plan_for(search, wanted);
  MarkSight sight =
      look_at_regions(image, search, finder.first(image, window, search, plan), wanted, workspace);
  if (sight.found()) return sight;
  if (auto seen = finder.flattened(image, search, plan)) {
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
