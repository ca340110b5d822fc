#include "measure/wheel.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/words.h"
#include "measure/stereo_lines.h"
#include "measure/triangulation.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double crossing_sigma_px =
    0.5;                        // of a crossing, where two lights add up, with the calibration's error
constexpr double step_mm = 10;  // for directions in the image
constexpr double crossing_clear_sigmas = 3.5;  // of a line: so near to a crossing its centres are biased
constexpr std::size_t least_points = 60;
constexpr double beyond_mm = 25;  // of the side wall's radii and plane, where crossings may lie
constexpr double most_depth_mm = 80;
constexpr double radius_tolerance_mm = 2, height_tolerance_mm = 1.5;
constexpr int most_rounds = 12;
constexpr double settled_rad = 1e-7, settled_mm = 1e-4;
constexpr double most_axis_difference_rad = 0.004;  // 0.23 deg

struct SensorLines {
  LineArrayResult left, right;
};

class WheelMeasurement {
 public:
  explicit WheelMeasurement(const WheelProblem& problem) : problem_(problem) {}

  WheelResult run() {
    if (makes_sense() && order() && pair() && reconstruct() && find_axis() && settle()) finish();
    return std::move(result_);
  }

 private:
  bool fail(WheelStatus status, std::string reason) {
    result_.status = status;
    result_.reason = std::move(reason);
    return false;
  }

  static bool fits(const ImageView& image, const CalibratedCamera& camera) {
    return image.data && image.width_px == camera.model.width_px && image.height_px == camera.model.height_px;
  }

  bool makes_sense() {
    const ExpectedTyre& tyre = problem_.tyre;
    if (problem_.sensors.size() != 3)
      return fail(WheelStatus::wrong_problem,
                  "three sensors are needed, there are " + number(problem_.sensors.size()));
    if (!(tyre.min_radius_mm > 0 && tyre.max_radius_mm > tyre.min_radius_mm && tyre.max_radius_mm < 2000) ||
        !(tyre.unevenness_mm >= 0 && tyre.out_of_round_mm >= 0))
      return fail(WheelStatus::wrong_problem, "the side wall's radii or its unevenness make no sense");
    if (!(problem_.max_tilt_rad > 0 && problem_.max_shift_mm > 0))
      return fail(WheelStatus::wrong_problem, "the largest tilt and shift must be above 0");
    for (const WheelSensor& sensor : problem_.sensors) {
      if (!fits(sensor.left_image, sensor.left) || !fits(sensor.right_image, sensor.right))
        return fail(WheelStatus::wrong_problem,
                    "an image of sensor " + sensor.name + " is missing or not of its camera's size");
    }
    return true;
  }

  bool order_one(const WheelSensor& sensor, const CalibratedCamera& camera, const ImageView& image,
                 LineArrayResult& lines) {
    const auto array = line_array_problem(problem_, sensor.angle_rad, camera, image);
    if (!array)
      return fail(WheelStatus::wrong_problem, "camera " + camera.name +
                                                  " does not see the nominal side wall at " +
                                                  number(sensor.angle_rad * degrees_per_radian, 0) + " deg");
    lines = order_lines(*array);
    if (lines.status == LineArrayStatus::ok) return true;
    result_.order = lines.status;
    const bool wrong = lines.status == LineArrayStatus::wrong_problem;
    return fail(wrong ? WheelStatus::wrong_problem : WheelStatus::lines_not_ordered,
                "camera " + camera.name + ": " + lines.reason);
  }

  bool order() {
    for (std::size_t s = 0; s < 3; ++s) {
      const WheelSensor& sensor = problem_.sensors[s];
      if (!order_one(sensor, sensor.left, sensor.left_image, sensors_[s].left) ||
          !order_one(sensor, sensor.right, sensor.right_image, sensors_[s].right))
        return false;
    }
    result_.order = LineArrayStatus::ok;
    return true;
  }

