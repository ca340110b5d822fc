// What calibrate_views() cannot answer it names, without numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "calib/views.h"
#include "views_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Random;
using test::ViewsScene;
using testing::Contains;
using testing::HasSubstr;
using Status = CalibrationStatus;

const CameraModel model = test::camera_with(Division{-0.2});
const Pose X_WC2 = from_six_numbers({250, 10, 20, 2, -17, 3});

ViewsScene good(std::size_t views = 4, double tilt_deg = 30) {
  Random random(31);
  return test::scene_of({model}, {Pose::Identity()}, test::board(7, 35), views, tilt_deg, random);
}

ViewsScene good_rig() {
  Random random(32);
  return test::scene_of({model, model}, {Pose::Identity(), X_WC2}, test::board(7, 35), 4, 30, random);
}

// Boards at these poses instead.
ViewsScene with_poses(const std::vector<Pose>& X_CB) {
  ViewsScene scene = good(X_CB.size());
  scene.X_WB = X_CB;
  for (ViewPoint& seen : scene.points)
    seen.point.u_px = test::independent_pixel(model, X_CB[seen.view] * seen.point.p_W_mm);
  return scene;
}

void expect_named(const ViewsProblem& problem, Status status, const std::string& reason) {
  const ViewsResult result = calibrate_views(problem);
  EXPECT_EQ(result.status, status) << name_of(result.status) << ": " << result.reason;
  EXPECT_THAT(result.reason, HasSubstr(reason));
  EXPECT_TRUE(result.cameras.empty());
  EXPECT_TRUE(result.views.empty());
  EXPECT_TRUE(result.deviations.empty());
}
void expect_named(const ViewsScene& scene, Status status, const std::string& reason) {
  expect_named(scene.problem(), status, reason);
}

TEST(ViewsDegenerate, TheSceneItselfIsFine) {
  EXPECT_EQ(calibrate_views(good().problem()).status, Status::ok);
  EXPECT_EQ(calibrate_views(good_rig().problem()).status, Status::ok);
}

TEST(ViewsDegenerate, BoardsParallelToTheChip) {
  std::vector<Pose> X_CB;
  for (int v = 0; v < 5; ++v)
    X_CB.push_back(from_six_numbers({-100.0 - 10 * v, -90.0 + 5 * v, 700.0 + 50 * v, 0, 0, 0.3 * v}));
  expect_named(with_poses(X_CB), Status::parallel_to_chip, "parallel to the chip");
}

TEST(ViewsDegenerate, BoardsNearlyParallelToTheChipWithNoise) {
  std::vector<Pose> X_CB;
  for (int v = 0; v < 5; ++v)
    X_CB.push_back(
        from_six_numbers({-100.0 - 10 * v, -90.0 + 5 * v, 700.0 + 50 * v, 0.3, -0.2 * v, 20.0 * v}));
  ViewsScene scene = with_poses(X_CB);
  Random random(33);
  test::add_noise(scene, 0.1, random);
  expect_named(scene, Status::parallel_to_chip, "parallel to the chip");
}

// Tilted, but all alike: the two conditions of one plane, again and again. Without distortion (held at 0)
// nothing else is there.
TEST(ViewsDegenerate, BoardsParallelToEachOther) {
  std::vector<Pose> X_CB;
  for (int v = 0; v < 5; ++v)
    X_CB.push_back(from_six_numbers({-100.0 - 10 * v, -90.0 + 5 * v, 700.0 + 50 * v, 20, 0, 0}));
  ViewsScene scene = with_poses(X_CB);
  CameraModel pinhole = model;
  pinhole.distortion = Division{0};
  for (ViewPoint& seen : scene.points)
    seen.point.u_px = test::independent_pixel(pinhole, X_CB[seen.view] * seen.point.p_W_mm);
  scene.cameras[0].fixed = {Parameter::K};
  expect_named(scene, Status::not_determined, "parallel to each other");
}

