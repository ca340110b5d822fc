#include "sim/wheel_object.h"

#include <array>
#include <cmath>
#include <sstream>

#include "config/config_error.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double line_apart_rad = 8 / degrees_per_radian, line_sigma_mm = 0.5;
constexpr double line_end_mm = 58, across_end_mm = 18;  // to the right: of the control line, of the others
constexpr double beyond_mm = 6;                         // the side wall's ends radial lines go on

Vector3d outwards_at(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad), 0}; }

// From outside.
std::array<double, 3> across_radii_mm(const TyreShape& tyre) {
  if (tyre.bead_mm < 200) return {250, 235, 215.5};
  if (tyre.bead_mm < 240) return {276, 262, 248};
  return {300, 286, 274};
}

// In the plane of the projector and the wheel's axis, turned by an angle where that meets z = 0.
ProjectedLine radial_line(const TyreShape& tyre, const Pose& X_NP, double middle_rad, double angle_rad) {
  const auto inwards = [&](double radius_mm) {
    const Vector3d p_P = X_NP.inverse() * (radius_mm * outwards_at(middle_rad));
    return p_P.y() / p_P.z();
  };
  ProjectedLine line;
  line.n_P = X_NP.linear().transpose() * (-X_NP.translation()).cross(outwards_at(angle_rad)).normalized();
  line.along_P = Vector3d::UnitY();
  line.from = inwards(tyre.tread_mm + beyond_mm);
  line.to = inwards(tyre.bead_mm - beyond_mm);
  return line;
}

ProjectedLine across_line(const Pose& X_NP, double middle_rad, double radius_mm, double end_mm) {
  const Vector3d p_P = X_NP.inverse() * (radius_mm * outwards_at(middle_rad));
  return {Vector3d(0, p_P.z(), -p_P.y()).normalized(), Vector3d::UnitX(), -line_end_mm / p_P.z(),
          end_mm / p_P.z()};
}

// Halfway between two cameras, looking as they do in the mean, x from the left one to the right one.
Pose between(const Pose& X_NL, const Pose& X_NR) {
  const Vector3d z = (X_NL.linear().col(2) + X_NR.linear().col(2)).normalized();
  const Vector3d right = X_NR.translation() - X_NL.translation();
  Pose X_NP = Pose::Identity();
  X_NP.linear().col(0) = (right - right.dot(z) * z).normalized();
  X_NP.linear().col(1) = z.cross(X_NP.linear().col(0));
  X_NP.linear().col(2) = z;
  X_NP.translation() = (X_NL.translation() + X_NR.translation()) / 2;
  return X_NP;
}

}  // namespace

LineProjector wheel_projector(const TyreShape& tyre, const Pose& X_NP, double angle_rad,
                              const LineLayout& layout) {
  const double away_mm = (X_NP.translation() - tyre.widest_mm * outwards_at(angle_rad)).norm();
  LineProjector projector{X_NP, {}, line_sigma_mm / away_mm};
  for (const double side : {1, 0, -1})  // the right one at the smallest angle
    projector.lines.push_back(radial_line(tyre, X_NP, angle_rad, angle_rad + side * line_apart_rad));
  for (const double radius_mm : across_radii_mm(tyre)) {
    const bool control = projector.lines.size() == radial_lines + layout.control;
    projector.lines.push_back(across_line(X_NP, angle_rad, radius_mm, control ? line_end_mm : across_end_mm));
  }
  return projector;
}

void complete(WheelObject& object, const Job& job, std::span<const CalibratedCamera> cameras) {
  if (!job.wheel) throw ConfigError({"job " + job.name + " has no wheel, its truth file shows one"});
  const LineLayout& layout = job.wheel->layout;
  if (layout.across != across_radii_mm(object.tyre).size())
    throw ConfigError({"job " + job.name + ": found " + std::to_string(layout.across) +
                       " lines across, expected 3 as the simulated projectors draw them"});
  const Pose X_NW = job.X_WO_nominal.inverse();
  for (const WheelEyes& eyes : job.wheel->sensors) {
    const Pose X_NP = between(X_NW * cameras[eyes.left].X_WC, X_NW * cameras[eyes.right].X_WC);
    LineProjector projector = wheel_projector(object.tyre, X_NP, eyes.angle_rad, layout);
    projector.X_WP = job.X_WO_nominal * X_NP;
    object.sensors.push_back({eyes.name, eyes.angle_rad, eyes.left, eyes.right, std::move(projector)});
  }
}

std::optional<WheelFault> wheel_fault(const WheelObject& object, const std::string& text) {
  for (std::size_t i = 0; i < object.sensors.size(); ++i) {
    const WheelSensorTruth& sensor = object.sensors[i];
    if (!text.starts_with(sensor.name + " ")) continue;
    WheelFault fault{i, {}, 0};
    std::istringstream rest(text.substr(sensor.name.size() + 1));
    rest >> fault.kind >> fault.number;
    if (rest.fail() || !rest.eof()) continue;
    const bool a_line = fault.number >= 1 && fault.number <= sensor.projector.lines.size();
    if (fault.kind == "dirt" || (fault.kind == "line" && a_line)) return fault;
  }
  return std::nullopt;
}

}  // namespace zeropose
