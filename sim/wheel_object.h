// A wheel before three stereo sensors and their projectors: what is true about them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/camera_model.h"
#include "config/cell.h"
#include "sim/tyre_look.h"

namespace zeropose {

// One sensor of the cell.
struct WheelSensorTruth {
  std::string name;
  double angle_rad = 0;             // as in the job
  std::size_t left = 0, right = 0;  // cameras of the cell
  LineProjector projector;          // where it is; it stands halfway between the cameras
};

// Its origin lies in the plane of the profile that the sensors are expected to choose.
struct WheelObject {
  TyreShape tyre;
  double profile_mm = 0;                    // height of that profile over z = 0 of the tyre
  std::vector<WheelSensorTruth> sensors{};  // from the cell
};

// Three radial lines 8 degrees apart and those across them, laid beside the ridges and grooves of the tyre:
// radial ones left to right, then those across from outside. Only the control line reaches the right radial
// one. X_NP: the projector as the nominal wheel sees it, x to the right, y inwards, z to the side wall.
LineProjector wheel_projector(const TyreShape& tyre, const Pose& X_NP, double angle_rad,
                              const LineLayout& layout);

// Fills in what the cell says; the true cameras. Throws ConfigError for a job without a wheel, or one with
// another number of lines than the projectors draw.
void complete(WheelObject& object, const Job& job, std::span<const CalibratedCamera> cameras);

// What may be wrong before a sensor: NAME KIND NUMBER.
//   dirt  spots of mud on the side wall; the number draws them
//   line  so many of the projector's lines, counted from 1, is dark
struct WheelFault {
  std::size_t sensor = 0;  // index
  std::string kind;
  std::uint64_t number = 0;
};
// nullopt: no such sensor, kind or line.
std::optional<WheelFault> wheel_fault(const WheelObject& object, const std::string& text);

}  // namespace zeropose
