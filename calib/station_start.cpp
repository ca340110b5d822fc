#include "calib/station_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

// Every distance so many times as long is no error of measurement.
constexpr double other_unit = 5;
constexpr std::size_t most_names = 8;

// Stations with known poses between them, in the frame G of the first.
struct Group {
  std::vector<std::pair<std::size_t, Pose>> stations;  // X_GS
  std::map<std::size_t, Vector3d> places_G;
};

std::vector<std::size_t> common_points(const Group& a, const Group& b) {
  std::vector<std::size_t> common;
  for (const auto& [point, place] : a.places_G)
    if (b.places_G.contains(point)) common.push_back(point);
  return common;
}

std::string words_of(const StationNetworkProblem& problem, const Group& group) {
  std::vector<std::string> names;
  for (const auto& [station, X_GS] : group.stations) names.push_back(problem.stations[station]);
  return (names.size() == 1 ? "station " : "stations ") + list_of_names(names);
}

// The ratio of a's distances between the points to b's that is nearest to 1.
double ratio_of(const Group& a, const Group& b, const std::vector<std::size_t>& points) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double in_a = (a.places_G.at(points[i]) - a.places_G.at(points[k])).norm();
      const double in_b = (b.places_G.at(points[i]) - b.places_G.at(points[k])).norm();
      if (in_a > 0 && in_b > 0 && std::abs(std::log(in_a / in_b)) < std::abs(std::log(nearest)))
        nearest = in_a / in_b;
    }
  return std::isfinite(nearest) ? nearest : 1;
}

struct Joint {
  StationNetworkStatus status = StationNetworkStatus::failed;
  std::string reason;
  Pose X_ab = Pose::Identity();
};

// The pose of b's frame in a's. A contradiction is left to the estimate of all.
Joint joint_of(const StationNetworkProblem& problem, const Group& a, const Group& b) {
  const std::vector<std::size_t> points = common_points(a, b);
  const double ratio = ratio_of(a, b, points);
  if (ratio > other_unit || ratio < 1 / other_unit)
    return {StationNetworkStatus::other_units,
            "the distances between the common points are " + number(ratio, 3) + " times as long from " +
                words_of(problem, a) + " as from " + words_of(problem, b) + ": not the same unit"};
  const double sigma_mm = problem.sigma_mm > 0 ? problem.sigma_mm : 1;
  const Eigen::Matrix3d covariance = sigma_mm * sigma_mm * Eigen::Matrix3d::Identity();
  std::vector<MeasuredPair> pairs;
  for (const std::size_t point : points)
    pairs.push_back({a.places_G.at(point), b.places_G.at(point), covariance, covariance});
  const FrameFitResult fit = fit_frames(pairs);
  if (fit.status == FrameFitStatus::ok || fit.status == FrameFitStatus::contradiction)
    return {StationNetworkStatus::ok, "", fit.X_AB};
  return {fit.status == FrameFitStatus::collinear ? StationNetworkStatus::collinear
                                                  : StationNetworkStatus::not_converged,
          words_of(problem, b) + " and " + words_of(problem, a) + ", points in common: " + fit.reason};
}

void join(Group& a, const Group& b, const Pose& X_ab) {
  for (const auto& [station, X_bS] : b.stations) a.stations.emplace_back(station, X_ab * X_bS);
  for (const auto& [point, place] : b.places_G) a.places_G.try_emplace(point, X_ab * place);
}

struct Pair {
  std::size_t a = 0, b = 0, common = 0;
};

// Of all groups, a before b, most common points first.
std::vector<Pair> pairs_of(const std::vector<Group>& groups) {
  std::vector<Pair> pairs;
  for (std::size_t b = 0; b < groups.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) pairs.push_back({a, b, common_points(groups[a], groups[b]).size()});
  std::ranges::stable_sort(pairs, std::ranges::greater(), &Pair::common);
  return pairs;
}

// Why the groups that are left cannot be joined: of the smallest one, with the one that has most in common.
StationStart why_not(const StationNetworkProblem& problem, const std::vector<Group>& groups) {
  const auto is_smaller = [](const Group& a, const Group& b) {
    return a.stations.size() < b.stations.size();
  };
  // The reference is in the first group, whose fault it is last.
  const std::size_t alone =
      std::size_t(std::min_element(groups.begin() + 1, groups.end(), is_smaller) - groups.begin());
  std::size_t other = 0;
  std::vector<std::size_t> most;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    std::vector<std::size_t> common;
    if (i != alone) common = common_points(groups[i], groups[alone]);
    if (common.size() > most.size()) other = i, most = std::move(common);
  }
  const std::string who = words_of(problem, groups[alone]);
  if (most.empty())
    return {StationNetworkStatus::not_connected, who + ": no point in common with the other stations", {}};
  if (most.size() < 3) {
    std::vector<std::string> names;
    for (const std::size_t point : most) names.push_back(problem.points[point]);
    return {StationNetworkStatus::too_few_points,
            who + ": " + number(most.size()) + " of 3 points (" + list_of_names(names) + ") in common with " +
                words_of(problem, groups[other]),
            {}};
  }
  const Joint joint = joint_of(problem, groups[other], groups[alone]);
  if (joint.status == StationNetworkStatus::ok)
    return {StationNetworkStatus::not_converged, who + ": its points join the others only one way round", {}};
  return {joint.status, joint.reason, {}};
}

std::vector<Group> single_stations(const StationNetworkProblem& problem) {
  std::vector<Group> groups(problem.stations.size());
  for (std::size_t station = 0; station < groups.size(); ++station)
    groups[station].stations.emplace_back(station, Pose::Identity());
  for (const StationObservation& seen : problem.observations)
    groups[seen.station].places_G.emplace(seen.point, seen.p_S_mm);
  std::swap(groups[0], groups[problem.reference]);
  return groups;
}

StationStart in_frame_of_first(const Group& all) {
  StationStart start;
  start.status = StationNetworkStatus::ok;
  start.X_AS.resize(all.stations.size());
  for (const auto& [station, X_AS] : all.stations) start.X_AS[station] = X_AS;
  return start;
}

}  // namespace

std::string list_of_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), most_names); ++i)
    text += (i == 0 ? "" : ", ") + names[i];
  return names.size() > most_names ? text + " and " + number(names.size() - most_names) + " more" : text;
}

StationStart join_stations(const StationNetworkProblem& problem) {
  std::vector<Group> groups = single_stations(problem);
  while (groups.size() > 1) {
    bool joined = false;
    for (const Pair& pair : pairs_of(groups)) {
      if (pair.common < 3 || joined) break;
      const Joint joint = joint_of(problem, groups[pair.a], groups[pair.b]);
      if (joint.status == StationNetworkStatus::other_units) return {joint.status, joint.reason, {}};
      if (joint.status != StationNetworkStatus::ok) continue;
      join(groups[pair.a], groups[pair.b], joint.X_ab);
      groups.erase(groups.begin() + std::ptrdiff_t(pair.b));
      joined = true;
    }
    if (!joined) return why_not(problem, groups);
  }
  return in_frame_of_first(groups.front());
}

}  // namespace zeropose
