// The fit of an ellipse whose outline is spoilt in places: covered, in a glint, dirty, or blurred by motion.
#pragma once

#include "measure/ellipse_fit.h"

namespace zeropose {

struct CoveredFit {
  EllipseFit fit;             // not converged: no ellipse that the rest of the outline agrees on
  OutlineSectors hidden = 0;  // sectors that were left out
  double outline_share = 0;   // that was used
  int gaps = 0;               // stretches of hidden sectors
  double noise_grey = 0;      // rms of the residuals in the sectors used, the quiet half of them
  double waves_px = 0;        // largest of the outline's waves (3 to 8 round it) beyond three sigma
};

// Fits, looks at each sector of the outline (its residuals may be noise and model_share of the contrast, and
// the outline must be where the ellipse is), leaves out those that do not agree with the rest together with
// their neighbours, and takes back those that do; until nothing changes. The start's hidden sectors are the
// first guess.
CoveredFit fit_covered_ellipse(const ImageView& image, const EllipseStart& start, double model_share,
                               EllipseWorkspace& workspace);

}  // namespace zeropose
