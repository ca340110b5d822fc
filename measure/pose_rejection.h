// Wrong marks: found by their deviation, removed if it is clear which (spec 50 M6.3). Internal to the room:
// use measure/pose.h.
#pragma once

#include <string>
#include <vector>

#include "measure/pose_precision.h"

namespace zeropose {

// A pose with all that decides whether its observations agree.
struct Estimate {
  Solution solution;
  Precision precision;
  double misfit = 0;  // sum of squared residuals by their total covariance, active observations

  bool ok() const { return solution.status == SolverStatus::converged && precision.determined; }
};

// Estimates from a start and leaves the model linearised there, the deviations normalised.
Estimate estimate(PoseModel& model, const CentredPose& start);

// Two explanations whose misfit differs by less are equally good: a likelihood ratio of 1000.
inline constexpr double equal_misfit = 13.815510557964274;

struct Rejection {
  Code code = Code::internal;
  std::string reason;
  std::vector<std::size_t> removed;  // observations, worst first
  bool explained = false;            // without some all others agree, even if it is not clear without which
};

// Precondition: `current` is ok() and the model is linearised there. Observations that are removed are
// inactive afterwards, and `current` is the estimate of what is left, the model linearised there.
Rejection reject_wrong_marks(PoseModel& model, Estimate& current);

}  // namespace zeropose
