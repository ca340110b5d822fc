// How sure calibrate_views() is. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/views.h"
#include "calib/views_bundle.h"

namespace zeropose::bundle {

// The inverse of the normal equations: covariances for a pixel sigma of one.
struct Uncertainty {
  std::vector<Eigen::MatrixXd> internals;  // of each camera's free ones
  std::vector<Matrix6> cameras, views;     // zero where held
  double condition = 0;  // of the equations that remain for internals and cameras, unit diagonal
  int unknowns = 0;
};

struct UncertaintyAnswer {
  std::optional<Uncertainty> found;  // none: the equations are singular, `weak` says in which unknowns
  std::string weak;
};
UncertaintyAnswer uncertainty_of(const ViewsProblem& problem, const State& state,
                                 std::span<const Chunk> chunks, const Freedom& freedom, double loss);

}  // namespace zeropose::bundle
