#include "calib/station_network.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "calib/chance.h"
#include "calib/station_equations.h"
#include "calib/station_start.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Finer than any measuring system resolves: numbers that were computed agree better than any noise.
constexpr double least_sigma_mm = 1e-4;
// An observation whose residual varies by less than this share of its own variance is checked by nothing.
constexpr double unchecked_share = 1e-6;

StationNetworkResult failed(StationNetworkStatus status, std::string reason) {
  StationNetworkResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

StationNetworkResult wrong_problem(std::string reason) {
  return failed(StationNetworkStatus::wrong_problem, std::move(reason));
}

std::string words_of(const StationNetworkProblem& problem, const StationObservation& seen) {
  return "point " + problem.points[seen.point] + " of station " + problem.stations[seen.station];
}

// failed: nothing is wrong.
StationNetworkResult fault_of(const StationNetworkProblem& problem) {
  if (problem.stations.size() < 2)
    return wrong_problem(number(problem.stations.size()) + " stations, a network needs 2");
  if (problem.reference >= problem.stations.size()) return wrong_problem("the reference is no station");
  std::set<std::pair<std::size_t, std::size_t>> seen_before;
  std::size_t own = 0;
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const StationObservation& seen = problem.observations[i];
    if (seen.station >= problem.stations.size() || seen.point >= problem.points.size())
      return wrong_problem("observation " + number(i + 1) + " (from 1) has no station or no point");
    if (!seen.p_S_mm.allFinite() || !std::isfinite(seen.sigma_mm) || seen.sigma_mm < 0)
      return wrong_problem(words_of(problem, seen) + " has a number that is none");
    if (!seen_before.emplace(seen.station, seen.point).second)
      return wrong_problem(words_of(problem, seen) + " is there twice");
    own += seen.sigma_mm > 0 ? 1 : 0;
  }
  if (!std::isfinite(problem.sigma_mm) || problem.sigma_mm < 0) return wrong_problem("sigma_mm is none");
  if (problem.sigma_mm == 0 && own > 0 && own < problem.observations.size())
    return wrong_problem(number(own) + " of " + number(problem.observations.size()) +
                         " observations have a sigma of their own, the others none");
  return {};
}

// The fit at work: what is used of the observations, and what was taken out.
struct Search {
  const StationTable& table;
  WrongPointOptions options;  // whitened: sigma 1 where it is known
  std::vector<bool> used;
  PointFit fit;
  bool agree = true;
  std::vector<std::size_t> removed, suspects;

  const StationEquations& at() const { return static_cast<const StationEquations&>(*fit.at); }
};

// Observations that may be wrong: one, or both of a point that two stations see.
struct Doubt {
  std::vector<std::size_t> observations;
  double gain = 0;  // of the cost without them, about
  PointFit fit;     // without them
};

// By how much the cost falls without an observation where the equations are linear; negative: nothing checks
// it. The residual's covariance is the observation's less that of what the estimate says in its place.
double gain_without(const Search& search, const StationMean& mean, std::size_t observation) {
  const StationEquations& at = search.at();
  const double variance = 1 / search.table.weights[observation];
  const Matrix3Xd J = mean.J - at.derivative(observation);
  const Matrix3d Q =
      (variance - 1 / mean.weight) * Matrix3d::Identity() - J * search.fit.inverse_N * J.transpose();
  if (!(symmetric_eigen(Q).values(0) > unchecked_share * variance)) return -1;
  const Vector3d residual = at.seen_A_mm(observation) - mean.p_A_mm;
  return residual.dot(Q.ldlt().solve(residual));
}

// Best first.
std::vector<Doubt> doubts_of(const Search& search) {
  std::vector<Doubt> doubts;
  for (std::size_t point = 0; point < search.table.of_point.size(); ++point) {
    std::vector<std::size_t> used;
    for (const std::size_t observation : search.table.of_point[point])
      if (search.used[observation]) used.push_back(observation);
    if (used.size() < 2) continue;
    const StationMean mean = search.at().mean_of(point);
    if (used.size() == 2) {
      doubts.push_back({used, gain_without(search, mean, used.front()), {}});
      continue;
    }
    for (const std::size_t observation : used)
      doubts.push_back({{observation}, gain_without(search, mean, observation), {}});
  }
  std::erase_if(doubts, [](const Doubt& doubt) { return doubt.gain < 0; });
  std::ranges::stable_sort(doubts, std::ranges::greater(), &Doubt::gain);
  return doubts;
}

