// From the refined state to the result of calibrate_views(). Internal to calib.
#pragma once

#include <span>

#include "calib/views.h"
#include "calib/views_bundle.h"
#include "calib/views_checks.h"

namespace zeropose::bundle {

// Found pixel minus prediction (with the eccentricity of a disc); nullopt: no image.
std::optional<CalibrationDeviation> deviation_of(const State& state, const ViewPoint& seen);

// The result with its covariances and warnings, or the name of what the input does not determine.
ViewsResult report_of(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                      const Freedom& freedom);

}  // namespace zeropose::bundle
