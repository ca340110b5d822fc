// Without noise every method finds the camera again wherever it is determined (spec 30).
#include <gtest/gtest.h>

#include "calib/calibration.h"
#include "calib/linear_methods.h"
#include "calib/point_layout.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using enum Parameter;
using test::grid;
using test::looking_at_origin;

constexpr double relative = 1e-7;

struct Scene {
  CameraModel camera;
  Pose X_WC;
  std::vector<CalibrationPoint> points;
};

Scene scene(const CameraModel& camera, const Pose& X_WC, const std::vector<Eigen::Vector3d>& points) {
  std::mt19937_64 unused(1);
  return {camera, X_WC, test::photograph(camera, X_WC, points, 0, unused)};
}

CalibrationProblem problem_of(const Scene& scene) {
  CalibrationProblem problem;
  problem.points = scene.points;
  problem.width_px = scene.camera.width_px;
  problem.height_px = scene.camera.height_px;
  problem.refinement = Refinement::joint;
  if (std::holds_alternative<BrownConrady>(scene.camera.distortion)) problem.lens = LensModel::brown;
  return problem;
}

void expect_lens_near(const Distortion& found, const Distortion& truth) {
  if (const auto* lens = std::get_if<Division>(&truth)) {
    EXPECT_NEAR(std::get<Division>(found).K, lens->K, relative);
    return;
  }
  const auto &a = std::get<BrownConrady>(found), &b = std::get<BrownConrady>(truth);
  EXPECT_NEAR(a.k1, b.k1, relative);
  // Higher powers of a radius of 0.2: r^4 and r^6 take that many digits.
  EXPECT_NEAR(a.k2, b.k2, relative / 0.04);
  EXPECT_NEAR(a.p1, b.p1, relative);
  EXPECT_NEAR(a.p2, b.p2, relative);
  EXPECT_NEAR(a.k3, b.k3, relative / 0.0016);
}

void expect_camera_near(const CameraModel& model, const Pose& X_WC, const Scene& truth) {
  EXPECT_NEAR(model.fx_px, truth.camera.fx_px, relative * truth.camera.fx_px);
  EXPECT_NEAR(model.fy_px, truth.camera.fy_px, relative * truth.camera.fy_px);
  EXPECT_NEAR(model.cx_px, truth.camera.cx_px, relative * truth.camera.fx_px);
  EXPECT_NEAR(model.cy_px, truth.camera.cy_px, relative * truth.camera.fx_px);
  expect_lens_near(model.distortion, truth.camera.distortion);
  const Vector6 apart = difference(truth.X_WC, X_WC);
  EXPECT_LT(apart.head<3>().norm(), relative * truth.X_WC.translation().norm());
  EXPECT_LT(apart.tail<3>().norm(), relative);
}

void expect_recovered(const CalibrationProblem& problem, const Scene& truth) {
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  expect_camera_near(result.model, result.X_WC, truth);
  EXPECT_LT(result.rms_px, 1e-8);
}

LinearProblem linear_of(const Scene& scene) {
  LinearProblem problem;
  problem.points = scene.points;
  problem.origin_px = {scene.camera.cx_px, scene.camera.cy_px};
  return problem;
}

// Poses with the world's origin on the axis, beside it, and in the camera's own plane zc = 0.
std::vector<Pose> poses() {
  Pose axis = looking_at_origin(900, 0, 0);
  axis.translation().head<2>().setZero();
  return {axis, looking_at_origin(900, 30, 0), looking_at_origin(900, 40, 200),
          looking_at_origin(1500, -25, 77)};
}

TEST(Recovery, CoplanarFromAnyPlaneInSpace) {
  for (const double K : {-0.2, 0.0, 0.3})
    for (const Pose& X_BC : poses()) {
      CameraModel camera = test::division_camera(K);
      camera.fy_px = camera.fx_px;
      if (std::abs(X_BC.linear()(2, 2)) > 0.999) continue;  // parallel: not determined
      const Pose X_WB = from_six_numbers({4000, -2000, 900, 33, -47, 121});
      std::vector<Eigen::Vector3d> board = grid(7, 1, 40);
      for (Eigen::Vector3d& p : board) p = X_WB * p;
      const Scene truth = scene(camera, X_WB * X_BC, board);
      const PointLayout layout = layout_of(truth.points);
      ASSERT_TRUE(layout.coplanar);
      const LinearResult found = calibrate_coplanar(linear_of(truth), layout.X_WP);
      ASSERT_EQ(found.status, CalibrationStatus::ok) << found.reason;
      expect_camera_near(found.model, found.X_WC, truth);
    }
}