  bool pair() {
    for (std::size_t s = 0; s < 3; ++s) {
      for (std::size_t a = 0; a < problem_.layout.across; ++a) {
        for (std::size_t r = 0; r < radial_lines; ++r) {
          const auto &left = sensors_[s].left.crossings[a][r], &right = sensors_[s].right.crossings[a][r];
          if (left && right && !pair_agrees(problem_.sensors[s], *left, *right, a, r)) return false;
        }
      }
    }
    return true;
  }

  bool pair_agrees(const WheelSensor& sensor, const Vector2d& left, const Vector2d& right, std::size_t across,
                   std::size_t radial) {
    const CalibratedCamera cameras[] = {sensor.left, sensor.right};
    Observation observations[2];
    observations[0].u_px = left, observations[1].u_px = right;
    observations[1].camera = 1;
    for (Observation& observation : observations)
      observation.covariance_px2 *= crossing_sigma_px * crossing_sigma_px;
    const TriangulatedPoint point = triangulate({cameras, observations, 0});
    const std::string which = "sensor " + sensor.name + ": the crossing of line " + number(across + 1) +
                              " across with the " + std::string(radial_name(radial)) + " radial line ";
    if (point.code != Code::ok)
      return fail(WheelStatus::pairs_disagree, which + "does not meet in both images: " + point.reason);
    const Vector3d p_N = problem_.X_WN.inverse() * point.p_W_mm;
    const double radius_mm = p_N.head<2>().norm();
    if (radius_mm < problem_.tyre.min_radius_mm - beyond_mm ||
        radius_mm > problem_.tyre.max_radius_mm + beyond_mm || std::abs(p_N.z()) > most_depth_mm)
      return fail(WheelStatus::pairs_disagree, which + "lies off the side wall: radius " +
                                                   number(radius_mm, 0) + " mm, height " +
                                                   number(p_N.z(), 0) + " mm");
    return true;
  }

  // Without what lies near a crossing.
  LightLine clear_line(const LineArrayResult& lines, std::size_t radial) const {
    LightLine line = lines.radial[radial];
    const double clear_px = crossing_clear_sigmas * problem_.search.sigma_px;
    std::erase_if(line.centres, [&](const LineCentre& centre) {
      return std::ranges::any_of(lines.crossings, [&](const auto& row) {
        return row[radial] && std::abs(row[radial]->y() - centre.at) < clear_px;
      });
    });
    return line;
  }

  bool reconstruct() {
    for (std::size_t s = 0; s < 3; ++s) {
      const WheelSensor& sensor = problem_.sensors[s];
      for (std::size_t r = 0; r < radial_lines; ++r) {
        SideLine points = points_on_line(sensor.left, clear_line(sensors_[s].left, r), sensor.right,
                                         clear_line(sensors_[s].right, r));
        std::erase_if(points, [&](const SidePoint& point) { return !on_side_wall(point); });
        if (points.size() < least_points)
          return fail(WheelStatus::line_too_short, "sensor " + sensor.name + ": " + number(points.size()) +
                                                       " points on the side wall along the " +
                                                       std::string(radial_name(r)) + " radial line, " +
                                                       number(least_points) + " are needed");
        result_.lines.push_back(std::move(points));
      }
    }
    return true;
  }

  bool on_side_wall(const SidePoint& point) const {
    const double radius_mm = (problem_.X_WN.inverse() * point.p_W_mm).head<2>().norm();
    return radius_mm > problem_.tyre.min_radius_mm && radius_mm < problem_.tyre.max_radius_mm;
  }

  bool find_axis() {
    const auto axis = fit_axis(result_.lines, {problem_.X_WN.translation(), problem_.X_WN.linear().col(2)});
    if (!axis) return fail(WheelStatus::no_axis, "the radial lines show no common section of a tyre");
    surface_ = axis_ = *axis;
    return true;
  }

  std::vector<std::vector<ProfileExtreme>> extremes() const {
    ProfileSearch search;
    search.neighbours_gain = neighbours_gain(problem_.search);
    std::vector<std::vector<ProfileExtreme>> lines;
    for (const SideLine& line : result_.lines) lines.push_back(extremes_on_line(line, axis_, search));
    return lines;
  }

