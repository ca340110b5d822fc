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
};

struct ZeroResult {
  Code code = Code::internal;
  std::string reason;
  Zero zero;
  Vector6 spread =
      Vector6::Zero();  // standard deviation of the single measurements round the mean, mm and rad
  PoseResult pose;      // of the averaged observations, before compensation
};

// From the observations of n frames of the object at its ideal stop. Every frame must hold the same views.
ZeroResult make_zero(std::span<const CalibratedCamera> cameras, const Job& job,
                     std::span<const std::vector<Observation>> frames);

}  // namespace zeropose
