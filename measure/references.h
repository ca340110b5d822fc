// Has a camera moved? Fixed points of the cell, looked at in the frames of every measurement (spec 50 M6.7,
// 60).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measure/code.h"
#include "measure/job.h"
#include "measure/pose.h"

namespace zeropose {

struct CameraImage;  // measure/measurement.h

// What does not move while cameras and objects do. position and normal of the mark are those in W.
struct ReferencePoint {
  Mark mark;
  std::string group;  // of the plate it sits on; only for recalibrate()
  // Where its coordinates are unknown: the pixel at which its only camera saw it and the size of its image.
  // The mark's position is then any point on that line of sight.
  std::optional<Eigen::Vector2d> taught_px;
  double taught_diameter_px = 0;
};

struct References {
  std::vector<ReferencePoint> points;
  std::vector<View> views;  // View::mark is the index of the point
  double search_mm = 20;    // search areas reach this far round the expected place
  double sigma_px = 0.05;   // of a pixel between zero and now beside its own noise: light, warmth
  double tolerance_px = 0;  // displacements below are no movement, however certain they are; 0: none
  bool suspicious_blocks = false;
};

// The pixels of the references at the zero measurement are what they are compared with later: errors of the
// calibration and of the points' coordinates cancel. Observation::mark is the index of the point.
struct ReferenceZero {
  Code code = Code::internal;
  std::string reason;
  std::vector<Observation> references;
};

// The running mean of the displacement of each view, kept from measurement to measurement.
struct ReferenceTrend {
  std::vector<Eigen::Vector2d> mean_px;  // by view; empty: nothing yet
  std::vector<int> count;
};

enum class CameraStand { unchecked = 0, ok, suspicious, moved, too_few_seen };
std::string_view name_of(CameraStand stand);

struct CameraCheck {
  std::size_t camera = 0;
  CameraStand stand = CameraStand::unchecked;
  int seen = 0, expected = 0;  // references
  double rms_px = 0;           // displacement since the zero measurement, root mean square
  double chance = 1;           // probability of displacements that large in a camera that stands still
  std::string farthest;        // the reference that is displaced most
  double farthest_px = 0;
};

struct ReferenceCheck {
  Code code = Code::internal;  // ok also where there is nothing to check
  std::string reason;
  std::vector<CameraCheck> cameras;  // those with references in the frames
  ReferenceTrend trend;              // to give to the next check
};

// Where the references are looked for, one search per view.
std::vector<MarkFinding> find_references(std::span<const CameraImage> images, const References& references,
                                         std::span<const CalibratedCamera> cameras);

// From the findings of n frames of a zero measurement. Codes: ok, reference_missing (a reference of a camera
// that was looked at is missing in half of the frames or more; named), deviation_not_attributable (one
// wandered).
ReferenceZero average_references(const References& references, std::span<const CalibratedCamera> cameras,
                                 std::span<const std::vector<MarkFinding>> frames);

// A camera was moved when the displacements of its references since the zero measurement are larger than
// chance allows: the sum of their squares, weighted with the noise of both pixels and sigma_px, beyond the
// 0.05 % of a camera that stands still. suspicious: the running mean is beyond 0.1 % with half of sigma_px,
// or a movement is within tolerance_px. too_few_seen: fewer than two of its references (or its only one) were
// found.
//
// Codes: camera_moved, reference_missing, camera_suspicious (only if suspicious_blocks), ok. The reason names
// camera, size and the reference that is displaced most; if that is the only one, that it may have been
// knocked.
struct ReferenceProblem {
  const References& references;
  std::span<const CalibratedCamera> cameras;
  std::span<const Observation> zero;      // ReferenceZero::references
  std::span<const MarkFinding> findings;  // one per view
  const ReferenceTrend& trend;
};
ReferenceCheck check_references(const ReferenceProblem& problem);

}  // namespace zeropose
