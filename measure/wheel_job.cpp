#include "measure/wheel_job.h"

#include <algorithm>
#include <cmath>

#include "calib/words.h"
#include "measure/picture_checks.h"

namespace zeropose {
namespace {

// A wheel that stands still is seen so far from the mean of its exposures at most.
constexpr double most_wander_mm = 0.2, most_wander_rad = 0.0005;

// Everything in the frame N of the nominal wheel: there x is forward and y up, whatever the world's axes are.
struct Sight {
  std::vector<WheelSensor> sensors;
  WheelProblem problem;
};

CalibratedCamera seen_from(const Pose& X_WN, CalibratedCamera camera) {
  camera.X_WC = X_WN.inverse() * camera.X_WC;
  return camera;
}

Sight sight_of(const Job& job, std::span<const CalibratedCamera> cameras,
               std::span<const CameraImage> images) {
  Sight sight;
  const auto view = [&](std::size_t camera) {
    const ImageView* image = image_of(images, camera);
    return image == nullptr ? ImageView{} : *image;
  };
  for (const WheelEyes& eyes : job.wheel->sensors)
    sight.sensors.push_back({eyes.name, eyes.angle_rad, seen_from(job.X_WO_nominal, cameras[eyes.left]),
                             seen_from(job.X_WO_nominal, cameras[eyes.right]), view(eyes.left),
                             view(eyes.right)});
  sight.problem.layout = job.wheel->layout;
  sight.problem.search = job.wheel->search;
  sight.problem.tyre = job.wheel->tyre;
  return sight;
}

Code code_of(WheelStatus status) {
  switch (status) {
    case WheelStatus::ok:
      return Code::ok;
    case WheelStatus::wrong_problem:
      return Code::marks_invalid;
    case WheelStatus::lines_not_ordered:
    case WheelStatus::line_too_short:
    case WheelStatus::no_axis:
    case WheelStatus::no_common_profile:
      return Code::lines_not_found;
    case WheelStatus::pairs_disagree:
    case WheelStatus::contradiction:
    case WheelStatus::axis_disagrees:
      return Code::deviation_not_attributable;
    case WheelStatus::out_of_range:
      return Code::limit_displacement;
    case WheelStatus::failed:
      break;
  }
  return Code::internal;
}

Verdict check_wheel_sigma(const WheelTask& task, const WheelResult& wheel) {
  if (wheel.sigma_camber_rad <= task.max_sigma_rad && wheel.sigma_toe_rad <= task.max_sigma_rad)
    return {Code::ok, {}};
  const double sigma_rad = std::max(wheel.sigma_camber_rad, wheel.sigma_toe_rad);
  return {Code::sigma_too_large, "the sigma of camber or toe is " +
                                     number(sigma_rad * degrees_per_radian, 4) + " deg, allowed are " +
                                     number(task.max_sigma_rad * degrees_per_radian, 4) + " deg"};
}

bool passes(Measurement& measurement, Verdict verdict) {
  measurement.code = verdict.code;
  measurement.reason = std::move(verdict.reason);
  return measurement.code == Code::ok;
}

std::optional<LineArrayProblem> lines_wanted(const Job& job, std::span<const CalibratedCamera> cameras,
                                             std::size_t camera, const ImageView& image) {
  const Sight sight = sight_of(job, cameras, {});
  for (const WheelEyes& eyes : job.wheel->sensors)
    if (camera == eyes.left || camera == eyes.right)
      return line_array_problem(sight.problem, eyes.angle_rad, seen_from(job.X_WO_nominal, cameras[camera]),
                                image);
  return std::nullopt;
}

Pose relative(const Pose& X_WO0, const WheelResult& wheel) {
  const Eigen::Vector3d shift = (X_WO0.inverse() * wheel.X_WO).translation();
  return from_six_numbers({shift.x(), shift.y(), shift.z(), wheel.camber_rad * degrees_per_radian,
                           wheel.toe_rad * degrees_per_radian, 0});
}

}  // namespace

WheelResult look_at_wheel(std::span<const CameraImage> images, const Job& job,
                          std::span<const CalibratedCamera> cameras, const Zero& zero) {
  Sight sight = sight_of(job, cameras, images);
  sight.problem.sensors = sight.sensors;
  if (zero.profile_radius_mm > 0) {
    sight.problem.tyre.profile_radius_mm = zero.profile_radius_mm;
    sight.problem.X_WO0 = job.X_WO_nominal.inverse() * zero.X_WO0;
  }
  WheelResult wheel = measure_wheel(sight.problem);
  wheel.X_WO = job.X_WO_nominal * wheel.X_WO;
  return wheel;
}

void measure_wheel_of(Measurement& measurement, const MeasurementProblem& problem) {
  const WheelTask& task = *problem.job.wheel;
  const WheelResult& wheel =
      measurement.wheel.emplace(look_at_wheel(problem.images, problem.job, problem.cameras, problem.zero));
  if (!passes(measurement, {code_of(wheel.status), wheel.reason})) return;
  const double sigma_rad = std::max(wheel.sigma_camber_rad, wheel.sigma_toe_rad);
  measurement.sigma_mm = wheel.profile_radius_mm * sigma_rad;
  measurement.pose.X_WO = wheel.X_WO;
  measurement.pose.effective_marks = static_cast<int>(wheel.profile.size());
  measurement.pose.effective_cameras = static_cast<int>(2 * task.sensors.size());
  if (!passes(measurement, check_wheel_sigma(task, wheel))) return;
  measurement.X_O0O = relative(problem.zero.X_WO0, wheel);
  passes(measurement, check_limits(problem.job.requirements, measurement.X_O0O));
}

ZeroResult make_wheel_zero(const Job& job, std::span<const WheelResult> exposures) {
  ZeroResult result;
  std::vector<Pose> good;
  const WheelResult* failed = nullptr;
  double radius_mm = 0;
  for (const WheelResult& wheel : exposures) {
    if (wheel.status != WheelStatus::ok) {
      failed = &wheel;
      continue;
    }
    good.push_back(job.X_WO_nominal.inverse() * wheel.X_WO);
    radius_mm += wheel.profile_radius_mm;
  }
  if (2 * good.size() <= exposures.size()) {
    result.code = failed == nullptr ? Code::internal : code_of(failed->status);
    result.reason = number(exposures.size() - good.size()) + " of " + number(exposures.size()) +
                    " exposures of the zero measurement failed" +
                    (failed == nullptr ? "" : ": " + failed->reason);
    return result;
  }
  const Pose mean = average(good);
  const auto count = static_cast<double>(good.size());
  for (const Pose& X_NO : good) {
    const Vector6 off = difference(mean, X_NO);
    if (off.head<3>().norm() > most_wander_mm || off.tail<3>().norm() > most_wander_rad) {
      result.code = Code::deviation_not_attributable;
      result.reason = "the wheel moved by " + number(off.head<3>().norm(), 3) + " mm and " +
                      number(off.tail<3>().norm() * degrees_per_radian, 4) +
                      " deg between the exposures of the zero measurement";
      return result;
    }
    if (good.size() > 1) result.spread += off.cwiseAbs2() / (count - 1);
  }
  result.spread = result.spread.cwiseSqrt();
  result.pose.X_WO = job.X_WO_nominal * wheel_frame(mean.translation(), mean.linear().col(2));
  result.zero.X_WO0 = result.pose.X_WO;
  result.zero.profile_radius_mm = radius_mm / count;
  result.code = Code::ok;
  return result;
}

bool sees_its_side_wall(const Job& job, std::span<const CalibratedCamera> cameras, std::size_t camera) {
  return lines_wanted(job, cameras, camera, {}).has_value();
}

std::optional<LineArrayResult> wheel_lines(const Job& job, std::span<const CalibratedCamera> cameras,
                                           std::size_t camera, const ImageView& image) {
  const auto array = lines_wanted(job, cameras, camera, image);
  return array ? std::optional(order_lines(*array)) : std::nullopt;
}

}  // namespace zeropose
