// From the pictures of the cameras on a hand to the motion that evens the gaps round a pane, pure (spec 70,
// pane-gaps).
#pragma once

#include <vector>

#include "measure/gap.h"
#include "measure/gap_evening.h"

namespace zeropose {

struct MeasurementProblem;
struct Measurement;

// What a measurement of gaps found beside its code.
struct GapMeasurement {
  std::vector<GapResult> gaps;        // one per gap of the task
  EveningResult evening;              // of the measured ones; internal: it did not come to that
  std::vector<std::size_t> measured;  // the task's index of each gap of the evening
  std::vector<std::size_t> used;      // of the task: measured, not removed, with a weight
};

// Needs no zero measurement. When the code is ok, X_O0O is the motion X_TTn of the pane in its own frame, and
// identity where the gaps are even within the tolerance. largest_deviation_mm is how uneven the gaps are,
// sigma_mm that of the motion at the worst gap, pose.effective_marks and pose.effective_cameras count what
// was used.
//
// Codes: marks_invalid (a gap of a camera that is none, or numbers that make no sense), camera_missing,
// frame_wrong_size; too_few_marks (gaps), or image_saturated, image_blurred where those that the picture
// spoils would be enough, each with the reason of every gap; those of even_gaps();
// hidden_error_too_large (a gap that no other checks, though more are asked for than 4, or 3); gaps_not_even
// (the shapes do not allow the tolerance), sigma_too_large.
Measurement measure_gaps(const MeasurementProblem& problem);

}  // namespace zeropose
