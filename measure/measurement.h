// The whole staircase from images to a checked relative pose, pure: it replays anywhere (spec 50, 90).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measure/gap_job.h"
#include "measure/image.h"
#include "measure/job.h"
#include "measure/picture_health.h"
#include "measure/pose.h"
#include "measure/references.h"
#include "measure/wheel.h"
#include "measure/zero.h"

namespace zeropose {

// The frame of one camera of the cell; identity and time were checked by who grabbed it.
struct CameraImage {
  std::size_t camera = 0;  // index into the cell's cameras
  ImageView image;
};

struct Measurement {
  Code code = Code::internal;
  std::string reason;                     // one sentence with the numbers, empty when ok
  std::vector<PictureHealth> health;      // one per image
  std::vector<MarkFinding> findings;      // one per view of the job
  std::vector<Observation> observations;  // the findings that were found
  PoseResult pose;
  Pose X_O0O = Pose::Identity();    // meaningful only when code is ok; a sheet's has x, y and rz alone
  double largest_deviation_mm = 0;  // of the effective marks
  double sigma_mm = 0;              // at the worst application point
  double hidden_mm = 0;             // what one wrong mark could do at the worst application point unnoticed
  std::vector<MarkFinding> reference_findings;  // one per view of the references
  ReferenceCheck references;
  // Of a job without marks:
  std::optional<GapMeasurement> gaps{};  // measure/gap_job.h
  std::optional<WheelResult> wheel{};    // measure/wheel_job.h
};

// Where find_job_marks() looks: one search per view of the job (the snapshot draws them). The window reaches
// search_mm beyond the disc at its distance; a mark that has no image there has a window of size zero.
std::vector<MarkSearch> job_searches(const Job& job, std::span<const CalibratedCamera> cameras,
                                     const Pose& X_WO_expected);

// The findings that were found as observations, in the order of the views. `findings`: one per view of the
// job.
std::vector<Observation> observations_of(std::span<const MarkFinding> findings, const Job& job);

// Finds the marks only: the first step of measure() and all that a zero measurement needs of a frame.
std::vector<MarkFinding> find_job_marks(std::span<const CameraImage> images, const Job& job,
                                        std::span<const CalibratedCamera> cameras, const Pose& X_WO_expected);

// The mean blur of the marks that were found in a camera, sigma in px: its focus where it counts. nullopt:
// none was found.
std::optional<double> mark_blur_px(std::span<const MarkFinding> findings, const Job& job, std::size_t camera);

// What one measurement is made from. Everything is borrowed.
struct MeasurementProblem {
  std::span<const CameraImage> images;
  const Job& job;
  std::span<const CalibratedCamera> cameras;
  const Zero& zero;                  // without compensations (default-made) it is missing
  std::optional<Pose> X_O0O_last{};  // the last valid result that a robot was sent, for the step limit (M6.6)
  const References* references = nullptr;           // none: no camera is checked
  const ReferenceTrend* reference_trend = nullptr;  // of the last measurement; none: a first one
};

// Marks, references, pose, security and limits in the order of M6, but for the cameras: one that was moved is
// the cause of all that follows, so it is asked about before the marks; one that sees too few references
// after them. The first check that fails names the code. Marks are searched around the zero pose and used
// where the zero measurement's compensation puts them.
//
// A job that evens gaps goes the way of measure_gaps(), one of a wheel that of measure_wheel_of().
//
// image_blurred and image_saturated also where the job's requirements on marks fail only because the finder
// calls marks blurred or saturated: with those they would be met.
Measurement measure(const MeasurementProblem& problem);

}  // namespace zeropose
