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
  Eigen::MatrixXd stage;                   // along its directions; empty where there is none
  double condition = 0;  // of the equations that remain for internals and cameras, unit diagonal
  int unknowns = 0;
};

struct UncertaintyAnswer {
  std::optional<Uncertainty> found;  // none: the equations are singular, `weak` says in which unknowns
  std::string weak;
};
// Of one pixel coordinate: as given, or from what remains.
struct Scatter {
  double sigma_px = 0;
  int redundancy = 0;  // equations more than unknowns
};
Scatter scatter_of(const ViewsProblem& problem, std::span<const Chunk> chunks, double residual_sum,
                   const UncertaintyAnswer& answer);
// No camera finds points better: what is not determined is so even if the residuals are (nearly) zero.
inline constexpr double least_sigma_px = 0.05;

UncertaintyAnswer uncertainty_of(const ViewsProblem& problem, const State& state,
                                 std::span<const Chunk> chunks, const Freedom& freedom, double loss);

}  // namespace zeropose::bundle
