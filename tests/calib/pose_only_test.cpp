// Cameras put up on site (spec 40 P4): the published example, recovery from any start, wrong points,
// degenerate layouts, honest covariances.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/pose_only.h"
#include "calib/three_points.h"
#include "tests/support/csv.h"
#include "tests/support/poses.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::CsvTable;
using test::expect_near;
using test::Random;
using testing::ElementsAre;
using testing::HasSubstr;

// --- Tables 4.9, 4.10

struct Published {
  PoseOnlyProblem problem;
  std::vector<CalibrationPoint> points;
  std::vector<HousingFeature> features;
  Pose X_WC = Pose::Identity();
};

std::vector<double> numbers(const CsvTable& table, std::size_t row) {
  std::vector<double> values;
  for (const char* column : {"a", "b", "c", "d", "e", "f"}) values.push_back(table.number(row, column));
  return values;
}

Published published(const std::string& internals, const std::string& result) {
  const CsvTable table("tests/golden/pose-reference-points.csv");
  Published example;
  Vector3d p_CF = Vector3d::Zero();
  for (std::size_t row = 0; row < table.size(); ++row) {
    const auto v = numbers(table, row);
    const std::string& kind = table.text(row, "kind");
    if (kind == internals) example.problem.model = {768, 572, v[0], v[1], v[2], v[3], Division{v[4]}};
    if (kind == "feature-in-camera-xyz") p_CF = {v[0], v[1], v[2]};
    if (kind == "point-u-v-x-y-z")
      example.points.push_back(
          {{v[2], v[3], v[4]}, {v[0], v[1]}, Eigen::Matrix2d::Identity(), 0, Vector3d::Zero()});
    if (kind == result) example.X_WC = from_six_numbers({v[0], v[1], v[2], v[3], v[4], v[5]});
  }
  // Table 4.9 does not print where the tracker saw the feature; it follows from its first line, the camera's
  // pose.
  for (std::size_t row = 0; row < table.size(); ++row)
    if (table.text(row, "kind") == "camera-pose-X_WC") {
      const auto v = numbers(table, row);
      const Pose X_WC = from_six_numbers({v[0], v[1], v[2], v[3], v[4], v[5]});
      example.features = {{p_CF, X_WC * p_CF, 0.02}};
    }
  return example;
}

TEST(PoseOnly, TablesFourPointTenWithItsInternals) {
  Published example = published("internals-fx-fy-cx-cy-K", "result-with-internals-X_WC");
  example.problem.points = example.points;
  example.problem.features = example.features;
  example.problem.residual = Residual::algebraic;
  const PoseOnlyResult result = calibrate_pose(example.problem);
  ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
  test::expect_six_near(to_six_numbers(result.X_WC), to_six_numbers(example.X_WC), 0.01, 0.005);
}

// --- recovery

std::vector<CameraModel> both_lenses() { return {test::division_camera(-0.2), test::brown_camera()}; }

// Points in a box before the camera, which looks at it from anywhere.
std::vector<Vector3d> box_points(std::size_t count, Random& random) {
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) points.push_back(test::uniform_vector(random, 250));
  return points;
}

Pose looking_at_box(Random& random) {
  return test::looking_at_origin(test::uniform(random, 1800, 2600), test::uniform(random, 0, 60),
                                 test::uniform(random, -180, 180));
}

TEST(ThreePoints, OneOfThePosesIsTheTrueOne) {
  Random random(1);
  int found = 0;
  constexpr int trials = 500;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose X_WC = looking_at_box(random);
    const auto points = box_points(3, random);
    std::array<Vector3d, 3> p_W{points[0], points[1], points[2]}, d_C;
    for (std::size_t i = 0; i < 3; ++i) d_C[i] = X_WC.inverse() * p_W[i];
    double nearest = 1e9;
    const auto poses = poses_from_three(p_W, d_C);
    EXPECT_LE(poses.size(), 4u);
    for (const Pose& pose : poses) nearest = std::min(nearest, difference(X_WC, pose).norm());
    found += nearest < 1e-3;
  }
  // Where two solutions all but coincide the quartic loses half of its digits: a good start, no more.
  EXPECT_GE(found, trials * 98 / 100);
}

