// What is left of the misfit when observations are left out: in closed form, from the linear model at one
// pose (spec 50 M6.3). Internal to the room: use measure/pose.h.
#pragma once

#include <cstddef>
#include <vector>

#include "measure/pose_model.h"

namespace zeropose {

struct Deletion {
  std::vector<std::size_t> set;  // observations left out, ascending
  double misfit = 0;             // of the others
};

// More observations than this are not looked at set by set.
inline constexpr std::size_t max_deletion_size = 64;

// The fit of the active observations by their total covariance, at the last linearisation of a model.
// Preconditions: covariances refreshed unless plain; at most max_deletion_size active observations, which
// determine the pose.
class LinearFit {
 public:
  explicit LinearFit(const PoseModel& model);

  // Every set of k whose deletion leaves a misfit of at most `highest`, best first. Sets without which the
  // pose is open are left out.
  std::vector<Deletion> sets(std::size_t k, double highest) const;

  // What one set leaves; infinite where the pose is open without it.
  double misfit_without(const std::vector<std::size_t>& set) const;

  // Where the fit goes without a set, as moved() takes it.
  Vector6 step_without(const std::vector<std::size_t>& set) const;

  // How much the root of a misfit may be wrong because projection is not linear: twice the square of the
  // largest deviation over the focal length.
  double doubt() const { return doubt_; }

 private:
  struct Sums {
    Matrix6 N;
    Vector6 g;
    double squares;
  };
  Sums without(const std::vector<std::size_t>& set) const;

  std::vector<std::size_t> observations_;
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> J_;  // two rows for each
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> Y_;  // J L^-T with L L' = N: N^-1's half
  Eigen::VectorXd r_, fitted_;                                   // before and after the fit
  bool determined_ = false;
  Matrix6 basis_;  // of the unknowns
  Matrix6 N_ = Matrix6::Zero();
  Vector6 g_ = Vector6::Zero();
  double extent_mm_ = 1, doubt_ = 0;
};

// The sets that have one member of `removed` (inactive, ascending) put back and an active observation out
// instead, as far as the linear model at the last linearisation lets their misfit be at most `highest`.
std::vector<Deletion> exchanges(const PoseModel& model, const std::vector<std::size_t>& removed,
                                double highest);

}  // namespace zeropose