TEST(Recovery, NonCoplanarWhereverTheWorldsOriginLies) {
  for (const double K : {-0.2, 0.0, 0.3})
    for (const Pose& X_BC : poses())
      for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(X_BC.translation())}) {
        std::vector<Eigen::Vector3d> body = grid(4, 3, 70);
        for (Eigen::Vector3d& p : body) p -= shift;  // the second: the world's origin in the camera
        const Pose X_WC = Eigen::Translation3d(-shift) * X_BC;
        const Scene truth = scene(test::division_camera(K), X_WC, body);
        const LinearResult found = calibrate_noncoplanar(linear_of(truth));
        ASSERT_EQ(found.status, CalibrationStatus::ok) << found.reason;
        EXPECT_NEAR(found.model.fx_px, truth.camera.fx_px, relative * truth.camera.fx_px);
        EXPECT_NEAR(std::get<Division>(found.model.distortion).K, K, relative);
        EXPECT_LT(difference(X_WC, found.X_WC).head<3>().norm(), 1e-4);
      }
}

TEST(Recovery, LinearWithoutDistortion) {
  for (const Pose& X_WC : poses()) {
    const Scene truth = scene(test::division_camera(0), X_WC, grid(4, 3, 70));
    const LinearResult found = calibrate_linear(linear_of(truth));
    ASSERT_EQ(found.status, CalibrationStatus::ok) << found.reason;
    expect_camera_near(found.model, found.X_WC, truth);
  }
}

TEST(Recovery, AllParametersJointlyByBothResidualsAndModels) {
  for (const Pose& X_WC : poses()) {
    for (const Residual residual : {Residual::reprojection, Residual::algebraic}) {
      const Scene truth = scene(test::division_camera(-0.2), X_WC, grid(5, 3, 70));
      CalibrationProblem problem = problem_of(truth);
      problem.residual = residual;
      expect_recovered(problem, truth);
    }
    const Scene truth = scene(test::brown_camera(), X_WC, grid(6, 4, 65));
    expect_recovered(problem_of(truth), truth);
  }
}

TEST(Recovery, ByEveryStrategy) {
  const Scene truth = scene(test::division_camera(-0.2), looking_at_origin(900, 30, 20), grid(5, 3, 70));
  CalibrationProblem problem = problem_of(truth);
  problem.refinement = Refinement::distortion_dominant;
  const CalibrationResult by_search = calibrate(problem);
  ASSERT_EQ(by_search.status, CalibrationStatus::ok) << by_search.reason;
  // The search stops at a simplex of 1e-4 px.
  EXPECT_NEAR(by_search.model.cx_px, truth.camera.cx_px, 1e-3);
  EXPECT_NEAR(by_search.model.cy_px, truth.camera.cy_px, 1e-3);
  EXPECT_NEAR(by_search.model.fx_px, truth.camera.fx_px, 1e-3);
  problem.refinement = Refinement::none;
  problem.search_origin = true;
  const CalibrationResult linear = calibrate(problem);
  ASSERT_EQ(linear.status, CalibrationStatus::ok) << linear.reason;
  EXPECT_NEAR(linear.model.cx_px, truth.camera.cx_px, 1e-3);
}

TEST(Recovery, WithAnythingHeldAtItsTrueValue) {
  const Scene truth = scene(test::division_camera(-0.2), looking_at_origin(900, 30, 20), grid(5, 3, 70));
  for (std::size_t i = 0; i < parameter_count; ++i) {
    const auto held = static_cast<Parameter>(i);
    if (held == k1 || held == k2 || held == p1 || held == p2 || held == k3) continue;
    SCOPED_TRACE(name_of(held));
    CalibrationProblem problem = problem_of(truth);
    problem.method = CalibrationMethod::noncoplanar;  // a start far away, but for what is held
    problem.start = CalibrationStart{truth.camera, truth.X_WC};
    problem.fixed = {held};
    expect_recovered(problem, truth);
    const CalibrationResult result = calibrate(problem);
    EXPECT_EQ(result.uncertainty.parameters.size(), 10u);
  }
}

