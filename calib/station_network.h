// The stations of a measuring system (laser tracker) that was moved, oriented by the points that they have in
// common (spec 30 A2): all stations and all points at once, in the frame A of one of the stations.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "calib/frame_fit.h"

namespace zeropose {

// A point as one station measured it, with the same noise along every axis.
struct StationObservation {
  std::size_t station = 0, point = 0;  // of the problem's names
  Eigen::Vector3d p_S_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  // of one coordinate; 0: the problem's
};

struct StationNetworkProblem {
  std::vector<std::string> stations, points;
  std::vector<StationObservation> observations;  // a point at most once from each station
  std::size_t reference = 0;                     // the station whose frame is A
  // Of one coordinate of an observation that has no sigma of its own. 0: from the residuals, and then no
  // observation has one.
  double sigma_mm = 0;
};

enum class StationNetworkStatus {
  failed = 0,
  ok,
  wrong_problem,   // numbers that are none, a point twice from one station, fewer than two stations
  not_connected,   // a station without a point in common with the others
  too_few_points,  // fewer than three
  collinear,       // the common points lie on a line
  other_units,     // the common points are much farther apart from one station than from others
  contradiction,   // the points contradict each other and it is open which one is wrong
  not_converged
};
std::string_view name_of(StationNetworkStatus status);

struct StationNetworkPoint {
  bool known = false;  // false: what is left out of it leaves none
  Eigen::Vector3d p_A_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  int stations = 0;  // that it was taken from
};

struct StationNetworkResult {
  StationNetworkStatus status = StationNetworkStatus::failed;
  std::string reason;               // one sentence with the numbers, empty when ok
  std::vector<UncertainPose> X_AS;  // in the order of the stations; the reference's is certain
  std::vector<StationNetworkPoint> points;
  std::vector<Eigen::Vector3d> residuals_A_mm;  // X_AS p_S - p_A, in the order of the observations
  double sigma_mm = 0;  // of one coordinate: as given, or from the residuals; 0: all have their own
  // Root of the mean squared whitened residual by redundancy: 1 where the sigmas are right.
  double residual_ratio = 0;
  double rms_mm = 0;  // root of the mean squared length of the residuals of common points
  int redundancy = 0;
  // Observations that contradict the others, worst first. Where only two stations see the point both are
  // among them: nobody knows which one is wrong, the point has no place.
  std::vector<std::size_t> removed;
  std::vector<std::size_t> suspects;  // contradiction: wrong is one of these
};

// Maximum likelihood. Where sigma_mm comes from the residuals all covariances are widened such that their 95
// % ellipsoids hold (few_data_factor()). Stations that see each other's points only through others are
// chained. An observation that contradicts the others is taken out by the rules of remove_wrong_points().
StationNetworkResult orient_stations(const StationNetworkProblem& problem);

}  // namespace zeropose
