// Ellipses whose outline is seen in part only: found from edge points, where regions of one grey level run
// together with what covers them.
#pragma once

#include <vector>

#include "measure/ellipse_fit.h"
#include "measure/marks.h"

namespace zeropose {

struct CoveredOutline {
  EllipseStart start;  // in pixels of the image; hidden: sectors without an edge
  int seen = 0;        // sectors of the outline with an edge point in its place
};

// Outlines of which at least 0.6 is seen, the most complete first, each place once. Repeatable.
std::vector<CoveredOutline> covered_outlines(const ImageView& image, const PixelWindow& window,
                                             const MarkSearch& search);

}  // namespace zeropose
