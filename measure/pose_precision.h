// What the normal matrix says about a pose, and each observation's deviation by its standard deviation (spec
// 50 M3, M6.3). Internal to the room: use measure/pose.h.
#pragma once

#include "measure/pose_solver.h"

namespace zeropose {

// Deltas as in CentredPose, about M; the rotation in mm at the extent of the marks.
struct Precision {
  bool determined = false;  // the normal matrix is regular and the pose better than a guess
  Matrix6 inverse_N = Matrix6::Zero();
  Matrix6 covariance = Matrix6::Zero();        // from the observations' own covariance
  Matrix6 total_covariance = Matrix6::Zero();  // with the system's and the marks' sigma
  double condition = 0;                        // of the normal matrix, 1-norm
  double weakest_sigma_mm = 0;                 // in the weakest direction or a bit more
};

// Precondition: the model is linearised at the solution.
Precision precision_of(PoseModel& model, const Solution& solution);

// The direction the observations say least about, mm.
Vector6 weakest_direction(const PoseModel& model, const Matrix6& N);

// Fills in the deviations of all observations by their standard deviation. The sum of squared residuals of
// the active ones by their total covariance.
double normalise(PoseModel& model, const Precision& precision);

}  // namespace zeropose
