// Discs, holes and balls in a window: what stands there, or what came nearest.
#pragma once

#include <vector>

#include "measure/ellipse_fit.h"
#include "measure/mark_candidates.h"
#include "measure/mark_fit.h"
#include "measure/marks.h"

namespace zeropose {

// Memory kept from one search to the next. Holds no results.
struct MarkWorkspace {
  CandidateFinder candidates;
  EllipseWorkspace ellipse;
  FitTolerance tolerance;
};

struct MarkSight {
  std::vector<MarkFinding> standing;  // found, or would be if they were not saturated; best contrast first
  MarkFinding nearest;                // what came nearest to one where none stands
  bool crowded = false;               // more things than were looked at: one of them may be the mark as well

  // In its place among those that stand, once for each thing; or as the nearest if it came nearer.
  void take(const MarkFinding& finding);
  bool found() const;
  // The one mark of the window, ambiguous where a second one stands beside it.
  MarkFinding only() const;
};

// How many are wanted: one, then it looks until it is sure which one is the mark or that several are; or all,
// of the least contrast too, of which so many at most are looked at.
struct HowMany {
  std::size_t most = 0;  // 0: one

  bool one() const { return most == 0; }
};

// First as regions at grey levels; where that finds none, without the light's falling off, and then, in a
// window of at most twenty-four times the mark, by their outline, of which parts may be covered.
// Precondition: the search makes sense and its window is not empty.
MarkSight look_for_discs(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         HowMany wanted, MarkWorkspace& workspace);

}  // namespace zeropose
