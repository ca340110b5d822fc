// The zero measurement: the ideal pose that all later results are relative to, with compensation (spec 50 M4,
// M5).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "measure/job.h"
#include "measure/pose.h"

namespace zeropose {

// What later measurements need of the zero measurement.
struct Zero {
  Pose X_WO0 = Pose::Identity();
  std::vector<Eigen::Vector3d> compensation_O_mm;  // shift of each mark of the job
  std::vector<Observation> references{};           // where the reference points were (measure/references.h)
  double profile_radius_mm = 0;                    // of a wheel: where its nine points lie; else 0
};

// The job with its marks where the zero measurement puts them. Precondition: a compensation for each mark.
Job compensated(Job job, const Zero& zero);

struct ZeroResult {
  Code code = Code::internal;
  std::string reason;
  Zero zero;
  // Standard deviation of the single frames' poses round their mean, mm and rad, with the compensated marks:
  // what the noise of the frames does, not the calibration.
  Vector6 spread = Vector6::Zero();
  PoseResult pose;  // of the averaged observations, before compensation
};

// From the observations of n frames of the object at its ideal stop. The found pixels are averaged over the
// frames, X_WO0 is estimated from them with nothing removed (before compensation a good mark may be off by
// several px), held, and the marks are compensated.
//
// Codes: too_few_marks (a view of the job is missing in half of the frames or more; named),
// deviation_not_attributable (a mark wandered between the frames: the object moved, or something else was
// taken for it), compensation_too_large, and those of estimate_pose() and compensate(). zero counts only when
// the code is ok.
ZeroResult make_zero(std::span<const CalibratedCamera> cameras, const Job& job,
                     std::span<const std::vector<Observation>> frames);

}  // namespace zeropose