  static double mean_radius_mm(const SharedProfile& profile) {
    double sum = 0;
    for (const ProfileExtreme& extreme : profile) sum += extreme.radius_mm;
    return sum / static_cast<double>(profile.size());
  }

  // The sharpest, or the one next to the wanted radius; then the same one as before.
  bool choose() {
    const auto lines = extremes();
    SharedProfiles shared = shared_by_all(lines, radius_tolerance_mm, height_tolerance_mm);
    const auto off = [](double radius_mm, double from_mm) { return std::abs(radius_mm - from_mm); };
    std::optional<double> wanted = problem_.tyre.profile_radius_mm;
    if (!result_.profile.empty()) wanted = mean_radius_mm(result_.profile);
    if (wanted) {
      std::erase_if(shared.all, [&](const SharedProfile& profile) {
        return off(mean_radius_mm(profile), *wanted) > 2 * radius_tolerance_mm;
      });
      std::ranges::sort(shared.all, {},
                        [&](const SharedProfile& profile) { return off(mean_radius_mm(profile), *wanted); });
    }
    if (shared.all.empty() && wanted) {
      shared.lines_without.clear();
      for (std::size_t i = 0; i < lines.size(); ++i) {
        if (std::ranges::none_of(lines[i], [&](const ProfileExtreme& extreme) {
              return off(extreme.radius_mm, *wanted) < 2 * radius_tolerance_mm;
            }))
          shared.lines_without.push_back(i);
      }
    }
    if (shared.all.empty()) return fail(WheelStatus::no_common_profile, reason_without(shared, wanted));
    result_.profile = shared.all.front();
    return true;
  }

  std::string line_name(std::size_t line) const {
    return "the " + std::string(radial_name(line % radial_lines)) + " radial line of sensor " +
           problem_.sensors[line / radial_lines].name;
  }

  std::string reason_without(const SharedProfiles& shared, const std::optional<double>& wanted) const {
    std::string reason = "no heave or hollow of the tyre is seen on all nine radial lines";
    if (wanted) reason += " near the radius " + number(*wanted, 1) + " mm";
    for (std::size_t i = 0; i < shared.lines_without.size(); ++i)
      reason += (i == 0 ? "; the best one is missing on " : " and ") + line_name(shared.lines_without[i]);
    return reason;
  }

  // Axis and centre from the nine points, and the nine points along the axis, in turns.
  bool settle() {
    for (int round = 0; round < most_rounds; ++round) {
      if (!choose()) return false;
      std::vector<WheelPlanePoint> points;
      for (const ProfileExtreme& extreme : result_.profile)
        points.push_back({extreme.p_W_mm, extreme.sigma_mm, extreme.sigma_radius_mm});
      const ExpectedTyre& tyre = problem_.tyre;
      result_.plane =
          fit_wheel_plane({points, problem_.X_WN.linear().col(2), tyre.unevenness_mm, tyre.out_of_round_mm});
      const WheelPlaneResult& plane = result_.plane;
      if (plane.status == WheelPlaneStatus::contradiction)
        return fail(WheelStatus::contradiction, line_name(*plane.wrong_point) + ": " + plane.reason);
      if (plane.status != WheelPlaneStatus::ok) return fail(WheelStatus::no_axis, plane.reason);
      const WheelAxis next{plane.X_WO.translation(), plane.X_WO.linear().col(2)};
      const double turn = next.n_W.cross(axis_.n_W).norm();
      const double shift = next.place(axis_.p_W_mm).radius_mm;
      axis_ = next;
      if (turn < settled_rad && shift < settled_mm) return true;
    }
    return fail(WheelStatus::no_axis, "the profile points do not settle on an axis");
  }

