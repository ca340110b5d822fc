#include "tests/measure/wheel_scene.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/pose_only.h"
#include "sim/renderer.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;
constexpr double before_mm = 500, foot_mm = 265, half_base_mm = 120;

Vector3d outwards_at(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad), 0}; }
Vector3d right_at(double angle_rad) { return {std::sin(angle_rad), -std::cos(angle_rad), 0}; }

// x to the right, y inwards, z from `from` to the foot of the sensor.
Pose looking(const Vector3d& from, double angle_rad) {
  const Vector3d z = (foot_mm * outwards_at(angle_rad) - from).normalized();
  const Vector3d x = right_at(angle_rad), y = z.cross(x).normalized();
  Pose X_WC = Pose::Identity();
  X_WC.linear().col(0) = y.cross(z);
  X_WC.linear().col(1) = y;
  X_WC.linear().col(2) = z;
  X_WC.translation() = from;
  return X_WC;
}

Vector3d station(double angle_rad, double right_mm) {
  return foot_mm * outwards_at(angle_rad) + right_mm * right_at(angle_rad) + before_mm * Vector3d::UnitZ();
}

double normal(std::mt19937_64& random, double sigma) {
  return sigma > 0 ? std::normal_distribution<double>(0, sigma)(random) : 0;
}

constexpr int plate_points = 11, plate_heights = 5;
constexpr double plate_pitch_mm = 60, plate_step_mm = 15;

struct Plate {
  std::vector<Vector3d> nominal_mm, true_mm;  // W, all heights
};

Plate plate(const PlateErrors& errors, std::mt19937_64& random) {
  Plate plate;
  std::vector<Vector3d> off;
  for (int i = 0; i < plate_points * plate_points; ++i)
    off.emplace_back(normal(random, errors.point_mm), normal(random, errors.point_mm),
                     normal(random, errors.point_mm));
  for (int h = 0; h < plate_heights; ++h) {
    const double z = plate_step_mm * (h - plate_heights / 2), z_off = normal(random, errors.stage_mm);
    for (int i = 0; i < plate_points * plate_points; ++i) {
      const double x = plate_pitch_mm * (i % plate_points - plate_points / 2),
                   y = plate_pitch_mm * (i / plate_points - plate_points / 2);
      plate.nominal_mm.emplace_back(x, y, z);
      plate.true_mm.push_back(Vector3d(x, y, z + z_off) + off[static_cast<std::size_t>(i)]);
    }
  }
  return plate;
}

CalibratedCamera calibrated(const CalibratedCamera& camera, const Plate& plate, const PlateErrors& errors,
                            std::mt19937_64& random) {
  PoseOnlyProblem problem;
  problem.model = camera.model;
  problem.model.fx_px += normal(random, errors.focal_px);
  problem.model.fy_px = problem.model.fx_px + (camera.model.fy_px - camera.model.fx_px);
  problem.model.cx_px += normal(random, errors.origin_px);
  problem.model.cy_px += normal(random, errors.origin_px);
  problem.X_WC_near = camera.X_WC;
  std::vector<CalibrationPoint> points;
  for (std::size_t i = 0; i < plate.true_mm.size(); ++i) {
    CalibrationPoint point;
    if ((camera.X_WC.inverse() * plate.true_mm[i]).z() <= 0) continue;
    point.p_W_mm = plate.nominal_mm[i];
    point.u_px = photograph(camera.model, camera.X_WC, plate.true_mm[i]);
    if (!in_image(camera.model, point.u_px)) continue;
    point.u_px += Vector2d(normal(random, errors.pixel_px), normal(random, errors.pixel_px));
    points.push_back(point);
  }
  problem.points = points;
  const PoseOnlyResult result = calibrate_pose(problem);
  if (result.status != PoseOnlyStatus::ok) throw std::runtime_error("calibration: " + result.reason);
  return {camera.name, problem.model, result.X_WC};
}

}  // namespace

