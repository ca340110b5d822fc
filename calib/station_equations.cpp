#include "calib/station_equations.h"

#include <cmath>
#include <utility>

namespace zeropose {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

StationTable::StationTable(const StationNetworkProblem& network) : problem(&network) {
  of_point.resize(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const StationObservation& seen = network.observations[i];
    const double sigma_mm = seen.sigma_mm > 0 ? seen.sigma_mm : network.sigma_mm;
    sigma_known = sigma_mm > 0;
    weights.push_back(sigma_known ? 1 / (sigma_mm * sigma_mm) : 1);
    of_point[seen.point].push_back(i);
  }
}

StationEquations::StationEquations(const StationTable& table, std::vector<Pose> X_AS, std::vector<bool> used)
    : table_(&table), X_AS_(std::move(X_AS)), used_(std::move(used)) {}

Eigen::Index StationEquations::column_of(std::size_t station) const {
  return 6 * (Eigen::Index(station) - (station > table_->problem->reference ? 1 : 0));
}

Vector3d StationEquations::seen_A_mm(std::size_t observation) const {
  const StationObservation& seen = table_->problem->observations[observation];
  return X_AS_[seen.station] * seen.p_S_mm;
}

Matrix3Xd StationEquations::derivative(std::size_t observation) const {
  const StationObservation& seen = table_->problem->observations[observation];
  Matrix3Xd J = Matrix3Xd::Zero(3, unknowns());
  if (seen.station != table_->problem->reference)
    J.middleCols<6>(column_of(seen.station)) << Eigen::Matrix3d::Identity(),
        -cross_matrix(X_AS_[seen.station].linear() * seen.p_S_mm);
  return J;
}

void StationEquations::add(std::size_t observation, StationMean& mean) const {
  const double weight = table_->weights[observation];
  mean.weight += weight;
  mean.p_A_mm += weight / mean.weight * (seen_A_mm(observation) - mean.p_A_mm);
  mean.J += weight / mean.weight * (derivative(observation) - mean.J);
  ++mean.stations;
}

StationMean StationEquations::mean_of(std::size_t point) const {
  StationMean mean;
  mean.J = Matrix3Xd::Zero(3, unknowns());
  for (const std::size_t observation : table_->of_point[point])
    if (used_[observation]) add(observation, mean);
  return mean;
}

bool StationEquations::linearise(std::size_t point, PointRows& rows) const {
  const auto& observations = table_->of_point[point];
  rows.r.resize(3 * Eigen::Index(observations.size()));
  rows.J.resize(rows.r.size(), unknowns());
  StationMean before;
  before.J = Matrix3Xd::Zero(3, unknowns());
  Eigen::Index row = 0;
  for (const std::size_t observation : observations) {
    if (!used_[observation]) continue;
    if (before.stations > 0) {
      const double weight = table_->weights[observation];
      const double root = std::sqrt(weight * before.weight / (weight + before.weight));
      rows.r.segment<3>(row) = root * (before.p_A_mm - seen_A_mm(observation));
      rows.J.middleRows<3>(row) = root * (derivative(observation) - before.J);
      row += 3;
    }
    add(observation, before);
  }
  rows.r.conservativeResize(row);
  rows.J.conservativeResize(row, Eigen::NoChange);
  return rows.r.allFinite();
}

void StationEquations::move(const Eigen::VectorXd& delta) {
  for (std::size_t station = 0; station < X_AS_.size(); ++station)
    if (station != table_->problem->reference)
      X_AS_[station] = moved(X_AS_[station], delta.segment<6>(column_of(station)));
}

}  // namespace zeropose
