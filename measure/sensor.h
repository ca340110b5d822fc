// Where a stereo sensor stands, or sits on a robot's hand: from known points that it measures (spec 40,
// stereo sensor).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/frame_fit.h"
#include "measure/triangulation.h"

namespace zeropose {

// A point of known place. Stationary: in the world. On the hand: in the robot's base R.
struct KnownPoint {
  std::string name;
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0.02;  // of one coordinate; on the hand with what the robot adds; > 0
};

// The pixels of one point at one position of the sensor.
struct SensorSighting {
  std::size_t point = 0;
  std::string view;          // its position's name, empty for a stationary sensor
  std::optional<Pose> X_RH;  // none: stationary
  std::vector<Observation> observations;
};

struct SensorProblem {
  std::span<const CalibratedCamera> cameras;  // poses X_SC
  std::span<const KnownPoint> points;
  std::span<const SensorSighting> sightings;
};

struct SensorResult {
  // The pose X_WS or X_HS; residuals_mm along the axes of W or H, indices are those of the sightings.
  FrameFitResult fit;
  std::vector<TriangulatedPoint> places;  // p_S, one per sighting
};

// Triangulates every sighting and fits the frames, each point weighted with the covariance of its
// triangulation and its own. On the hand the points are p_H = X_RH^-1 p_R. Failures of a triangulation, too
// few points and points on a line are told in fit.reason, with what would help.
SensorResult calibrate_sensor(const SensorProblem& problem);

}  // namespace zeropose
