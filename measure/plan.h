// What accuracy a layout of cameras and marks will give, before anything is mounted (spec 92 plan, spec 50
// M3, M6).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "measure/job.h"
#include "measure/references.h"
#include "measure/reliability.h"
#include "measure/security.h"

namespace zeropose {

struct PlanProblem {
  std::span<const CalibratedCamera> cameras;
  const Job& job;
  double sigma_px = 0.02;                  // of a found mark or reference point, per axis
  const References* references = nullptr;  // none: nothing is said about cameras that were moved
};

struct PlannedPoint {
  std::string name;
  double sigma_mm = 0;                                   // in the direction in which it is largest
  Eigen::Vector3d sigma_W_mm = Eigen::Vector3d::Zero();  // along the axes of W
};

// A motion of the object that the marks tell worst: delta = t * (translation mm, rotation rad) about the
// middle of the marks, axes of W, in which t is normally distributed with sigma 1.
struct PlannedDirection {
  double sigma_mm = 0;  // root mean square over the marks
  Eigen::Vector3d translation_W_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_W_deg = Eigen::Vector3d::Zero();
};

struct PlannedView {
  View view;
  bool seen = false;     // the mark lies in the image as a whole
  double border_px = 0;  // from its outline to the border of the image; negative: it reaches beyond
  double border_mm = 0;  // the same at the mark: how far the object may move
  double diameter_px = 0;
  ObservationReliability
      reliability;           // when it is seen and the pose is determined; its observation means nothing
  double detectable_mm = 0;  // reliability.detectable_px at the mark
};

// What is left when a camera is lost.
struct PlannedLoss {
  Verdict verdict;      // of the checks before the limits (M6.2 to M6.4)
  double sigma_mm = 0;  // at the worst point; infinite without a pose
  double hidden_mm = 0;
};

// How well a camera that was moved is found again from the reference points that it sees and whose
// coordinates are known.
struct PlannedRecovery {
  int points = 0;
  std::string reason;  // why not at all, empty when it is
  // Of the position and of the rotation, each the root of the sum of its three variances.
  double sigma_mm = 0, sigma_deg = 0;
};

struct PlannedCamera {
  std::size_t camera = 0;
  int marks = 0;             // it sees
  double covered_share = 0;  // of the image: the rectangle round its marks
  PlannedLoss loss;
  PlannedRecovery recovery;
};

struct Plan {
  Verdict verdict;  // of the checks before the limits; no pose: nothing below but views and cameras
  Vector6 sigma = Vector6::Zero();  // of the pose, about O: mm along and rad about the axes of W
  double sigma_mm = 0;              // at the worst point
  double hidden_mm = 0;             // what one wrong mark could do there unnoticed
  std::vector<PlannedPoint> points;
  std::vector<PlannedDirection> directions;  // all six (three for a sheet), the weakest first
  std::vector<PlannedView> views;            // one per view of the job
  std::vector<PlannedCamera> cameras;        // those of the job, ascending
};

// The object stands in its nominal pose and every mark in an image is found with the given noise.
// Precondition: the views of the job name cameras and marks that exist.
Plan plan(const PlanProblem& problem);

}  // namespace zeropose