std::vector<bool> without(std::vector<bool> used, const Doubt& doubt) {
  for (const std::size_t observation : doubt.observations) used[observation] = false;
  return used;
}

PointFit fit_used(const StationTable& table, const std::vector<Pose>& X_AS, const std::vector<bool>& used) {
  return fit_points(StationEquations(table, X_AS, used), std::vector<bool>(table.of_point.size(), true));
}

// Fits without those that may be the best one, best first.
void refit(const Search& search, std::vector<Doubt>& doubts) {
  const double sigma = sigma_of_fit(search.fit, search.options);
  const double least = 0.5 * doubts.front().gain - undecided_squares * sigma * sigma;
  std::erase_if(doubts, [&](Doubt& doubt) {
    if (doubt.gain < least) return true;
    doubt.fit = fit_used(search.table, search.at().X_AS(), without(search.used, doubt));
    return doubt.fit.status != PointFitStatus::ok || doubt.fit.redundancy < search.options.least_redundancy;
  });
  std::ranges::stable_sort(doubts, {}, [](const Doubt& doubt) { return doubt.fit.cost; });
}

bool by_chance(const Search& search, const Doubt& best, std::size_t looks) {
  PointFit linear;  // where it is chance it is small, and the equations are linear
  linear.cost = std::max(0.0, search.fit.cost - best.gain);
  linear.redundancy = search.fit.redundancy - 3;
  if (linear.redundancy < search.options.least_redundancy) return true;
  return better_by_chance(search.fit, linear, 3, looks, search.options);
}

// As in remove_wrong_points(), for equations in which an observation belongs to its point's others.
void remove_wrong(Search& search) {
  for (;;) {
    search.agree = fits_its_noise(search.fit, search.options);
    if (search.agree && search.table.sigma_known) return;
    std::vector<Doubt> doubts = doubts_of(search);
    const std::size_t looks = doubts.size();
    if (doubts.empty() || by_chance(search, doubts.front(), looks)) return;
    refit(search, doubts);
    if (doubts.empty() || better_by_chance(search.fit, doubts.front().fit, 3, looks, search.options)) return;
    Doubt& best = doubts.front();
    const double sigma = sigma_of_fit(best.fit, search.options);
    for (std::size_t i = 1; i < doubts.size(); ++i)
      if (doubts[i].fit.cost - best.fit.cost < undecided_squares * sigma * sigma)
        std::ranges::copy(doubts[i].observations, std::back_inserter(search.suspects));
    if (!search.suspects.empty()) {
      search.suspects.insert(search.suspects.begin(), best.observations.begin(), best.observations.end());
      search.agree = false;
      return;
    }
    std::ranges::copy(best.observations, std::back_inserter(search.removed));
    search.used = without(search.used, best);
    search.fit = std::move(best.fit);
  }
}

void fill_stations(const Search& search, double variance, StationNetworkResult& result) {
  const StationNetworkProblem& problem = *search.table.problem;
  const double few = search.table.sigma_known ? 1 : few_data_factor(6, result.redundancy);
  Eigen::Index column = 0;
  for (std::size_t station = 0; station < problem.stations.size(); ++station) {
    UncertainPose& pose = result.X_AS.emplace_back(search.at().X_AS()[station], Matrix6::Zero());
    if (station == problem.reference) continue;
    pose.covariance = few * variance * search.fit.inverse_N.block<6, 6>(column, column);
    column += 6;
  }
}

