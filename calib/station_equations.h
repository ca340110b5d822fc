// The least squares of a network of stations: the poses are the unknowns, each point's place the weighted
// mean of what its stations say.
#pragma once

#include <vector>

#include "calib/point_fit.h"
#include "calib/station_network.h"

namespace zeropose {

// A problem sorted by points. The problem must outlive it.
struct StationTable {
  explicit StationTable(const StationNetworkProblem& problem);

  const StationNetworkProblem* problem;
  std::vector<std::vector<std::size_t>> of_point;  // observations
  std::vector<double> weights;  // 1 / sigma^2 of each observation; 1 where sigma comes from the residuals
  bool sigma_known = false;
};

// The place of a point and how it follows the delta of the unknowns.
struct StationMean {
  Eigen::Vector3d p_A_mm = Eigen::Vector3d::Zero();
  double weight = 0;
  int stations = 0;
  Eigen::Matrix3Xd J;  // 3 x unknowns
};

// Unknowns: the deltas in moved() of X_AS, station by station without the reference. Equations: each
// observation against the mean of those before it, which are independent of each other.
class StationEquations : public PointEquations {
 public:
  StationEquations(const StationTable& table, std::vector<Pose> X_AS, std::vector<bool> used);

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<StationEquations>(*this); }
  Eigen::Index unknowns() const override { return 6 * (Eigen::Index(X_AS_.size()) - 1); }
  std::size_t points() const override { return table_->of_point.size(); }
  Eigen::Index rows_per_point() const override { return 3; }  // that an observation checks
  bool linearise(std::size_t point, PointRows& rows) const override;
  void move(const Eigen::VectorXd& delta) override;

  const std::vector<Pose>& X_AS() const { return X_AS_; }
  Eigen::Vector3d seen_A_mm(std::size_t observation) const;
  // How it follows the delta of the unknowns, 3 x unknowns.
  Eigen::Matrix3Xd derivative(std::size_t observation) const;
  StationMean mean_of(std::size_t point) const;

 private:
  Eigen::Index column_of(std::size_t station) const;
  void add(std::size_t observation, StationMean& mean) const;

  const StationTable* table_;
  std::vector<Pose> X_AS_;
  std::vector<bool> used_;  // of the observations
};

}  // namespace zeropose
