// A wheel before three stereo sensors at 120 degrees, as it is and as it is believed to be.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "measure/wheel.h"
#include "sim/wheel_object.h"

namespace zeropose::test {

inline constexpr std::size_t wheel_sensors = 3, wheel_cameras = 6;

// A sensor stands 500 mm before the middle of the side wall, its projector between two cameras 240 mm apart,
// the base line across the radial lines.
struct WheelCell {
  TyreShape tyre;
  TyreLight light;
  std::array<double, wheel_sensors> angles_rad{};
  std::array<LineProjector, wheel_sensors> projectors;
  std::array<std::vector<TyreStain>, wheel_sensors> stains;
  std::array<CalibratedCamera, wheel_cameras>
      cameras;  // left, right of the first sensor and so on: as they are
  std::array<CalibratedCamera, wheel_cameras> believed;  // as calibrated
  LineLayout layout;
};

// Three radial lines 8 degrees apart and three across, the middle one of which is the control line, for the
// size of the tyre. Cameras of 768 x 572 px with about 0.35 mm per px. believed: the truth.
WheelCell wheel_cell(const TyreShape& tyre);

// Lines of a projector in wheel_cell(): the radial ones left to right, then those across from outside.
inline constexpr std::size_t first_across = 3;

// A place on the wheel's plane: sensor, radius, and mm to the right of its middle radial line.
Eigen::Vector2d place_before(const WheelCell& cell, std::size_t sensor, double radius_mm, double right_mm);

// The wheel tilted about x (camber) and y (toe) of W, then moved.
Pose tilted_wheel(double camber_deg, double toe_deg, const Eigen::Vector3d& at_mm = Eigen::Vector3d::Zero());

using CleanPictures = std::array<std::vector<float>, wheel_cameras>;
using WheelPictures = std::array<std::vector<std::uint8_t>, wheel_cameras>;
CleanPictures rendered(const WheelCell& cell, const Pose& X_WO);
void render_sensor(const WheelCell& cell, const Pose& X_WO, std::size_t sensor, CleanPictures& pictures);
WheelPictures exposed(const CleanPictures& clean, std::uint64_t& noise_state, double noise_grey = 2);

// Borrows the pictures.
std::vector<WheelSensor> sensors_of(const WheelCell& cell, const WheelPictures& pictures);
ExpectedTyre expected(const TyreShape& tyre);

// One exposure, measured.
WheelResult measured(const WheelCell& cell, const WheelPictures& pictures,
                     const std::optional<Pose>& X_WO0 = {},
                     const std::optional<double>& profile_radius_mm = {});

// Errors of the calibration: every camera from the points of one plate of 11 x 11 at 60 mm that it sees, with
// the plate at heights that a stage sets; internals as a laboratory found them.
struct PlateErrors {
  double pixel_px = 0.05;                  // of a found point
  double point_mm = 0.02;                  // of a coordinate on the plate, the same for all sensors
  double stage_mm = 0.02;                  // of a height
  double focal_px = 0.5, origin_px = 0.5;  // of the laboratory's internals
};
void calibrate_on_plate(WheelCell& cell, const PlateErrors& errors, std::mt19937_64& random);

}  // namespace zeropose::test
