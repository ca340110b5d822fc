#include "measure/teaching.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/words.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double false_alarm = 0.001;

// A mark at one position, carried into O.
struct Place {
  std::size_t position;
  Vector3d p_O_mm;
  Matrix3d covariance_mm2;
};

struct Places {
  std::string mark;
  std::vector<Place> places;
};

bool valid(const Matrix3d& covariance) {
  return covariance.allFinite() && SmallCholesky<3>(covariance).ok() &&
         (covariance - covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * covariance.trace();
}

// What is wrong with the numbers of the problem, or nothing.
std::string fault_of(const TeachingProblem& problem) {
  if (problem.sensed.empty()) return "no mark was measured";
  if (!std::isfinite(problem.position_sigma_mm) || problem.position_sigma_mm < 0)
    return "the positions' sigma is not a number >= 0";
  if (problem.X_WO && !problem.X_WO->matrix().allFinite()) return "the object's frame is not finite";
  for (const Pose& X_WS : problem.X_WS)
    if (!X_WS.matrix().allFinite()) return "a position of the sensor is not finite";
  for (const SensedMark& sensed : problem.sensed) {
    if (sensed.position >= problem.X_WS.size())
      return "mark " + sensed.mark + " names a position that does not exist";
    if (!sensed.p_S_mm.allFinite()) return "mark " + sensed.mark + " has a place that is not finite";
    if (!valid(sensed.covariance_mm2))
      return "mark " + sensed.mark + " has a covariance that is not positive definite";
  }
  return {};
}

std::vector<Places> carried_into_object(const TeachingProblem& problem, const Pose& X_WO) {
  std::vector<Places> marks;
  const double variance_mm2 = problem.position_sigma_mm * problem.position_sigma_mm;
  for (const SensedMark& sensed : problem.sensed) {
    auto found = std::find_if(marks.begin(), marks.end(),
                              [&sensed](const Places& places) { return places.mark == sensed.mark; });
    if (found == marks.end()) found = marks.insert(marks.end(), {sensed.mark, {}});
    const Pose X_OS = X_WO.inverse() * problem.X_WS[sensed.position];
    found->places.push_back({sensed.position, X_OS * sensed.p_S_mm,
                             X_OS.linear() * sensed.covariance_mm2 * X_OS.linear().transpose() +
                                 variance_mm2 * Matrix3d::Identity()});
  }
  return marks;
}

// Of the mark that is given twice at one position, or nothing.
std::string name_of_double(const std::vector<Places>& marks) {
  for (const Places& mark : marks)
    for (auto place = mark.places.begin(); place != mark.places.end(); ++place)
      if (std::any_of(mark.places.begin(), place,
                      [&](const Place& earlier) { return earlier.position == place->position; }))
        return mark.mark;
  return {};
}

struct Averaged {
  TaughtMark taught;
  double misfit = 0;  // sum of squared deviations in sigmas
};

Averaged average_of(const Places& mark) {
  Matrix3d N = Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  const Vector3d middle = mark.places.front().p_O_mm;
  for (const Place& place : mark.places) {
    const Matrix3d information = SmallCholesky<3>(place.covariance_mm2).inverse();
    N += information;
    g += information * (place.p_O_mm - middle);
  }
  Averaged averaged;
  averaged.taught.mark = mark.mark;
  averaged.taught.positions = static_cast<int>(mark.places.size());
  averaged.taught.covariance_mm2 = SmallCholesky<3>(N).inverse();
  averaged.taught.p_O_mm = middle + averaged.taught.covariance_mm2 * g;
  for (const Place& place : mark.places) {
    const Vector3d deviation = place.p_O_mm - averaged.taught.p_O_mm;
    averaged.misfit += deviation.dot(SmallCholesky<3>(place.covariance_mm2).solve(deviation));
    averaged.taught.spread_mm = std::max(averaged.taught.spread_mm, deviation.norm());
  }
  return averaged;
}

// Two places of a mark, how far they are apart and the sigma of that distance.
struct Contradiction {
  std::size_t a = 0, b = 0;
  double distance_mm = 0, sigma_mm = 1;
  double sigmas() const { return distance_mm / sigma_mm; }
};

Contradiction worst_pair(const Places& mark) {
  Contradiction worst;
  for (const Place& a : mark.places)
    for (const Place& b : mark.places) {
      const Vector3d apart = b.p_O_mm - a.p_O_mm;
      if (!(a.position < b.position) || !(apart.norm() > 0)) continue;
      const double variance =
          apart.normalized().dot((a.covariance_mm2 + b.covariance_mm2) * apart.normalized());
      const Contradiction pair{a.position, b.position, apart.norm(), std::sqrt(variance)};
      if (pair.sigmas() > worst.sigmas()) worst = pair;
    }
  return worst;
}

std::string words_of(const Places& mark) {
  const Contradiction pair = worst_pair(mark);
  return "mark " + mark.mark + " was seen " + number(pair.distance_mm) + " mm apart from positions " +
         number(pair.a + 1) + " and " + number(pair.b + 1) + " (from 1), with a sigma of " +
         number(pair.sigma_mm) + " mm";
}

TeachingResult failed(Code code, std::string reason) {
  TeachingResult result;
  result.code = code;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

TeachingResult teach(const TeachingProblem& problem) {
  if (std::string fault = fault_of(problem); !fault.empty())
    return failed(Code::marks_invalid, std::move(fault));
  TeachingResult result;
  result.X_WO = problem.X_WO.value_or(problem.X_WS.front());
  const std::vector<Places> marks = carried_into_object(problem, result.X_WO);
  if (const std::string name = name_of_double(marks); !name.empty())
    return failed(Code::marks_invalid, "mark " + name + " is given twice at one position");
  result.code = Code::ok;
  double least_chance = false_alarm;
  for (const Places& mark : marks) {
    Averaged averaged = average_of(mark);
    result.marks.push_back(std::move(averaged.taught));
    if (mark.places.size() < 2) continue;
    const double chance = chi_square_tail(averaged.misfit, 3 * (static_cast<int>(mark.places.size()) - 1));
    // Chances too small for a number are all the same: then the last one is as good a name as any.
    if (chance > least_chance) continue;
    least_chance = chance;
    result.code = Code::deviation_not_attributable;
    result.reason = words_of(mark);
  }
  return result;
}

}  // namespace zeropose