TEST(PoseOnly, PointsAloneFromNowhereNoiseFree) {
  Random random(2);
  for (const CameraModel& model : both_lenses())
    for (const std::size_t count : {5u, 6u, 12u})
      for (int trial = 0; trial < 30; ++trial) {
        const Pose X_WC = looking_at_box(random);
        const auto points = test::photograph(model, X_WC, box_points(count, random), 0, random);
        PoseOnlyProblem problem;
        problem.model = model;
        problem.points = points;
        const PoseOnlyResult result = calibrate_pose(problem);
        ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
        expect_near(result.X_WC, X_WC, 1e-5, 1e-6);
        EXPECT_LT(result.rms_px, 1e-7);
      }
}

TEST(PoseOnly, OneFeatureAndTwoPointsNoiseFree) {
  Random random(3);
  for (const CameraModel& model : both_lenses())
    for (int trial = 0; trial < 30; ++trial) {
      const Pose X_WC = looking_at_box(random);
      const auto points = test::photograph(model, X_WC, {{-200, 30, 50}, {180, -60, -100}}, 0, random);
      const Vector3d p_CF(-30.6, 21.76, -7.26);
      const std::vector<HousingFeature> features{{p_CF, X_WC * p_CF, 0.02}};
      PoseOnlyProblem problem;
      problem.model = model;
      problem.points = points;
      problem.features = features;
      const PoseOnlyResult result = calibrate_pose(problem);
      ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
      expect_near(result.X_WC, X_WC, 1e-5, 1e-6);
    }
}

TEST(PoseOnly, FrameworkIsTheBestFit) {
  Random random(4);
  const Pose X_WC = looking_at_box(random);
  std::vector<HousingFeature> features;
  for (const Vector3d& p_CF : {Vector3d(30, 20, -10), Vector3d(-30, 20, -12), Vector3d(0, -25, -40)})
    features.push_back({p_CF, X_WC * p_CF, 0.02});
  PoseOnlyProblem problem;
  problem.model = test::division_camera(0);
  problem.features = features;
  const PoseOnlyResult result = calibrate_pose(problem);
  ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
  expect_near(result.X_WC, X_WC, 1e-9, 1e-9);
  EXPECT_EQ(result.redundancy, 3);
  features[2].p_C_mm = 2 * features[1].p_C_mm - features[0].p_C_mm;
  EXPECT_EQ(calibrate_pose(problem).status, PoseOnlyStatus::collinear);
}

// --- what must not give a pose

struct Scene {
  CameraModel model = test::division_camera(-0.2);
  Pose X_WC = test::looking_at_origin(2200, 25, 40);
  std::vector<CalibrationPoint> points;
  PoseOnlyResult solve(double sigma_px = 0) const {
    PoseOnlyProblem problem;
    problem.model = model;
    problem.points = points;
    problem.sigma_px = sigma_px;
    return calibrate_pose(problem);
  }
};

Scene scene_of(std::size_t count, double sigma_px, Random& random) {
  Scene scene;
  scene.points = test::photograph(scene.model, scene.X_WC, box_points(count, random), sigma_px, random);
  return scene;
}

TEST(PoseOnly, AWrongPointIsNamedFromFiveOn) {
  Random random(5);
  for (const double known_sigma_px : {0.0, 0.05})
    for (const std::size_t count : {6u, 8u}) {
      Scene scene = scene_of(count, 0.05, random);
      scene.points[2].p_W_mm += scene.X_WC.linear() * Vector3d(8, -6, 0);  // 10 mm across the line of sight
      const PoseOnlyResult result = scene.solve(known_sigma_px);
      ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
      EXPECT_THAT(result.removed, ElementsAre(2u));
      EXPECT_FALSE(result.deviations[2].used);
      EXPECT_LT(test::distance_mm(result.X_WC, scene.X_WC), 3);
    }
}