WheelCell wheel_cell(const TyreShape& tyre) {
  WheelCell cell;
  cell.tyre = tyre;
  for (std::size_t s = 0; s < wheel_sensors; ++s) {
    const double angle = pi / 2 + 2 * pi / 3 * static_cast<double>(s);
    cell.angles_rad[s] = angle;
    cell.projectors[s] = wheel_projector(tyre, looking(station(angle, 0), angle), angle, cell.layout);
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t c = 2 * s + side;
      const auto n = static_cast<double>(c);
      CameraModel model{768, 572, 1452 + 3 * n, 1453 + 3 * n, 383.5 + 2 * n, 284.5 - 3 * n, Division{-0.1}};
      const double right_mm = side == 0 ? -half_base_mm : half_base_mm;
      cell.cameras[c] = {std::string("s") + std::to_string(s + 1) + (side == 0 ? " left" : " right"), model,
                         looking(station(angle, right_mm), angle)};
    }
  }
  cell.believed = cell.cameras;
  return cell;
}

Vector2d place_before(const WheelCell& cell, std::size_t sensor, double radius_mm, double right_mm) {
  const double angle = cell.angles_rad[sensor];
  return (radius_mm * outwards_at(angle) + right_mm * right_at(angle)).head<2>();
}

Pose tilted_wheel(double camber_deg, double toe_deg, const Vector3d& at_mm) {
  return from_six_numbers({at_mm.x(), at_mm.y(), at_mm.z(), camber_deg, toe_deg, 0});
}

void render_sensor(const WheelCell& cell, const Pose& X_WO, std::size_t sensor, CleanPictures& pictures) {
  TyreScene scene;
  scene.tyre = cell.tyre;
  scene.X_WO = X_WO;
  scene.projector = cell.projectors[sensor];
  scene.light = cell.light;
  scene.light.illumination = {{384, 286}, {4e-4, -3e-4}};
  scene.stains = cell.stains[sensor];
  for (std::size_t c = 2 * sensor; c < 2 * sensor + 2; ++c)
    pictures[c] = tyre_picture(scene, PixelRays(cell.cameras[c].model), cell.cameras[c].X_WC);
}

CleanPictures rendered(const WheelCell& cell, const Pose& X_WO) {
  CleanPictures pictures;
  for (std::size_t s = 0; s < wheel_sensors; ++s) render_sensor(cell, X_WO, s, pictures);
  return pictures;
}

WheelPictures exposed(const CleanPictures& clean, std::uint64_t& noise_state, double noise_grey) {
  WheelPictures pictures;
  for (std::size_t c = 0; c < wheel_cameras; ++c) {
    pictures[c].resize(clean[c].size());
    add_noise(clean[c], noise_grey, noise_state, pictures[c]);
  }
  return pictures;
}

std::vector<WheelSensor> sensors_of(const WheelCell& cell, const WheelPictures& pictures) {
  std::vector<WheelSensor> sensors;
  const auto view = [&](std::size_t c) {
    const CameraModel& model = cell.cameras[c].model;
    return ImageView{pictures[c].data(), model.width_px, model.height_px, model.width_px};
  };
  for (std::size_t s = 0; s < wheel_sensors; ++s)
    sensors.push_back({std::string("s") + std::to_string(s + 1), cell.angles_rad[s], cell.believed[2 * s],
                       cell.believed[2 * s + 1], view(2 * s), view(2 * s + 1)});
  return sensors;
}

ExpectedTyre expected(const TyreShape& tyre) {
  ExpectedTyre expected;
  expected.min_radius_mm = tyre.bead_mm - 15;
  expected.max_radius_mm = tyre.tread_mm + 15;
  return expected;
}

WheelResult measured(const WheelCell& cell, const WheelPictures& pictures, const std::optional<Pose>& X_WO0,
                     const std::optional<double>& profile_radius_mm) {
  const std::vector<WheelSensor> sensors = sensors_of(cell, pictures);
  WheelProblem problem;
  problem.sensors = sensors;
  problem.layout = cell.layout;
  problem.tyre = expected(cell.tyre);
  problem.tyre.profile_radius_mm = profile_radius_mm;
  problem.X_WO0 = X_WO0;
  return measure_wheel(problem);
}

void calibrate_on_plate(WheelCell& cell, const PlateErrors& errors, std::mt19937_64& random) {
  const Plate points = plate(errors, random);
  for (std::size_t c = 0; c < wheel_cameras; ++c)
    cell.believed[c] = calibrated(cell.cameras[c], points, errors, random);
}

}  // namespace zeropose::test
