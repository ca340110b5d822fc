// One candidate for a mark measured and judged: the step that the search in a window and the search for a
// board share.
#pragma once

#include "measure/ellipse_fit.h"
#include "measure/image.h"
#include "measure/marks.h"

namespace zeropose {

// The mark at the start's outline, or why it is none (the numbers are then of no use). Of the search the
// kind, the limits of size and shape and the least contrast count; the window does not. Precondition: image
// of at least 2 x 2 px.
MarkFinding fit_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                     EllipseWorkspace& workspace);

}  // namespace zeropose
