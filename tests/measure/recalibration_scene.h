// A camera of 35 mm before and after it was knocked, and the fixed points that it sees (Table 5.9).
#pragma once

#include <string>
#include <vector>

#include "measure/recalibration.h"
#include "tests/support/poses.h"

namespace zeropose::test {

// f = 4200 px, 768 x 572.
CameraModel long_lens(const Distortion& distortion);
Pose long_lens_pose();  // X_WCo

struct FixedPoint {
  std::string name, group;
  Eigen::Vector3d p_Co_mm = Eigen::Vector3d::Zero();  // where it is, in the old camera
  Eigen::Vector3d p_G_mm = Eigen::Vector3d::Zero();   // inside its group
};

// At the pixel and so far along the old camera's axis (pinhole: the layout is the same for every lens).
FixedPoint point_at(const std::string& name, double u_px, double v_px, double z_mm);
// A plate: three points `size_mm` apart round the pixel, tilted; with its own frame.
std::vector<FixedPoint> plate(const std::string& group, double u_px, double v_px, double z_mm, double size_mm,
                              double tilt_deg, int points = 3);

struct KnockedCamera {
  CameraModel model;
  Pose X_WCo = long_lens_pose();
  Pose X_CoCn = Pose::Identity();
  std::vector<FixedPoint> layout;

  // As seen before and after, with noise on every pixel. Coordinates are those that the method knows.
  std::vector<RecalibrationPoint> see(RecalibrationMethod method, double sigma_px, Random& random) const;
  RecalibrationResult recalibrated(RecalibrationMethod method, double sigma_px, Random& random) const;
};

// recalibrate() of such points; sigma_px 0: as if nobody knew the noise.
RecalibrationResult recalibrated(const KnockedCamera& camera, RecalibrationMethod method,
                                 std::span<const RecalibrationPoint> points, double sigma_px);

// The Cramer-Rao bound of X_CoCn for independent noise of sigma_px on every coordinate: the top left 6 x 6 of
// the inverse of the Fisher information of all unknowns, by finite differences of an independent camera.
// arbitrary points: of the rotation alone (3 x 3), for a camera that only turned.
Eigen::MatrixXd cramer_rao(const KnockedCamera& camera, RecalibrationMethod method, double sigma_px);

// The layouts of docs/recalibration.md.
std::vector<FixedPoint> three_points();
std::vector<FixedPoint> six_points(double near_mm, double far_mm);
std::vector<FixedPoint> two_plates();

}  // namespace zeropose::test
