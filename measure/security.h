// The checks between an estimate and a correction that a robot may use (spec 50 M6). Each gives a code and
// one sentence with its numbers.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "measure/code.h"
#include "measure/job.h"
#include "measure/picture_health.h"
#include "measure/pose.h"
#include "measure/reliability.h"

namespace zeropose {

struct Verdict {
  Code code = Code::internal;
  std::string reason;  // empty when ok
};

// M6.1, as far as pixels tell: most of the picture white (image_saturated) or hardly a pixel above black
// (image_dark). `name` is the camera's.
Verdict check_image(const PictureHealth& health, const std::string& name);

// M6.2: marks in all, in each camera of the job, cameras. `used` are the views that count; those of weight 0
// do not. The reason lists the views that are missing.
Verdict check_marks(const Job& job, std::span<const CalibratedCamera> cameras, std::span<const View> used);

// The application points of a job; without any, its marks.
std::vector<ApplicationPoint> points_that_count(const Job& job);

// Covariance of a pose's error at a point of the object, mm^2, axes of W. From the total covariance.
Eigen::Matrix3d covariance_at_mm2(const PoseResult& pose, const Eigen::Vector3d& p_O_mm);

// Its sigma, mm, in the direction in which it is largest.
double sigma_at_mm(const PoseResult& pose, const Eigen::Vector3d& p_O_mm);

// The largest of them over the points that count.
double worst_sigma_mm(const Job& job, const PoseResult& pose);

// M6.4.
Verdict check_sigma(const Job& job, const PoseResult& pose);

// The power of M6.3 at the points that count.
Reliability reliability_of(const Job& job, const PoseProblem& problem, const PoseResult& pose);

// The last part of M6.3: no single wrong mark may move an application point by more than max_hidden_mm
// without being noticed. `problem` is what `reliability` was reckoned from.
Verdict check_power(const Job& job, const PoseProblem& problem, const Reliability& reliability);

// M6.5: each of x y z rx ry rz of X_O0O within its range, ends included (those of angles to 1e-9 deg, for the
// rounding of the rotation). For a sheet the same axes: those of O0.
Verdict check_limits(const Requirements& requirements, const Pose& X_O0O);

// M6.5: how far X_O0O carries each application point, |X_O0O p - p|; without application points each mark.
// The limit itself passes (to 1e-9 mm).
Verdict check_displacement(const Job& job, const Pose& X_O0O);

// M6.6: how far each application point (without: each mark) has moved and how far the object has turned since
// the last valid result. The limits themselves pass (to 1e-9).
Verdict check_step(const Job& job, const Pose& X_O0O_last, const Pose& X_O0O);

}  // namespace zeropose
