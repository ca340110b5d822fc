#include "measure/mark_sight.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

// The same thing, taken up twice from different grey levels, or once with its glint and once without.
bool same_place(const MarkFinding& a, const MarkFinding& b) {
  const double room = a.status == b.status ? 0.5 : 0.5 + 0.1 * a.diameter_px;
  return (a.u_px - b.u_px).norm() < room && std::abs(a.diameter_px - b.diameter_px) < 2 * room;
}

}  // namespace

bool stands(const MarkFinding& finding) {
  return finding.status == MarkStatus::found || finding.status == MarkStatus::saturated;
}

int telling(const MarkFinding& finding) {
  switch (finding.status) {
    case MarkStatus::no_candidate:  // with a size: like it, but too large, too flat or turned too far
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
    case MarkStatus::saturated:
      return 6;
    default:
      return 0;
  }
}

MarkSight sight_without(MarkStatus reason) {
  MarkSight sight;
  sight.nearest.status = reason;
  return sight;
}

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

}  // namespace zeropose