TEST(ViewsDegenerate, TooFewViewsOfAPlane) {
  ViewsScene scene = good(1);
  for (ViewPoint& seen : scene.points) {
    CameraModel pinhole = model;
    pinhole.distortion = Division{0};
    seen.point.u_px = test::independent_pixel(pinhole, scene.X_WB[0] * seen.point.p_W_mm);
  }
  scene.cameras[0].fixed = {Parameter::K};
  expect_named(scene, Status::not_determined, "too few views");
  // With the origin held and one focal length one tilted board is enough.
  scene.cameras[0].fixed = {Parameter::K, Parameter::cx, Parameter::cy};
  scene.cameras[0].one_focal = true;
  const ViewsResult result = calibrate_views(scene.problem());
  EXPECT_EQ(result.status, Status::ok) << result.reason;
  EXPECT_THAT(result.diagnosis.warnings, Contains(HasSubstr("take at least three")));
}

TEST(ViewsDegenerate, NoPointsNoViewsNoCameras) {
  ViewsScene scene = good();
  ViewsProblem problem = scene.problem();
  problem.points = {};
  expect_named(problem, Status::too_few_points, "sees no points");
  problem.views = {};
  expect_named(problem, Status::too_few_points, "no views");
  problem.cameras = {};
  expect_named(problem, Status::wrong_problem, "no camera");
  std::erase_if(scene.points, [](const ViewPoint& seen) { return seen.view == 2; });
  expect_named(scene, Status::too_few_points, "view \"3\" has no points");
}

TEST(ViewsDegenerate, AViewOfThreePoints) {
  ViewsScene scene = good();
  int kept = 0;
  std::erase_if(scene.points, [&](const ViewPoint& seen) { return seen.view == 1 && ++kept > 3; });
  expect_named(scene, Status::too_few_points, "view \"2\" has 3 different points");
  // The third one again and again is no fourth.
  const auto third = std::ranges::find_if(scene.points, [](const ViewPoint& seen) { return seen.view == 1; });
  scene.points.push_back(*third);
  expect_named(scene, Status::too_few_points, "view \"2\" has 3 different points");
}

TEST(ViewsDegenerate, FourPointsInEveryViewAreTooFewEquations) {
  ViewsScene scene = good(2);
  int kept[2] = {0, 0};
  std::erase_if(scene.points, [&](const ViewPoint& seen) {
    const auto p = seen.point.p_W_mm;
    const bool corner = (p.x() == 0 || p.x() == 210) && (p.y() == 0 || p.y() == 210);
    return !corner || ++kept[seen.view] > 4;
  });
  expect_named(scene, Status::too_few_points, "16 equations (two per point) for 17 unknowns");
}

TEST(ViewsDegenerate, PointsOnALine) {
  ViewsScene scene = good();
  std::erase_if(scene.points,
                [](const ViewPoint& seen) { return seen.view == 1 && seen.point.p_W_mm.y() != 70; });
  expect_named(scene, Status::collinear, "view \"2\": the points lie on a line");
}

TEST(ViewsDegenerate, AllPointsButOneOnALine) {
  ViewsScene scene = good();
  std::erase_if(scene.points, [](const ViewPoint& seen) {
    return seen.view == 1 && seen.point.p_W_mm.y() != 70 && seen.point.p_W_mm != Vector3d(35, 35, 0);
  });
  expect_named(scene, Status::collinear, "all but one");
}

TEST(ViewsDegenerate, ABoardSeenEdgeOn) {
  ViewsScene scene = good();
  for (ViewPoint& seen : scene.points)
    if (seen.view == 1)
      seen.point.u_px = Vector2d(200, 300) + seen.point.p_W_mm.x() * Vector2d(2, 1) +
                        1e-3 * seen.point.p_W_mm.y() * Vector2d(2, 1);
  expect_named(scene, Status::collinear, "edge-on");
}

TEST(ViewsDegenerate, NumbersThatAreNone) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ViewsScene scene = good();
    scene.points[5].point.u_px.y() = bad;
    expect_named(scene, Status::not_finite, "point 6");
    scene = good();
    scene.points[5].point.p_W_mm.z() = bad;
    expect_named(scene, Status::not_finite, "point 6");
    scene = good();
    scene.points[5].point.covariance_px2(0, 1) = bad;
    expect_named(scene, Status::not_finite, "point 6");
  }
}

