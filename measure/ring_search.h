// Rings: one or more concentric circles round an optional disc, each outline measured by itself.
#pragma once

#include "measure/disc_search.h"

namespace zeropose {

// Looks for the innermost disc and measures the circles round it: all must be there, of alternating contrast,
// about one centre and of the shares' sizes within a tenth. The place is the mean of the circles' centres by
// their covariances; since a tilted circle's centre moves with the square of its radius, it is the centre of
// the circle radius_share. The numbers and the shape are those of the outer circle. Precondition: as
// look_for_discs(), and inner_shares descend within 0..1.
MarkSight look_for_rings(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                         MarkWorkspace& workspace);

}  // namespace zeropose
