// Internals and poses from vanishing points: the published table, synthetic cameras, degenerate inputs.
#include "calib/vanishing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/csv.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::CsvTable;

const CameraModel truth{768, 572, 1250, 1210, 402.5, 270.25, Division{}};
const CameraModel one_focal_truth{768, 572, 1250, 1250, 402.5, 270.25, Division{}};

// The pose of a rectangle in front of the camera: turned by rx, ry, then rz in its own plane.
Pose pose_of(double rx_deg, double ry_deg, double rz_deg) {
  Pose X_CO = from_six_numbers({0, 0, 0, rx_deg, ry_deg, 0}) * from_six_numbers({0, 0, 0, 0, 0, rz_deg});
  X_CO.translation() = Vector3d(-60, -40, 900);
  return X_CO;
}

const std::vector<Pose> poses{pose_of(35, 20, 10), pose_of(-30, 25, -20), pose_of(25, -40, 35),
                              pose_of(-40, -30, 5), pose_of(15, 45, -40)};

RectangleCorners corners_of(const CameraModel& camera, const Pose& X_CO, const RectangleSize& size) {
  const double x = size.side_mm, y = size.ratio * size.side_mm;
  return {*project(camera, X_CO * Vector3d(0, 0, 0)), *project(camera, X_CO * Vector3d(x, 0, 0)),
          *project(camera, X_CO * Vector3d(x, y, 0)), *project(camera, X_CO * Vector3d(0, y, 0))};
}

// Vanishing points are the images of the plane's axes.
VanishingPair pair_of(const CameraModel& camera, const Pose& X_CO) {
  const auto image = [&](const Vector3d& d) {
    return Vector2d(camera.fx_px * d.x() / d.z() + camera.cx_px, camera.fy_px * d.y() / d.z() + camera.cy_px);
  };
  return {image(X_CO.linear().col(0)), image(X_CO.linear().col(1))};
}

std::vector<VanishingPair> pairs_of(const CameraModel& camera, std::size_t count) {
  std::vector<VanishingPair> pairs;
  for (std::size_t i = 0; i < count; ++i) pairs.push_back(pair_of(camera, poses.at(i)));
  return pairs;
}

void expect_camera(const VanishingResult& result, const CameraModel& camera, double px = 1e-7) {
  ASSERT_EQ(result.status, VanishingStatus::ok) << result.reason;
  EXPECT_NEAR(result.fx_px, camera.fx_px, px);
  EXPECT_NEAR(result.fy_px, camera.fy_px, px);
  EXPECT_NEAR(result.cx_px, camera.cx_px, px);
  EXPECT_NEAR(result.cy_px, camera.cy_px, px);
}

std::vector<VanishingPair> published_pairs(std::size_t count) {
  const CsvTable table("tests/golden/vanishing-points.csv");
  std::vector<VanishingPair> pairs;
  for (std::size_t i = 0; i < count; ++i)
    pairs.push_back({{table.number(i, "v1_u_px"), table.number(i, "v1_v_px")},
                     {table.number(i, "v2_u_px"), table.number(i, "v2_v_px")}});
  return pairs;
}

// Table 3.8 took w5 = 1 - cx x3 - cy x4 with x3 = -cx x1: the first order of 1 / (1 + cx x3 + cy x4). From
// the right w5, s = 1 + (cx/fx)^2 + (cy/fy)^2 = w5, the published one follows as 2 - 1/w5.
Vector2d first_order_focal_lengths(const VanishingResult& right) {
  const double w5 = 1 + std::pow(right.cx_px / right.fx_px, 2) + std::pow(right.cy_px / right.fy_px, 2);
  const double factor = std::sqrt(w5 / (2 - 1 / w5));
  return {right.fx_px * factor, right.fy_px * factor};
}

TEST(Vanishing, PublishedTable) {
  const CsvTable results("tests/golden/vanishing-results.csv");
  ASSERT_EQ(results.size(), 16u);
  for (std::size_t row = 0; row < results.size(); ++row) {
    const auto count = static_cast<std::size_t>(results.number(row, "pairs_used_from_first"));
    SCOPED_TRACE(count);
    const auto pairs = published_pairs(count);
    const VanishingResult result = calibrate_by_vanishing_points({.pairs = pairs});
    ASSERT_EQ(result.status, VanishingStatus::ok);
    EXPECT_EQ(result.used.size(), count);
    EXPECT_NEAR(result.cx_px, results.number(row, "cx_px"), 0.02);
    EXPECT_NEAR(result.cy_px, results.number(row, "cy_px"), 0.02);
    const Vector2d published = first_order_focal_lengths(result);
    EXPECT_NEAR(published.x(), results.number(row, "fx_px"), 0.02);
    EXPECT_NEAR(published.y(), results.number(row, "fy_px"), 0.02);
  }
}

