// A camera that does not share project() with the code under test: the division model by bisection of (E1),
// Brown-Conrady by OpenCV.
#pragma once

#include <random>
#include <vector>

#include "calib/calibration.h"

namespace zeropose::test {

// The pixel of p_W. Throws std::runtime_error where there is none.
Eigen::Vector2d photograph(const CameraModel& camera, const Pose& X_WC, const Eigen::Vector3d& p_W_mm);

// The points as that camera sees them, with normal noise of sigma_px on every coordinate.
std::vector<CalibrationPoint> photograph(const CameraModel& camera, const Pose& X_WC,
                                         const std::vector<Eigen::Vector3d>& points_W_mm, double sigma_px,
                                         std::mt19937_64& random);

// n x n x layers points at distances of pitch_mm about the origin, z upwards.
std::vector<Eigen::Vector3d> grid(int n, int layers, double pitch_mm);

// 768 x 572, f about 2000 px, origin off the centre.
CameraModel division_camera(double K);
CameraModel brown_camera();

// Looks at the origin from `distance_mm`, tilted by `tilt_deg` against the z axis and turned about it.
Pose looking_at_origin(double distance_mm, double tilt_deg, double turn_deg);

}  // namespace zeropose::test