  void finish() {
    const WheelPlaneResult& plane = result_.plane;
    result_.X_WO = plane.X_WO;
    result_.profile_radius_mm = plane.radius_mm;
    const WheelAngles angles = wheel_angles(problem_.X_WO0.value_or(problem_.X_WN), plane.X_WO);
    result_.camber_rad = angles.camber_rad, result_.toe_rad = angles.toe_rad;
    result_.sigma_camber_rad = std::sqrt(plane.covariance_rad2(0, 0));
    result_.sigma_toe_rad = std::sqrt(plane.covariance_rad2(1, 1));
    result_.surface_differs_rad = axis_.n_W.cross(surface_.n_W).norm();
    check();
  }

  void check() {
    const Pose X_NO = problem_.X_WN.inverse() * result_.X_WO;
    const double tilt = std::acos(std::clamp(X_NO.linear()(2, 2), -1.0, 1.0));
    const double shift = X_NO.translation().head<2>().norm(), radius = result_.profile_radius_mm;
    if (result_.surface_differs_rad > most_axis_difference_rad) {
      fail(WheelStatus::axis_disagrees, "the axis of the nine points differs by " +
                                            number(result_.surface_differs_rad * degrees_per_radian) +
                                            " deg from that of the whole side wall");
    } else if (tilt > problem_.max_tilt_rad || shift > problem_.max_shift_mm) {
      fail(WheelStatus::out_of_range, "the wheel is tilted by " + number(tilt * degrees_per_radian) +
                                          " deg and shifted by " + number(shift, 1) + " mm");
    } else if (radius < problem_.tyre.min_radius_mm || radius > problem_.tyre.max_radius_mm) {
      fail(WheelStatus::out_of_range,
           "the profile's radius of " + number(radius, 1) + " mm is off the side wall");
    } else {
      result_.status = WheelStatus::ok;
    }
  }

  const WheelProblem& problem_;
  std::array<SensorLines, 3> sensors_;
  WheelAxis surface_, axis_;
  WheelResult result_;
};

}  // namespace

std::string_view name_of(WheelStatus status) {
  switch (status) {
    case WheelStatus::failed:
      return "failed";
    case WheelStatus::ok:
      return "ok";
    case WheelStatus::wrong_problem:
      return "wrong_problem";
    case WheelStatus::lines_not_ordered:
      return "lines_not_ordered";
    case WheelStatus::pairs_disagree:
      return "pairs_disagree";
    case WheelStatus::line_too_short:
      return "line_too_short";
    case WheelStatus::no_axis:
      return "no_axis";
    case WheelStatus::no_common_profile:
      return "no_common_profile";
    case WheelStatus::contradiction:
      return "contradiction";
    case WheelStatus::axis_disagrees:
      return "axis_disagrees";
    case WheelStatus::out_of_range:
      return "out_of_range";
  }
  return "?";
}

std::optional<LineArrayProblem> line_array_problem(const WheelProblem& problem, double angle_rad,
                                                   const CalibratedCamera& camera, const ImageView& image) {
  const double radius_mm = (problem.tyre.min_radius_mm + problem.tyre.max_radius_mm) / 2;
  const Vector3d outwards(std::cos(angle_rad), std::sin(angle_rad), 0), middle = radius_mm * outwards;
  const Pose X_CN = camera.X_WC.inverse() * problem.X_WN;
  const double side = (problem.X_WN.inverse() * camera.X_WC.translation()).z() > 0 ? 1 : -1;
  const Vector3d right = (-side * Vector3d::UnitZ()).cross(outwards);
  const auto at = project(camera.model, X_CN * middle);
  const auto to_right = project(camera.model, X_CN * (middle + step_mm * right));
  const auto out = project(camera.model, X_CN * (middle + step_mm * outwards));
  if (!at || !to_right || !out || !in_image(camera.model, *at)) return std::nullopt;
  return LineArrayProblem{image, problem.layout, problem.search, *to_right - *at, *out - *at};
}

WheelResult measure_wheel(const WheelProblem& problem) { return WheelMeasurement(problem).run(); }

}  // namespace zeropose