// Of what is left out of a point the residual is that to the others, where there are none to the mean.
void fill_points(const Search& search, double variance, StationNetworkResult& result) {
  const StationEquations& at = search.at();
  const StationEquations all(search.table, at.X_AS(), std::vector<bool>(search.used.size(), true));
  const double few = search.table.sigma_known ? 1 : few_data_factor(3, result.redundancy);
  double sum = 0, count = 0;
  result.residuals_A_mm.resize(search.used.size());
  for (std::size_t i = 0; i < search.table.of_point.size(); ++i) {
    StationMean mean = at.mean_of(i);
    StationNetworkPoint& point = result.points.emplace_back();
    point.stations = mean.stations;
    point.known = mean.stations > 0;
    if (point.known) {
      point.p_A_mm = mean.p_A_mm;
      point.covariance_mm2 =
          few * variance *
          (Matrix3d::Identity() / mean.weight + mean.J * search.fit.inverse_N * mean.J.transpose());
    } else {
      mean = all.mean_of(i);
    }
    for (const std::size_t observation : search.table.of_point[i]) {
      result.residuals_A_mm[observation] = at.seen_A_mm(observation) - mean.p_A_mm;
      if (!search.used[observation] || point.stations < 2) continue;
      sum += result.residuals_A_mm[observation].squaredNorm();
      ++count;
    }
  }
  result.rms_mm = count > 0 ? std::sqrt(sum / count) : 0;
}

std::string contradiction_of(const Search& search, const StationNetworkResult& result) {
  const StationNetworkProblem& problem = *search.table.problem;
  std::string reason =
      "the points contradict each other by " + number(result.rms_mm, 3) + " mm (root mean square)";
  if (search.table.sigma_known) reason += ", " + number(result.residual_ratio, 1) + " times their sigmas";
  std::vector<std::string> names;
  for (const std::size_t suspect : search.suspects)
    names.push_back(words_of(problem, problem.observations[suspect]));
  return reason +
         (names.empty() ? ", and no single one explains it" : ", wrong is one of: " + list_of_names(names));
}

StationNetworkResult result_of(const Search& search) {
  StationNetworkResult result;
  result.status = StationNetworkStatus::ok;
  result.redundancy = search.fit.redundancy;
  result.removed = search.removed;
  result.suspects = search.suspects;
  const double sigma = sigma_of_fit(search.fit, search.options);
  result.residual_ratio = result.redundancy > 0 ? std::sqrt(search.fit.cost / result.redundancy) / sigma : 0;
  result.sigma_mm = search.table.sigma_known ? search.table.problem->sigma_mm : sigma;
  fill_stations(search, sigma * sigma, result);
  fill_points(search, sigma * sigma, result);
  if (search.agree) return result;
  result.status = StationNetworkStatus::contradiction;
  result.reason = contradiction_of(search, result);
  return result;
}

}  // namespace

std::string_view name_of(StationNetworkStatus status) {
  switch (status) {
    case StationNetworkStatus::ok:
      return "ok";
    case StationNetworkStatus::wrong_problem:
      return "wrong_problem";
    case StationNetworkStatus::not_connected:
      return "not_connected";
    case StationNetworkStatus::too_few_points:
      return "too_few_points";
    case StationNetworkStatus::collinear:
      return "collinear";
    case StationNetworkStatus::other_units:
      return "other_units";
    case StationNetworkStatus::contradiction:
      return "contradiction";
    case StationNetworkStatus::not_converged:
      return "not_converged";
    default:
      return "failed";
  }
}

StationNetworkResult orient_stations(const StationNetworkProblem& problem) {
  if (StationNetworkResult fault = fault_of(problem); fault.status != StationNetworkStatus::failed)
    return fault;
  StationStart start = join_stations(problem);
  if (start.status != StationNetworkStatus::ok) return failed(start.status, std::move(start.reason));
  const StationTable table(problem);
  Search search{table, {}, std::vector<bool>(problem.observations.size(), true), {}, true, {}, {}};
  search.options.sigma_px = table.sigma_known ? 1 : 0;
  search.options.least_sigma_px = least_sigma_mm;
  search.fit = fit_used(table, start.X_AS, search.used);
  if (search.fit.status != PointFitStatus::ok)
    return failed(StationNetworkStatus::not_converged,
                  "no poses explain the " + number(problem.observations.size()) + " observations");
  remove_wrong(search);
  return result_of(search);
}

}  // namespace zeropose