TEST(ViewsDegenerate, TheSamePointAtTwoPixels) {
  ViewsScene scene = good();
  scene.points.push_back(scene.points[60]);
  EXPECT_EQ(calibrate_views(scene.problem()).status, Status::ok);
  scene.points.back().point.u_px.x() += 5;
  expect_named(scene, Status::duplicate_points, "view \"2\"");
  scene = good();
  scene.points[61].point.u_px = scene.points[60].point.u_px;
  expect_named(scene, Status::duplicate_points, "view \"2\"");
}

TEST(ViewsDegenerate, AllPixelsInOneSpot) {
  ViewsScene scene = good();
  for (ViewPoint& seen : scene.points) seen.point.u_px = Vector2d(600, 500) + 0.02 * seen.point.u_px;
  expect_named(scene, Status::all_in_centre, "within");
}

TEST(ViewsDegenerate, PointsOnBothSidesOfTheCamera) {
  // Pixels of the line's points as if those behind the camera were seen through it.
  ViewsScene scene = good();
  const Pose X_CB = from_six_numbers({-100, -100, 100, 0, 60, 0});
  for (ViewPoint& seen : scene.points)
    if (seen.view == 0) {
      const Vector3d p = X_CB * seen.point.p_W_mm;
      seen.point.u_px = Vector2d(640, 512) + 1500 * p.head<2>() / p.z();
    }
  expect_named(scene, Status::behind_camera, "view \"1\"");
}

// A body with depth whose pixels are mirrored is no body at all.
TEST(ViewsDegenerate, MirroredPixelsOfABodyWithDepth) {
  Random random(34);
  ViewsScene scene = test::scene_of({model}, {Pose::Identity()}, test::board(7, 35, 120), 4, 30, random);
  for (ViewPoint& seen : scene.points) seen.point.u_px.x() = 1279 - seen.point.u_px.x();
  const ViewsResult result = calibrate_views(scene.problem());
  EXPECT_TRUE(result.status != Status::ok || result.rms_px >= 1) << result.rms_px;
}

TEST(ViewsDegenerate, ARigThatDoesNotHangTogether) {
  ViewsScene scene = good_rig();
  std::erase_if(scene.points, [](const ViewPoint& seen) { return (seen.camera == 0) == (seen.view < 2); });
  expect_named(scene, Status::not_determined, "camera \"camera2\" shares no view");
}

TEST(ViewsDegenerate, OptionsThatContradict) {
  ViewsScene scene = good();
  scene.cameras[0].fixed = {Parameter::fx};
  expect_named(scene, Status::wrong_problem, "there is no start");
  scene = good();
  scene.cameras[0].fixed = {Parameter::z};
  expect_named(scene, Status::wrong_problem, "pose");
  scene = good();
  scene.cameras[0].width_px = 0;
  expect_named(scene, Status::wrong_problem, "size");
  scene = good();
  scene.cameras[0].start = test::camera_with(BrownConrady{});
  expect_named(scene, Status::wrong_problem, "lens model");
  scene = good();
  scene.points[3].camera = 1;
  expect_named(scene, Status::wrong_problem, "point 4");
  scene = good();
  scene.points[3].point.covariance_px2 << 1, 2, 2, 1;
  expect_named(scene, Status::wrong_problem, "covariance");
}

TEST(ViewsDegenerate, TooLittleIsLeftAfterRejection) {
  ViewsScene scene = good();
  Random random(35);
  for (ViewPoint& seen : scene.points)
    if (seen.view == 1) seen.point.u_px += test::uniform_vector(random, 60).head<2>();
  ViewsProblem problem = scene.problem();
  problem.reject_px = 1e-3;
  expect_named(problem, Status::too_few_points, "were thrown out: view \"2\"");
}

TEST(ViewsDegenerate, AStopBeforeTheEnd) {
  const ViewsScene scene = good();
  ViewsProblem problem = scene.problem();
  problem.max_iterations = 1;
  expect_named(problem, Status::not_converged, "iterations");
}

TEST(ViewsDegenerate, LittleTiltIsWarnedOf) {
  ViewsScene scene = good(6, 6);
  Random random(36);
  test::add_noise(scene, 0.02, random);
  const ViewsResult result = calibrate_views(scene.problem());
  ASSERT_EQ(result.status, Status::ok) << result.reason;
  EXPECT_THAT(result.diagnosis.warnings, Contains(HasSubstr("the focal length rests on little")));
}

}  // namespace
}  // namespace zeropose
