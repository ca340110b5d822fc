// Where cameras that were moved are now, for an operator to accept (spec 60, "In operation").
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measure/measurement.h"
#include "measure/recalibration.h"

namespace zeropose {

// groups where the cell file has two plates and more of three points and more in the camera, else
// known_points where it has three with coordinates, else arbitrary_points.
RecalibrationMethod suited_method(const References& references, std::size_t camera);

// Whether the method can use the point.
bool counts_for(RecalibrationMethod method, const ReferencePoint& point);

struct CameraProposal {
  std::size_t camera = 0;
  RecalibrationMethod method = RecalibrationMethod::known_points;
  std::vector<RecalibrationPoint> points;  // the references that were seen, of those that the method can use
  RecalibrationResult result;              // X_WCn is what to activate; a new zero belongs to it
  // What the knock did. Of known points from where the pixels of the zero measurement put the camera, not
  // from where it is calibrated: errors of calibration and coordinates cancel.
  std::optional<Pose> X_CoCn;
  std::string reason;  // why there is no X_CoCn, one sentence
};

struct Proposal {
  std::vector<CameraProposal> cameras;  // those that measure() calls moved
  // What the same pictures give when nobody asks about the cameras: where they are calibrated, and with
  // X_CoCn, by which the zero measurement still holds (none: there is no X_CoCn for one of them).
  Measurement believed;
  std::optional<Measurement> proposed;
};

// From a measurement and what it was made from; the references' own noise and References::sigma_px weigh the
// pixels. The sigmas are of these, but of more than three known points, whose coordinates err as well, from
// the residuals. Nothing is proposed (no cameras) where none was moved.
Proposal propose(const MeasurementProblem& problem, const Measurement& measurement);

}  // namespace zeropose
