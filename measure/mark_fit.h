// One candidate for a mark measured and judged: the step that the search in a window and the search for a
// board share.
#pragma once

#include <limits>

#include "measure/ellipse_fit.h"
#include "measure/image.h"
#include "measure/marks.h"

namespace zeropose {

// What the pixels may differ from the model and still count as explained.
struct FitTolerance {
  // Of the contrast, rms across the outline. Plain optics leave 0.04; sharpening in the camera and
  // compression go beyond, on both sides of a disc alike, so that its centre stays.
  double model_share = 0.1;
  // Grey levels: what the image's own noise may be at most, wherever the flat surroundings show more than
  // that.
  double noise_grey = std::numeric_limits<double>::infinity();
};

// The mark at the start's outline, or why it is none (the numbers are then of no use). Of the search the
// kind, the limits of size and shape and the least contrast count; the window does not. Precondition: image
// of at least 2 x 2 px.
MarkFinding fit_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                     EllipseWorkspace& workspace, const FitTolerance& tolerance = {});

// The same where the outline is spoilt in places: at least 0.6 of it must agree on one ellipse, the rest lie
// in at most four stretches; half of it and eight where the contrast is above twenty times the noise.
MarkFinding fit_covered_mark(const ImageView& image, const MarkSearch& search, const EllipseStart& start,
                             EllipseWorkspace& workspace, const FitTolerance& tolerance = {});

}  // namespace zeropose
