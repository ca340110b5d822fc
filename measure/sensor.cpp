#include "measure/sensor.h"

#include "calib/words.h"

namespace zeropose {
namespace {

bool on_hand(const SensorProblem& problem) {
  return !problem.sightings.empty() && problem.sightings.front().X_RH.has_value();
}

std::string name_of_sighting(const SensorProblem& problem, const SensorSighting& sighting) {
  const std::string point = "point " + problem.points[sighting.point].name;
  return sighting.view.empty() ? point : point + " in view " + sighting.view;
}

MeasuredPair pair_of(const SensorProblem& problem, const SensorSighting& sighting,
                     const TriangulatedPoint& place) {
  const KnownPoint& known = problem.points[sighting.point];
  // A sphere of uncertainty is one in every frame.
  return {sighting.X_RH ? sighting.X_RH->inverse() * known.p_mm : known.p_mm, place.p_W_mm,
          known.sigma_mm * known.sigma_mm * Eigen::Matrix3d::Identity(), place.covariance_mm2};
}

// What the operator can do about it.
std::string advice(const SensorProblem& problem, FrameFitStatus status) {
  if (status == FrameFitStatus::too_few_points)
    return on_hand(problem) ? ": let the sensor see the point from more positions of the hand"
                            : ": measure more points";
  if (status != FrameFitStatus::collinear) return {};
  return on_hand(problem)
             ? ": in the hand's frame the point moved along one line only; move the hand in a second "
               "direction as well, or turn it about another axis than the one through them"
             : ": add one beside it";
}

std::string names_of(const SensorProblem& problem, const std::vector<std::size_t>& sightings) {
  std::string text;
  for (const std::size_t i : sightings)
    text += (text.empty() ? "" : ", ") + name_of_sighting(problem, problem.sightings[i]);
  return text;
}

}  // namespace

SensorResult calibrate_sensor(const SensorProblem& problem) {
  SensorResult result;
  std::vector<MeasuredPair> pairs;
  for (const SensorSighting& sighting : problem.sightings) {
    const TriangulatedPoint& place =
        result.places.emplace_back(triangulate({problem.cameras, sighting.observations}));
    if (place.code != Code::ok) {
      result.fit.reason = name_of_sighting(problem, sighting) + ": " + place.reason;
      return result;
    }
    pairs.push_back(pair_of(problem, sighting, place));
  }
  result.fit = fit_frames(pairs);
  if (result.fit.status == FrameFitStatus::contradiction && !result.fit.suspects.empty())
    result.fit.reason = "the points contradict each other by " + number(result.fit.rms_mm, 3) +
                        " mm (root mean square), wrong is one of: " + names_of(problem, result.fit.suspects);
  result.fit.reason += advice(problem, result.fit.status);
  return result;
}

}  // namespace zeropose