TEST(Recovery, HeldParametersDoNotMove) {
  const Scene truth = scene(test::division_camera(-0.2), looking_at_origin(900, 30, 20), grid(5, 3, 70));
  CalibrationProblem problem = problem_of(truth);
  CalibrationStart start{truth.camera, truth.X_WC};
  start.model.cx_px += 3;
  const SixNumbers six = to_six_numbers(truth.X_WC);
  start.X_WC = from_six_numbers({six.x_mm, six.y_mm + 1, six.z_mm, six.rx_deg, six.ry_deg + 0.1, six.rz_deg});
  problem.start = start;
  problem.fixed = {cx, y, ry};
  const CalibrationResult result = calibrate(problem);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_EQ(result.model.cx_px, start.model.cx_px);
  EXPECT_NEAR(to_six_numbers(result.X_WC).y_mm, six.y_mm + 1, 1e-9);
  EXPECT_NEAR(to_six_numbers(result.X_WC).ry_deg, six.ry_deg + 0.1, 1e-9);
  EXPECT_GT(result.rms_px, 0.01);
}

TEST(Recovery, ABoardParallelToTheChipWithItsDistanceGiven) {
  CameraModel camera = test::division_camera(-0.2);
  camera.fy_px = camera.fx_px;
  const Scene truth = scene(camera, looking_at_origin(900, 0, 15), grid(7, 1, 40));
  LinearProblem problem = linear_of(truth);
  const PointLayout layout = layout_of(truth.points);
  const LinearResult refused = calibrate_coplanar(problem, layout.X_WP);
  EXPECT_EQ(refused.status, CalibrationStatus::parallel_to_chip);
  problem.tz_mm = 900;
  const LinearResult found = calibrate_coplanar(problem, layout.X_WP);
  ASSERT_EQ(found.status, CalibrationStatus::ok) << found.reason;
  expect_camera_near(found.model, found.X_WC, truth);
}

TEST(Recovery, ABoardParallelToTheChipWithTheInternalsHeld) {
  const Scene truth = scene(test::division_camera(-0.2), looking_at_origin(900, 0, 15), grid(7, 1, 40));
  CalibrationProblem problem = problem_of(truth);
  problem.start = CalibrationStart{truth.camera, {}};
  problem.fixed = {fx, fy, cx, cy, K};
  expect_recovered(problem, truth);
}

TEST(Recovery, DiscsAreNotTakenForPoints) {
  const Scene plain = scene(test::division_camera(-0.2), looking_at_origin(900, 35, 20), grid(5, 3, 70));
  Scene discs = plain;
  double largest = 0;
  for (CalibrationPoint& point : discs.points) {
    point.disc_radius_mm = 20;
    point.disc_normal_W = Eigen::Vector3d::UnitZ();
    // The mean of a fine outline's centre of gravity by area: the ellipse's centre without a lens.
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double area = 0;
    constexpr int corners = 2000;
    std::vector<Eigen::Vector2d> outline;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * 3.14159265358979323846 * k / corners;
      outline.push_back(
          test::photograph(plain.camera, plain.X_WC,
                           point.p_W_mm + 20 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)));
    }
    for (int k = 0; k < corners; ++k) {
      const Eigen::Vector2d a = outline[static_cast<std::size_t>(k)] - point.u_px,
                            b = outline[static_cast<std::size_t>((k + 1) % corners)] - point.u_px;
      const double piece = 0.5 * (a.x() * b.y() - a.y() * b.x());
      sum += piece * (a + b) / 3;
      area += piece;
    }
    largest = std::max(largest, (sum / area).norm());
    point.u_px += sum / area;
  }
  EXPECT_GT(largest, 0.1);  // else there is nothing to test
  const CalibrationResult result = calibrate(problem_of(discs));
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LT(result.rms_px, 0.003);  // centre of area against centre of the best ellipse
  EXPECT_NEAR(result.model.fx_px, plain.camera.fx_px, 0.05);
  EXPECT_LT(difference(plain.X_WC, result.X_WC).head<3>().norm(), 0.05);
}

}  // namespace
}  // namespace zeropose
