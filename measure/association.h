// Which of several things that look alike is the mark: the geometry of all marks together says it (spec 50
// M0).
#pragma once

#include <span>
#include <vector>

#include "calib/camera_model.h"
#include "measure/job.h"
#include "measure/marks.h"

namespace zeropose {

// The findings of a job's views with those that were ambiguous decided where one choice of their candidates
// explains all found marks by one pose of the object within their standard deviations (four sigma, with the
// job's system_sigma_px and the marks' sigma_mm), and no other choice is as likely as a thousandth of it.
// Where the marks do not check each other, or there are more than 64 choices, they stay ambiguous.
//   findings    one per view
//   candidates  one list per view; read where the finding is ambiguous
std::vector<MarkFinding> decided_by_geometry(const Job& job, std::span<const CalibratedCamera> cameras,
                                             std::vector<MarkFinding> findings,
                                             std::span<const std::vector<MarkFinding>> candidates,
                                             const Pose& X_WO_start);

}  // namespace zeropose
