// From a picture of the calibration body to the camera: find, number, calibrate, compare with the truth.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/calibration.h"
#include "measure/body.h"
#include "tests/support/body_scene.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::BodyScene;

std::vector<CalibrationPoint> points_of(const std::vector<BodyMark>& marks, const BodyResult& found) {
  std::vector<CalibrationPoint> points;
  for (const BodyPoint& point : found.points)
    points.push_back({marks[point.mark].p_B_mm, point.u_px, point.covariance_px2, marks[point.mark].radius_mm,
                      point.normal_B});
  return points;
}

// The four cameras of Table 4.7 with their internals and poses, the body's marks as discs of 9 mm radius. The
// covariances of the finder carry the tolerance: all eleven numbers together lie within the ellipsoid that
// holds them but once in a thousand (31.26).
class BodyCalibration : public testing::TestWithParam<std::size_t> {};

TEST_P(BodyCalibration, PictureToCamera) {
  const test::CsvTable table("tests/golden/camera-in-body.csv");
  const std::size_t row = GetParam();
  BodyScene scene;
  scene.radius_mm = 9;
  scene.noise_grey = 2;  // well above what the finder's model leaves, 0.01 px
  scene.seed = 20 + row;
  scene.camera = {768,
                  572,
                  table.number(row, "fx_px"),
                  table.number(row, "fy_px"),
                  table.number(row, "cx_px"),
                  table.number(row, "cy_px"),
                  Division{table.number(row, "K")}};
  const Pose X_BC = test::pose(table, row);
  scene.X_CB = X_BC.inverse();
  const test::Pixels picture = photograph(scene);
  const std::vector<BodyMark> marks = scene.marks();
  BodyProblem problem;
  problem.marks = marks;
  problem.focal_px = 4000;
  const BodyResult found = find_body(picture.view(), problem);
  ASSERT_EQ(found.status, BodyStatus::found) << found.reason;
  const std::vector<CalibrationPoint> points = points_of(marks, found);
  CalibrationProblem calibration;
  calibration.points = points;
  calibration.width_px = 768;
  calibration.height_px = 572;
  calibration.sigma_px = 1;
  calibration.refinement = Refinement::joint;
  const CalibrationResult camera = calibrate(calibration);
  ASSERT_EQ(camera.status, CalibrationStatus::ok) << camera.reason;
  ASSERT_EQ(camera.uncertainty.parameters.size(), 11u);
  EXPECT_LT(camera.rms_px, 0.1);
  Eigen::VectorXd off(11);
  const Vector6 pose_off = difference(X_BC, camera.X_WC);
  const Internals internals_off = internals_of(camera.model) - internals_of(scene.camera);
  for (Eigen::Index k = 0; k < 11; ++k) {
    const Parameter parameter = camera.uncertainty.parameters[std::size_t(k)];
    switch (parameter) {
      case Parameter::fx:
        off(k) = internals_off(0);
        break;
      case Parameter::fy:
        off(k) = internals_off(1);
        break;
      case Parameter::cx:
        off(k) = internals_off(2);
        break;
      case Parameter::cy:
        off(k) = internals_off(3);
        break;
      case Parameter::K:
        off(k) = internals_off(4);
        break;
      default:
        off(k) = pose_off(int(parameter) - int(Parameter::x));
    }
  }
  EXPECT_LT(off.dot(camera.uncertainty.covariance.ldlt().solve(off)), 31.26) << table.text(row, "camera");
}

INSTANTIATE_TEST_SUITE_P(Tables, BodyCalibration, testing::Range(std::size_t{0}, std::size_t{4}));

}  // namespace
}  // namespace zeropose
