// Whether a stage moves the board in the board's own axes. Internal to calib.
#pragma once

#include <span>
#include <string>

#include "calib/views.h"
#include "calib/views_bundle.h"
#include "calib/views_uncertainty.h"

namespace zeropose::bundle {

// Why the points do not tell the axes of freedom.stage, and what would help; empty: they do, or more than the
// stage is not determined.
std::string unknown_axes(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                         const Freedom& freedom, const UncertaintyAnswer& answer);

// From an estimate with freedom.stage. Precondition: no unknown_axes().
StageEstimate stage_estimate(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                             const Freedom& freedom, const Uncertainty& uncertainty);

// The same where known poses are held: what the estimate would be if they were not. Adds to the result, which
// has its cameras; `redundancy` is its equations more than its unknowns.
void check_stage(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                 const Freedom& freedom, int redundancy, ViewsResult& result);

void warn_of_stage(ViewsResult& result);

}  // namespace zeropose::bundle
