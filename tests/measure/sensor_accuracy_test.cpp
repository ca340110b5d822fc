// How well a stereo sensor of two 6 mm lenses measures points 200 to 600 mm away, after its calibration with
// a glass board on a stage (spec 40 P1, 70 window-pane; published: 0.05 mm in x and y, 0.1 mm in z).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "measure/triangulation.h"
#include "tests/calib/views_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double noise_px = 0.02;  // of a mark, as in the budgets of docs/cells.md
constexpr int calibrations = 60;
const std::vector<double> distances_mm{200, 300, 400, 500, 600};

// The cameras 200 mm apart, their axes meeting 400 mm before them; S is the board's frame at the first step.
std::vector<CameraModel> models() {
  return {{768, 572, 723.4, 723.1, 388.2, 281.6, Division{-0.11}},
          {768, 572, 722.2, 722.6, 380.9, 289.3, Division{-0.105}}};
}
constexpr double first_mm = 220;
std::vector<Pose> cameras_in_sensor() {
  return {from_six_numbers({-100.3, 0.4, -first_mm, 0.2, 13.9, -0.3}),
          from_six_numbers({100.1, -0.3, -first_mm + 0.8, -0.1, -14.1, 0.3})};
}

std::vector<CalibratedCamera> calibrated(double stage_mm, test::Random& random) {
  constexpr int steps = 7;
  std::vector<Vector3d> glass;
  for (int row = -2; row <= 2; ++row)
    for (int col = -2; col <= 2; ++col) glass.emplace_back(28 * col, 28 * row, 0);
  std::vector<Pose> X_SB;
  for (int k = 0; k < steps; ++k)
    X_SB.push_back(from_six_numbers({0, 0, stage_mm * k / (steps - 1), 0, 0, 0}));
  test::ViewsScene scene = test::scene_at(models(), cameras_in_sensor(), glass, X_SB);
  for (std::size_t v = 0; v < X_SB.size(); ++v) scene.views[v].X_WB = X_SB[v];
  test::add_noise(scene, noise_px, random);
  ViewsProblem problem = scene.problem();
  problem.sigma_px = noise_px;
  const ViewsResult result = calibrate_views(problem);
  EXPECT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  std::vector<CalibratedCamera> cameras;
  for (const auto& camera : result.cameras) {
    cameras.emplace_back();
    cameras.back().model = camera.model;
    cameras.back().X_WC = camera.X_WC;
  }
  return cameras;
}

// Of one axis: how far the points of one distance are off.
struct Errors {
  Vector3d squares = Vector3d::Zero(), worst = Vector3d::Zero();
  int count = 0;
  void add(const Vector3d& error) {
    squares += error.cwiseAbs2();
    worst = worst.cwiseMax(error.cwiseAbs());
    ++count;
  }
  Vector3d rms() const { return (squares / count).cwiseSqrt(); }
};

// Nine points at the distance from the cameras, as far out as both see them.
std::vector<Vector3d> points_at(double distance_mm) {
  const double half_mm = 0.16 * distance_mm;
  std::vector<Vector3d> points;
  for (const double x : {-half_mm, 0.0, half_mm})
    for (const double y : {-half_mm, 0.0, half_mm}) points.emplace_back(x, y, distance_mm - first_mm);
  return points;
}

void measure_points(const std::vector<CalibratedCamera>& believed, double distance_mm, test::Random& random,
                    Errors& errors) {
  std::normal_distribution<double> noise(0, noise_px);
  const auto true_models = models();
  const auto X_SC = cameras_in_sensor();
  for (const Vector3d& p_S : points_at(distance_mm)) {
    std::vector<Observation> seen;
    for (std::size_t c = 0; c < believed.size(); ++c) {
      Observation observation;
      observation.camera = c;
      observation.u_px = test::independent_pixel(true_models[c], X_SC[c].inverse() * p_S);
      observation.u_px += Vector2d(noise(random), noise(random));
      observation.covariance_px2 = noise_px * noise_px * Eigen::Matrix2d::Identity();
      ASSERT_GT(observation.u_px.minCoeff(), 5);
      ASSERT_LT(observation.u_px.x(), 763);
      ASSERT_LT(observation.u_px.y(), 567);
      seen.push_back(observation);
    }
    const TriangulatedPoint point = triangulate({believed, seen, 0.05});
    ASSERT_EQ(point.code, Code::ok) << point.reason;
    errors.add(point.p_W_mm - p_S);
  }
}

// By distance.
std::vector<Errors> table(double stage_mm) {
  test::Random random(17);
  std::vector<Errors> errors(distances_mm.size());
  for (int calibration = 0; calibration < calibrations; ++calibration) {
    const auto believed = calibrated(stage_mm, random);
    for (std::size_t i = 0; i < distances_mm.size(); ++i)
      measure_points(believed, distances_mm[i], random, errors[i]);
  }
  std::printf("  stage of %g mm: distance, RMS x y z, worst x y z, mm\n", stage_mm);
  for (std::size_t i = 0; i < distances_mm.size(); ++i) {
    const Vector3d rms = errors[i].rms(), worst = errors[i].worst;
    std::printf("  %4.0f   %.4f %.4f %.4f   %.4f %.4f %.4f\n", distances_mm[i], rms.x(), rms.y(), rms.z(),
                worst.x(), worst.y(), worst.z());
  }
  return errors;
}

TEST(SensorAccuracy, OverTheWholeRangeIsBetterThanPublishedWhereTheStageReaches) {
  const std::vector<Errors> far = table(380), near = table(36);
  for (const Errors& errors : far) {
    EXPECT_LT(errors.rms().x(), 0.05);
    EXPECT_LT(errors.rms().y(), 0.05);
    EXPECT_LT(errors.rms().z(), 0.1);
  }
  // A board that was moved by 36 mm only tells little of points that are 400 mm beyond it.
  EXPECT_GT(near.back().rms().z(), far.back().rms().z());
}

}  // namespace
}  // namespace zeropose
