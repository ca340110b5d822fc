// calibrate_views() without noise gives back what the pixels were made from.
#include <gtest/gtest.h>

#include "calib/eccentricity.h"
#include "calib/views.h"
#include "views_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::board;
using test::camera_with;
using test::Random;
using test::scene_of;
using test::ViewsScene;

const Division division{-0.21};
const BrownConrady brown{-0.21, 0.12, 0.0011, -0.0007, -0.03};

void expect_same(const CameraModel& found, const CameraModel& truth, double relative = 1e-7) {
  const Internals a = internals_of(found), b = internals_of(truth);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a[i], b[i], relative * truth.fx_px) << i;
  for (int i = 4; i < internals_count; ++i) EXPECT_NEAR(a[i], b[i], 10 * relative) << i;
}

void expect_recovered(const ViewsScene& scene, const ViewsResult& result) {
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  for (std::size_t c = 0; c < scene.models.size(); ++c) {
    SCOPED_TRACE(scene.cameras[c].name);
    expect_same(result.cameras[c].model, scene.models[c]);
    test::expect_near(result.cameras[c].X_WC, scene.X_WC[c], 1e-4, 1e-5);
  }
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    test::expect_near(result.views[v].X_WB, scene.X_WB[v], 1e-4, 1e-5);
  EXPECT_LE(result.rms_px, 1e-6);
}

std::vector<Pose> rig() {
  return {Pose::Identity(), from_six_numbers({250, 10, 20, 2, -17, 3}),
          from_six_numbers({-240, -60, 5, -4, 16, 88})};
}

TEST(ViewsRecovery, OneCameraAndABoard) {
  for (const Distortion& lens : {Distortion(division), Distortion(brown), Distortion(Division{0.15})}) {
    Random random(1);
    const ViewsScene scene = scene_of({camera_with(lens)}, {Pose::Identity()}, board(11, 20), 8, 30, random);
    expect_recovered(scene, calibrate_views(scene.problem()));
  }
}

TEST(ViewsRecovery, OneCameraAndABodyWithDepth) {
  for (const Distortion& lens : {Distortion(division), Distortion(brown)}) {
    Random random(2);
    const ViewsScene scene =
        scene_of({camera_with(lens)}, {Pose::Identity()}, board(7, 35, 90), 4, 30, random);
    expect_recovered(scene, calibrate_views(scene.problem()));
  }
}

TEST(ViewsRecovery, ARigOfThreeCamerasOfBothModels) {
  Random random(3);
  CameraModel second = camera_with(brown), third = camera_with(Division{-0.1});
  second.fx_px = second.fy_px = 1700;
  third.cx_px += 20;
  const ViewsScene scene =
      scene_of({camera_with(division), second, third}, rig(), board(9, 25), 7, 25, random);
  expect_recovered(scene, calibrate_views(scene.problem()));
}

// The first and the third camera have no view in common; the second joins them. One camera sees too little of
// a view for a pose of its own.
TEST(ViewsRecovery, ARigThatHangsTogetherByAChain) {
  Random random(4);
  const CameraModel model = camera_with(division);
  ViewsScene scene = scene_of({model, model, model}, rig(), board(9, 25), 10, 25, random);
  std::erase_if(scene.points, [](const ViewPoint& seen) {
    return (seen.camera == 0 && seen.view >= 6) || (seen.camera == 2 && seen.view < 6);
  });
  std::size_t kept = 0;
  std::erase_if(scene.points,
                [&kept](const ViewPoint& seen) { return seen.camera == 1 && seen.view == 0 && ++kept > 3; });
  expect_recovered(scene, calibrate_views(scene.problem()));
}

// Parallel boards at known places, as on a rail, are one body with depth.
TEST(ViewsRecovery, KnownPosesOfParallelBoards) {
  Random random(6);
  ViewsScene scene = scene_of({camera_with(division)}, {Pose::Identity()}, board(11, 20), 4, 0, random);
  const Pose X_WC = from_six_numbers({10, -20, 30, 3, -4, 5});
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    Pose X_CB = Pose::Identity();
    X_CB.translation() = Vector3d(-100, -90, 700 + 80.0 * static_cast<double>(v));
    scene.X_WB[v] = X_WC * X_CB;
    scene.views[v].X_WB = scene.X_WB[v];
    for (ViewPoint& seen : scene.points)
      if (seen.view == v)
        seen.point.u_px = test::independent_pixel(scene.models[0], X_CB * seen.point.p_W_mm);
  }
  scene.X_WC[0] = X_WC;
  expect_recovered(scene, calibrate_views(scene.problem()));
  scene.views[1].X_WB.reset();
  expect_recovered(scene, calibrate_views(scene.problem()));
}

