// A calibration as wrong as in practice: what a daemon believes about cameras whose truth the simulator
// knows.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/camera_model.h"

namespace zeropose {

// One sigma of the normally distributed errors.
struct CalibrationErrors {
  double position_mm = 0.5;      // of the optical centre, per axis of W
  double rotation_deg = 0.02;    // about the optical centre, per axis of W
  double focal_length = 0.0005;  // relative, common to fx and fy
  double image_origin_px = 4.5;  // per axis
};

// The cameras of `truth` with errors. Every camera takes nine normal draws of Random(seed), cameras in the
// given order: position x y z, rotation x y z, focal length, image origin u v. Names, sizes and distortion
// stay.
std::vector<CalibratedCamera> wrong_calibration(std::span<const CalibratedCamera> truth,
                                                const CalibrationErrors& sigma, std::uint64_t seed);

}  // namespace zeropose
