// Levenberg-Marquardt on the pixels, and the covariance that belongs to it (spec 50 M3). Internal to the
// room: use measure/pose.h.
#pragma once

#include "measure/pose_model.h"

namespace zeropose {

// singular: already at the start the observations leave a direction open.
enum class SolverStatus { failed = 0, converged, no_image, not_converged, singular };

struct Solution {
  SolverStatus status = SolverStatus::failed;
  CentredPose pose;
  NormalEquations equations;
};

// Minimises the cost of the active observations from a start. The model is left linearised at the solution,
// all observations.
Solution refine(PoseModel& model, const CentredPose& start);

// What the normal matrix says about the solution. Deltas as in CentredPose: mm and rad, about M.
struct Precision {
  bool determined = false;  // the normal matrix is regular and the pose better than a guess
  Matrix6 inverse_N = Matrix6::Zero();
  Matrix6 covariance = Matrix6::Zero();        // from the observations' own covariance
  Matrix6 total_covariance = Matrix6::Zero();  // with the system's and the marks' sigma
  double condition = 0;                        // of the normal matrix scaled by the extent, 1-norm
  double weakest_sigma_mm = 0;                 // at the extent, in the weakest direction or a bit more
  Vector6 weakest = Vector6::Zero();           // that direction, mm; only when not determined
};

// Precondition: the model is linearised at the solution.
Precision precision_of(const PoseModel& model, const Solution& solution);

}  // namespace zeropose
