// Compensation (relaxation): marks are shifted to where the zero measurement sees them, so that errors of
// model, drawing and calibration cancel in everything relative to zero (spec 50 M5).
#pragma once

#include <span>
#include <vector>

#include "measure/pose.h"

namespace zeropose {

struct CompensationProblem {
  std::span<const CalibratedCamera> cameras;
  std::span<const Mark> marks;
  std::span<const Observation> observations;  // averaged over the frames of the zero measurement
  Pose X_WO0 = Pose::Identity();              // held
  double alpha = 0.5;  // share of the way from the projected to the found pixel per round, 0 < alpha <= 1
  int max_rounds = 100;
};

struct CompensationResult {
  Code code = Code::internal;
  std::string reason;
  std::vector<Eigen::Vector3d> shifts_O_mm;  // one per mark; zero where nothing was observed
  int rounds = 0;
  double largest_deviation_px = 0;  // that is left; above 1e-4 px only where cameras contradict each other
};

// In each round each mark moves in its camera's plane of constant depth so that its image goes the share
// alpha of the way to the found pixel; a mark that several cameras see moves once, by the least squares of
// all of them, weighted with the observations' covariance. Ends when the largest deviation is below 1e-4 px
// or the shifts settle. The pose stays the zero pose: what remains is orthogonal to every motion of the
// object. Codes: marks_invalid (indices, alpha), not_converged (a mark has no image, or max_rounds).
CompensationResult compensate(const CompensationProblem& problem);

}  // namespace zeropose
