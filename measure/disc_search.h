// Discs, holes and balls in a window: what stands there, or what came nearest.
#pragma once

#include "measure/ellipse_fit.h"
#include "measure/mark_candidates.h"
#include "measure/mark_fit.h"
#include "measure/mark_sight.h"
#include "measure/marks.h"

namespace zeropose {

// Memory kept from one search to the next. Holds no results.
struct MarkWorkspace {
  CandidateFinder candidates;
  EllipseWorkspace ellipse;
  FitTolerance tolerance;
};

// First as regions at grey levels; where that finds none, without the light's falling off, and then, in a
// window of at most twenty-four times the mark, by their outline, of which parts may be covered.
// Precondition: the search makes sense and its window is not empty.
MarkSight look_for_discs(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         HowMany wanted, MarkWorkspace& workspace);

}  // namespace zeropose
