// Where calibrate_views() begins. Internal to calib.
#pragma once

#include <span>

#include "calib/views.h"
#include "calib/views_bundle.h"
#include "calib/views_checks.h"

namespace zeropose::bundle {

struct Start {
  Verdict verdict;
  State state;
};

// The internals and all poses, near enough to refine. Precondition: check_chunks() is ok.
Start start_of(const ViewsProblem& problem, std::span<const Chunk> chunks, const Freedom& freedom);

// A plane seen with little perspective nearly fits a second pose, mirrored about the line of sight. Puts
// every view whose second pose fits better there; true when there was one.
bool turn_mirrored_views(const ViewsProblem& problem, State& state, std::span<const Chunk> chunks,
                         double loss);

// A state without poses, with the internals of the problem's starts where given.
State empty_state(const ViewsProblem& problem);

}  // namespace zeropose::bundle
