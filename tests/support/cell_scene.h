// The car-body cell as tests see it: true cameras (Tables 4.7 and 4.8), the shipped job, and what an ideal
// mark finder would report.
#pragma once

#include <vector>

#include "measure/job.h"
#include "measure/pose.h"
#include "measure/zero.h"
#include "tests/support/poses.h"

namespace zeropose::test {

struct CellScene {
  std::vector<CalibratedCamera> cameras;
  Job job;
};

// Cameras from tests/golden, job from config/cells/car-body.json.
CellScene car_body();

// The car body without knowledge of the discs, equal weights, no tolerances: plain geometry.
CellScene car_body_points();

// The pixels of all views of the job for the object at X_WO, as seen by the given cameras: centre of each
// disc's image plus normal noise, with that noise as covariance. Marks without an image are left out.
std::vector<Observation> observe(std::span<const CalibratedCamera> cameras, const Job& job, const Pose& X_WO,
                                 double sigma_px, Random& random);

// A pose X_O0O drawn evenly: each of x y z within +-mm, each of rx ry rz within +-deg.
Pose random_shift(Random& random, double mm, double deg);

// The problem of one observed frame, from the given start.
PoseProblem problem_of(std::span<const CalibratedCamera> cameras, const Job& job,
                       std::span<const Observation> observations, const Pose& X_WO_start);

// estimate_pose() of such a problem; without a start from any pose.
PoseResult estimate(const CellScene& scene, std::span<const Observation> observations,
                    std::optional<Pose> X_WO_start);

// Errors of relative poses, component by component: x y z in mm, rx ry rz in degrees.
class ErrorStatistics {
 public:
  void add(const Pose& X_O0O, const Pose& X_O0O_true);
  int count() const { return count_; }
  Vector6 rms() const { return (squares_ / count_).cwiseSqrt(); }
  Vector6 largest() const { return largest_; }
  void print(const char* title) const;

 private:
  int count_ = 0;
  Vector6 squares_ = Vector6::Zero(), largest_ = Vector6::Zero();
};

}  // namespace zeropose::test