TEST(Vanishing, RecoversTheCameraForEveryCount) {
  const auto one = pairs_of(one_focal_truth, 5), two = pairs_of(truth, 5);
  const auto first = [](const std::vector<VanishingPair>& pairs, std::size_t n) {
    return std::span(pairs).first(n);
  };
  const Vector2d origin(402.5, 270.25), focal(1250, 1210);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(one, 1), .origin_px = origin}),
                one_focal_truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 2), .origin_px = origin}), truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 5), .origin_px = origin}), truth);
  expect_camera(calibrate_by_vanishing_points(
                    {.pairs = first(two, 2), .focal_px = focal, .near_px = Vector2d(383.5, 285.5)}),
                truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 3), .focal_px = focal}), truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 5), .focal_px = focal}), truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(one, 3)}), one_focal_truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(one, 5), .one_focal = true}), one_focal_truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 4)}), truth);
  expect_camera(calibrate_by_vanishing_points({.pairs = first(two, 5)}), truth);
}

TEST(Vanishing, RecoversCameraAndPosesFromCorners) {
  const RectangleSize size{0.6, 150};
  std::vector<VanishingPair> pairs;
  for (const Pose& X_CO : poses) {
    const RectanglePair found = vanishing_pair(corners_of(truth, X_CO, size), false, 0);
    ASSERT_TRUE(found.pair) << found.reason;
    EXPECT_FALSE(found.from_diagonals);
    pairs.push_back(*found.pair);
  }
  const VanishingResult result = calibrate_by_vanishing_points({.pairs = pairs});
  expect_camera(result, truth);
  const CameraModel found{768, 572, result.fx_px, result.fy_px, result.cx_px, result.cy_px, Division{}};
  for (const Pose& X_CO : poses) {
    const RectanglePose pose = rectangle_pose(found, corners_of(truth, X_CO, size), size);
    ASSERT_TRUE(pose.X_CO) << pose.reason;
    test::expect_near(*pose.X_CO, X_CO, 1e-7, 1e-7);
    EXPECT_NEAR(pose.ratio_seen, 0.6, 1e-9);
    EXPECT_NEAR(pose.rms_px, 0, 1e-7);
  }
}

TEST(Vanishing, DiagonalsOfASquareReplaceParallelLines) {
  const RectangleSize square{1, 150};
  // Turned about one side only: the other pair of sides stays parallel in the image.
  const RectangleCorners tilted = corners_of(truth, pose_of(35, 0, 0), square);
  EXPECT_FALSE(vanishing_pair(tilted, false, 0).pair);
  EXPECT_THAT(vanishing_pair(tilted, false, 0).reason, testing::HasSubstr("parallel in the image"));
  const RectanglePair found = vanishing_pair(tilted, true, 0);
  ASSERT_TRUE(found.pair);
  EXPECT_TRUE(found.from_diagonals);
  const VanishingPair diagonals = pair_of(truth, pose_of(35, 0, 45));
  EXPECT_NEAR((found.pair->v1_px - diagonals.v1_px).norm(), 0, 1e-7);
  EXPECT_NEAR((found.pair->v2_px - diagonals.v2_px).norm(), 0, 1e-7);
  std::vector<VanishingPair> pairs = pairs_of(truth, 3);
  pairs.push_back(*found.pair);
  expect_camera(calibrate_by_vanishing_points({.pairs = pairs}), truth);
}

TEST(Vanishing, PlaneParallelToTheChipGivesNothing) {
  for (const bool square : {false, true}) {
    const RectanglePair found = vanishing_pair(corners_of(truth, pose_of(0, 0, 20), {1, 150}), square, 0);
    EXPECT_FALSE(found.pair);
    EXPECT_THAT(found.reason, testing::HasSubstr("parallel"));
  }
}

TEST(Vanishing, ParallelSecondPoseIsSkipped) {
  auto pairs = pairs_of(truth, 4);
  pairs.push_back(pairs[1]);
  std::swap(pairs.back().v1_px, pairs.back().v2_px);  // turned by 90 degrees in its plane
  const VanishingResult result = calibrate_by_vanishing_points({.pairs = pairs});
  expect_camera(result, truth);
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_EQ(result.skipped[0].index, 4u);
  EXPECT_THAT(result.skipped[0].reason, testing::HasSubstr("number 2: a parallel pose"));
  pairs.erase(pairs.begin() + 2, pairs.begin() + 4);
  EXPECT_EQ(calibrate_by_vanishing_points({.pairs = pairs}).status, VanishingStatus::too_few_pairs);
}

TEST(Vanishing, FarPointsAreSkippedOnlyWithALimit) {
  auto pairs = pairs_of(truth, 5);
  pairs[2].v1_px = {50000, -20000};
  EXPECT_EQ(calibrate_by_vanishing_points({.pairs = pairs}).used.size(), 5u);
  const VanishingResult result = calibrate_by_vanishing_points({.pairs = pairs, .max_px = 10000});
  expect_camera(result, truth);
  ASSERT_EQ(result.skipped.size(), 1u);
  EXPECT_EQ(result.skipped[0].index, 2u);
  EXPECT_EQ(result.used, (std::vector<std::size_t>{0, 1, 3, 4}));
}