TEST(PoseOnly, WithFourPointsNobodyKnowsWhichIsWrong) {
  Random random(6);
  Scene scene = scene_of(4, 0.05, random);
  scene.points[1].u_px += Eigen::Vector2d(40, -25);
  const PoseOnlyResult result = scene.solve(0.05);
  EXPECT_NE(result.status, PoseOnlyStatus::ok);
  EXPECT_THAT(result.removed, testing::IsEmpty());
}

TEST(PoseOnly, DegenerateLayoutsAreNamed) {
  Random random(7);
  Scene scene = scene_of(3, 0, random);
  EXPECT_EQ(scene.solve().status, PoseOnlyStatus::too_few_points);
  EXPECT_THAT(scene.solve().reason, HasSubstr("needs 4"));
  scene.points = test::photograph(
      scene.model, scene.X_WC, {{-150, 0, 0}, {-50, 0, 0}, {20, 0, 0}, {80, 0, 0}, {160, 0, 0}}, 0, random);
  EXPECT_EQ(scene.solve().status, PoseOnlyStatus::collinear);
  scene = scene_of(5, 0, random);
  scene.points[3].u_px.x() = std::nan("");
  EXPECT_EQ(scene.solve().status, PoseOnlyStatus::not_finite);
  EXPECT_THAT(scene.solve().reason, HasSubstr("point 4"));
  scene = scene_of(5, 0, random);
  scene.points[0].covariance_px2 << 1, 2, 2, 1;
  EXPECT_EQ(scene.solve().status, PoseOnlyStatus::wrong_problem);
}

TEST(PoseOnly, PointsInOneDirectionFromTheFeatureLeaveTheTurnOpen) {
  const CameraModel model = test::division_camera(0);
  const Pose X_WC = Pose::Identity();
  const Vector3d p_CF(0, 0, -10), d(0.02, 0.01, 1);
  std::vector<CalibrationPoint> points(2);
  for (std::size_t i = 0; i < 2; ++i) {
    points[i].p_W_mm = p_CF + (2000 + 700 * static_cast<double>(i)) * d;
    points[i].u_px = test::photograph(model, X_WC, points[i].p_W_mm);
  }
  const std::vector<HousingFeature> features{{p_CF, p_CF, 0.02}};
  PoseOnlyProblem problem;
  problem.model = model;
  problem.points = points;
  problem.features = features;
  problem.sigma_px = 0.1;
  EXPECT_EQ(calibrate_pose(problem).status, PoseOnlyStatus::not_determined);
}

// --- honest covariance

// 95 % of chi-square with six degrees of freedom.
constexpr double ellipsoid_95 = 12.592;

TEST(PoseOnly, CovarianceWithAFeatureIsHonest) {
  Random random(8);
  const CameraModel model = test::division_camera(-0.2);
  const Pose X_WC = test::looking_at_origin(2200, 25, 40);
  const Vector3d p_CF(-30.6, 21.76, -7.26);
  const auto places = box_points(4, random);
  constexpr double sigma_px = 0.08, sigma_mm = 0.05;
  constexpr int trials = 1000;
  int inside = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto points = test::photograph(model, X_WC, places, sigma_px, random);
    Vector3d p_WF = X_WC * p_CF;
    for (int k = 0; k < 3; ++k) p_WF(k) += test::normal(random, sigma_mm);
    const std::vector<HousingFeature> features{{p_CF, p_WF, sigma_mm}};
    PoseOnlyProblem problem;
    problem.model = model;
    problem.points = points;
    problem.features = features;
    problem.sigma_px = sigma_px;
    problem.reject_wrong_points = false;
    const PoseOnlyResult result = calibrate_pose(problem);
    ASSERT_EQ(result.status, PoseOnlyStatus::ok) << result.reason;
    const Vector6 error = difference(X_WC, result.X_WC);
    inside += error.dot(result.covariance.ldlt().solve(error)) < ellipsoid_95;
  }
  // Three standard deviations of the count are 2 %.
  EXPECT_NEAR(inside, 0.95 * trials, 0.02 * trials);
}

}  // namespace
}  // namespace zeropose