TEST(ViewsRecovery, HeldParametersStayWhereTheyAre) {
  Random random(7);
  CameraModel truth = camera_with(BrownConrady{-0.2, 0.1, 0, 0, 0});
  truth.fy_px = truth.fx_px;
  ViewsScene scene = scene_of({truth}, {Pose::Identity()}, board(11, 20), 5, 30, random);
  scene.cameras[0].fixed = {Parameter::p1, Parameter::p2, Parameter::k3, Parameter::cx};
  scene.cameras[0].one_focal = true;
  scene.cameras[0].start = truth;
  scene.cameras[0].start->fx_px = scene.cameras[0].start->fy_px = 1300;
  scene.cameras[0].start->cy_px = 511.5;
  const ViewsResult result = calibrate_views(scene.problem());
  expect_recovered(scene, result);
  EXPECT_EQ(result.cameras[0].model.cx_px, truth.cx_px);
  EXPECT_EQ(result.cameras[0].model.fx_px, result.cameras[0].model.fy_px);
  const std::vector<Parameter> free{Parameter::fx, Parameter::cy, Parameter::k1, Parameter::k2};
  EXPECT_EQ(result.cameras[0].internals.parameters, free);
}

// The centre of a disc's image is not the image of its centre: here by up to 0.1 px.
TEST(ViewsRecovery, DiscsAreCorrectedForTheirEccentricity) {
  Random random(8);
  ViewsScene scene = scene_of({camera_with(division)}, {Pose::Identity()}, board(9, 25), 6, 35, random);
  double largest = 0;
  for (ViewPoint& seen : scene.points) {
    seen.point.disc_radius_mm = 9;
    seen.point.disc_normal_W = Vector3d::UnitZ();
    const Pose& X_CB = scene.X_WB[seen.view];
    const auto offset =
        ellipse_centre_offset(scene.models[0], X_CB * seen.point.p_W_mm, X_CB.linear().col(2), 9);
    seen.point.u_px += offset;
    largest = std::max(largest, offset.norm());
  }
  EXPECT_GE(largest, 0.03);
  expect_recovered(scene, calibrate_views(scene.problem()));
}

TEST(ViewsRecovery, WrongPointsAreThrownOutWorstFirst) {
  Random random(9);
  ViewsScene scene = scene_of({camera_with(division)}, {Pose::Identity()}, board(9, 25), 6, 30, random);
  const std::vector<std::size_t> wrong{7, 90, 100, 300};
  for (std::size_t k = 0; k < wrong.size(); ++k)
    scene.points[wrong[k]].point.u_px += Eigen::Vector2d(4.0 + 9.0 * static_cast<double>(k), -3);
  ViewsProblem problem = scene.problem();
  problem.reject_px = 1;
  const ViewsResult result = calibrate_views(problem);
  expect_recovered(scene, result);
  EXPECT_EQ(result.rejected, (std::vector<std::size_t>{300, 100, 90, 7}));
  for (const std::size_t index : wrong) EXPECT_FALSE(result.deviations[index].used);
  EXPECT_NEAR(result.deviations[7].dev_px.x(), 4, 1e-4);
}

TEST(ViewsRecovery, ARobustLossHoldsWrongPointsOff) {
  Random random(10);
  ViewsScene scene = scene_of({camera_with(division)}, {Pose::Identity()}, board(9, 25), 6, 30, random);
  for (const std::size_t index : {7u, 90u, 100u, 300u})
    scene.points[index].point.u_px += Eigen::Vector2d(30, -20);
  ViewsProblem problem = scene.problem();
  problem.robust = 0.1;
  const ViewsResult robust = calibrate_views(problem);
  problem.robust = 0;
  const ViewsResult plain = calibrate_views(problem);
  ASSERT_EQ(robust.status, CalibrationStatus::ok) << robust.reason;
  ASSERT_EQ(plain.status, CalibrationStatus::ok) << plain.reason;
  // A wrong point pulls with loss^2 / deviation instead of deviation: 1e-5 of 36 px.
  EXPECT_NEAR(robust.cameras[0].model.fx_px, scene.models[0].fx_px, 0.05);
  EXPECT_GE(std::abs(plain.cameras[0].model.fx_px - scene.models[0].fx_px), 0.5);
}

TEST(ViewsRecovery, ProgressIsReported) {
  Random random(11);
  const ViewsScene scene = scene_of({camera_with(division)}, {Pose::Identity()}, board(9, 25), 6, 30, random);
  ViewsProblem problem = scene.problem();
  int calls = 0;
  double last = 0;
  problem.progress = [&](int, double cost) { ++calls, last = cost; };
  const ViewsResult result = calibrate_views(problem);
  EXPECT_GE(calls, 3);
  EXPECT_LE(calls, result.iterations);
  EXPECT_LE(last, 1e-9);
}

}  // namespace
}  // namespace zeropose