TEST(Vanishing, DegenerateInputsAreNamed) {
  const auto pairs = pairs_of(truth, 4);
  const auto status = [](const VanishingProblem& problem) {
    const VanishingResult result = calibrate_by_vanishing_points(problem);
    EXPECT_NE(result.reason, "");
    EXPECT_EQ(result.fx_px, 0);
    EXPECT_EQ(result.estimated.size(), 0u);
    return result.status;
  };
  const Vector2d origin(402.5, 270.25), focal(1250, 1210);
  EXPECT_EQ(status({}), VanishingStatus::too_few_pairs);
  EXPECT_EQ(status({.pairs = std::span(pairs).first(2)}), VanishingStatus::too_few_pairs);
  EXPECT_EQ(status({.pairs = std::span(pairs).first(1), .focal_px = focal}), VanishingStatus::too_few_pairs);
  EXPECT_EQ(status({.pairs = std::span(pairs).first(2), .focal_px = focal}), VanishingStatus::ambiguous);
  EXPECT_EQ(status({.pairs = pairs, .origin_px = origin, .focal_px = focal}), VanishingStatus::wrong_problem);
  EXPECT_EQ(status({.pairs = pairs, .focal_px = Vector2d(-1, 1)}), VanishingStatus::wrong_problem);
  auto broken = pairs;
  broken[1].v2_px.x() = std::nan("");
  EXPECT_EQ(status({.pairs = broken}), VanishingStatus::not_finite);
  // Two points on the same side of the origin are no images of perpendicular directions.
  const std::vector<VanishingPair> impossible{{origin + Vector2d(800, 900), origin + Vector2d(700, 600)}};
  EXPECT_EQ(status({.pairs = impossible, .origin_px = origin}), VanishingStatus::no_camera);
}

TEST(Vanishing, TurnsAboutOneAxisDoNotDetermineTheCamera) {
  std::vector<VanishingPair> pairs;
  for (const double rz_deg : {0., 30., 55., 80., 115.}) {
    Pose X_CO = from_six_numbers({0, 0, 0, 0, 0, rz_deg}) * pose_of(35, 20, 10);
    pairs.push_back(pair_of(one_focal_truth, X_CO));
  }
  // About the optical axis: all horizons keep their distance, the focal length still follows.
  expect_camera(calibrate_by_vanishing_points({.pairs = std::span(pairs).first(3)}), one_focal_truth, 1e-6);
  // About the plane's own normal: the horizon is the same, and with it the equations' rank is two.
  std::vector<VanishingPair> same_plane;
  for (const double rz_deg : {5., 20., 35., 50.})
    same_plane.push_back(pair_of(truth, pose_of(35, 20, rz_deg)));
  const VanishingResult result = calibrate_by_vanishing_points({.pairs = same_plane});
  EXPECT_EQ(result.status, VanishingStatus::not_determined);
  EXPECT_THAT(result.reason, testing::HasSubstr("too alike"));
}

TEST(Vanishing, WrongCornersAreNamed) {
  const RectangleCorners good = corners_of(truth, poses[0], {1, 150});
  RectangleCorners crossed = good, flat = good, broken = good;
  std::swap(crossed[1], crossed[2]);
  flat[1] = 0.5 * (flat[0] + flat[2]);
  broken[3].y() = std::nan("");
  EXPECT_THAT(vanishing_pair(crossed, true, 0).reason, testing::HasSubstr("order A B C D"));
  EXPECT_THAT(vanishing_pair(flat, true, 0).reason, testing::HasSubstr("on a line"));
  EXPECT_THAT(vanishing_pair(broken, true, 0).reason, testing::HasSubstr("not finite"));
  EXPECT_THAT(rectangle_pose(truth, crossed, {1, 150}).reason, testing::HasSubstr("order A B C D"));
  EXPECT_FALSE(rectangle_pose(truth, good, {0, 150}).X_CO);
}

// Errors grow with the corners' noise in proportion: ten times the noise, about ten times the error.
TEST(Vanishing, ErrorsFollowTheNoise) {
  const auto error_px = [](double sigma_px) {
    test::Random random(7);
    double sum = 0;
    constexpr int runs = 200;
    for (int run = 0; run < runs; ++run) {
      std::vector<VanishingPair> pairs;
      for (const Pose& X_CO : poses) {
        RectangleCorners corners = corners_of(truth, X_CO, {1, 300});
        for (Vector2d& corner : corners)
          corner += Vector2d(test::normal(random, sigma_px), test::normal(random, sigma_px));
        pairs.push_back(*vanishing_pair(corners, true, 0).pair);
      }
      const VanishingResult result = calibrate_by_vanishing_points({.pairs = pairs});
      EXPECT_EQ(result.status, VanishingStatus::ok) << result.reason;
      sum += std::pow(result.fx_px - truth.fx_px, 2) + std::pow(result.cx_px - truth.cx_px, 2);
    }
    return std::sqrt(sum / runs);
  };
  const double fine = error_px(0.001), coarse = error_px(0.01);
  EXPECT_NEAR(coarse / fine, 10, 0.5);
}

}  // namespace
}  // namespace zeropose
