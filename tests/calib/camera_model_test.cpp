#include "calib/camera_model.h"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/calib3d.hpp>

#include "tests/support/poses.h"

namespace zeropose {
namespace {

using test::Random;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

CameraModel with(Distortion lens) { return {768, 572, 850, 840, 390, 280, lens}; }

// Lenses bent both ways, far stronger than a 35 mm lens.
std::vector<CameraModel> lenses() {
  return {with(Division{0}),
          with(Division{0.3}),
          with(Division{-0.4}),
          with(BrownConrady{}),
          with(BrownConrady{-0.25, 0.09, 0.001, -0.0015, 0.01}),
          with(BrownConrady{0.12, -0.03, -0.002, 0.001, 0.004})};
}

Eigen::Vector3d visible_point(Random& random) {
  const double z = test::uniform(random, 200, 5000);
  return {z * test::uniform(random, -0.4, 0.4), z * test::uniform(random, -0.3, 0.3), z};
}

TEST(CameraModel, RayOfProjectionPointsAtThePoint) {
  Random random(1);
  for (const auto& camera : lenses())
    for (int trial = 0; trial < 2000; ++trial) {
      const Eigen::Vector3d p_CQ = visible_point(random);
      const auto u = project(camera, p_CQ);
      ASSERT_TRUE(u);
      const auto d = ray(camera, *u);
      ASSERT_TRUE(d);
      ASSERT_EQ(d->z(), 1);
      ASSERT_LT((*d - p_CQ / p_CQ.z()).norm(), 1e-12);
    }
}

TEST(CameraModel, ProjectionOfRayIsThePixel) {
  Random random(2);
  for (const auto& camera : lenses())
    for (int trial = 0; trial < 2000; ++trial) {
      const Eigen::Vector2d u(test::uniform(random, 100, 650), test::uniform(random, 100, 450));
      const auto d = ray(camera, u);
      ASSERT_TRUE(d);
      ASSERT_LT((*project(camera, 1234 * *d) - u).norm(), 1e-9);
    }
}

TEST(CameraModel, JacobianAgreesWithFiniteDifferences) {
  Random random(3);
  for (const auto& camera : lenses())
    for (int trial = 0; trial < 200; ++trial) {
      const Eigen::Vector3d p_CQ = visible_point(random);
      const auto projection = project_with_jacobian(camera, p_CQ);
      ASSERT_TRUE(projection);
      EXPECT_EQ(projection->u_px, *project(camera, p_CQ));
      const double h = 1e-5 * p_CQ.z();
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector2d slope =
            (*project(camera, p_CQ + step) - *project(camera, p_CQ - step)) / (2 * h);
        ASSERT_LT((slope - projection->du_dp.col(axis)).norm() * p_CQ.z(), 1e-5);
      }
    }
}

TEST(CameraModel, DivisionFollowsItsDefinition) {
  const CameraModel camera = with(Division{0.3});
  const Eigen::Vector2d u(600, 400);
  const double xd = (600 - 390) / 850.0, yd = (400 - 280) / 840.0;
  const double bend = 1 + 0.3 * (xd * xd + yd * yd);
  EXPECT_LT((*ray(camera, u) - Eigen::Vector3d(xd / bend, yd / bend, 1)).norm(), 1e-15);
}

TEST(CameraModel, BrownAgreesWithOpenCv) {
  const BrownConrady lens{-0.25, 0.09, 0.001, -0.0015, 0.01};
  const CameraModel camera = with(lens);
  const cv::Matx33d internals(850, 0, 390, 0, 840, 280, 0, 0, 1);
  const std::vector<double> distortion{lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
  Random random(4);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p = visible_point(random);
    points.emplace_back(p.x(), p.y(), p.z());
  }
  cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), internals, distortion, pixels);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto u = project(camera, {points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(u);
    ASSERT_LT((*u - Eigen::Vector2d(pixels[i].x, pixels[i].y)).norm(), 1e-9);
  }
}

TEST(CameraModel, HasNoImageOfPointsBehindOrWithoutNumbers) {
  for (const auto& camera : lenses()) {
    EXPECT_FALSE(project(camera, {1, 2, 0}));
    EXPECT_FALSE(project(camera, {1, 2, -100}));
    EXPECT_FALSE(project(camera, {nan, 2, 100}));
    EXPECT_FALSE(project(camera, {1, 2, std::numeric_limits<double>::infinity()}));
    EXPECT_FALSE(project_with_jacobian(camera, {1, nan, 100}));
    EXPECT_FALSE(ray(camera, {nan, 0}));
  }
}

TEST(CameraModel, HasNoImageBeyondTheRangeOfTheLens) {
  const CameraModel barrel = with(Division{1});  // 1 - 4 K r^2 < 0 for r > 0.5
  EXPECT_TRUE(project(barrel, {0.49, 0, 1}));
  EXPECT_FALSE(project(barrel, {0.51, 0, 1}));
  EXPECT_FALSE(ray(barrel, {390 + 850 * 1.01, 280}));  // K r^2 >= 1
  EXPECT_TRUE(ray(barrel, {390 + 850 * 0.99, 280}));
  const CameraModel pincushion = with(Division{-1});  // 1 + K r^2 <= 0 for r >= 1
  EXPECT_FALSE(ray(pincushion, {390 + 850 * 1.01, 280}));
  const CameraModel brown = with(BrownConrady{-0.3, 0, 0, 0, 0});  // turns back at r^2 = 1 / 0.9
  EXPECT_TRUE(project(brown, {1.0, 0, 1}));
  EXPECT_FALSE(project(brown, {1.06, 0, 1}));
}

TEST(CameraModel, ImageSpansHalfAPixelBeyondTheCentres) {
  const CameraModel camera = with(Division{});
  EXPECT_TRUE(in_image(camera, {-0.5, -0.5}));
  EXPECT_TRUE(in_image(camera, {767.5, 571.5}));
  EXPECT_FALSE(in_image(camera, {-0.51, 0}));
  EXPECT_FALSE(in_image(camera, {0, 571.51}));
  EXPECT_FALSE(in_image(camera, {nan, 0}));
}

}  // namespace
}  // namespace zeropose
