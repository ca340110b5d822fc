// What a wrong mark could do without being noticed: the power of the test for wrong marks (spec 50 M6.3; W.
// Baarda, "A testing procedure for use in geodetic networks", 1968).
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "measure/pose.h"

namespace zeropose {

// The normalised deviation (a length, two degrees of freedom) above which one of so many observations is
// wrong: good ones alone reach it in 0.1 % of the estimates.
inline double critical_deviation(std::size_t observations) {
  constexpr double false_alarm = 0.001;
  return std::sqrt(-2 * std::log(false_alarm / static_cast<double>(observations)));
}

// One observation of a pose problem if it alone were wrong.
struct ObservationReliability {
  std::size_t observation = 0;  // index into the problem's
  double redundancy = 0;        // share of its own error that its deviation shows, 0..1, mean of u and v
  double detectable_px = 0;  // the smallest error that is sure to be found, in the direction that hides best
  double hidden_mm = 0;      // the largest error at an application point by an error that is not found
  std::size_t worst_point = 0;  // where
};

// A mark that several cameras see if it sat in the wrong place.
struct MarkReliability {
  std::size_t mark = 0;  // index into the problem's
  double detectable_mm =
      0;  // the smallest misplacement that is sure to be found, in the direction that hides best
  double hidden_mm = 0;  // as above
  std::size_t worst_point = 0;
};

struct Reliability {
  std::vector<ObservationReliability> observations;  // those that were used, in the order of the problem
  std::vector<MarkReliability> marks;                // those with several of them
  double hidden_mm = 0;                              // the largest of all
  bool worst_is_mark = false;                        // whose it is: index into `marks` or `observations`
  std::size_t worst = 0;
};

// For the observations that took part in an estimate, at the estimated pose, with their total covariance
// (own, the system's, the marks' sigma_mm) and the users' weights. Sure means: found with at least 99 % while
// good observations raise a false alarm in 0.1 % of the estimates; a deviation of that non-centrality is
// (critical value + 2.326)^2, since the length of a normal vector is never shorter than its share along its
// mean. A mark in the wrong place shows in all of its m observations: while the sum of their non-centralities
// is below m times that one, none of them may be beyond it. Infinite where the others do not check an
// observation or a mark at all.
//   problem  as it was given to estimate_pose(); deviations are reckoned in px whatever its residual
//   pose     its result, code ok; otherwise there is no observation in what comes back
//   points   where the error counts, mm in O; none: the marks that were used
Reliability reliability_of(const PoseProblem& problem, const PoseResult& pose,
                           std::span<const Eigen::Vector3d> points_O_mm);

}  // namespace zeropose
