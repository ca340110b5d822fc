// The two lens models in each other's place.
#include "calib/lens_conversion.h"

#include <gtest/gtest.h>

namespace zeropose {
namespace {

const CameraModel narrow{768, 572, 4235, 4228, 416, 333, Division{-0.21}};
const CameraModel wide{2448, 2048, 2300, 2300, 1231, 1010, Division{-0.12}};

// Independent of the grid of the fit: every 37th pixel.
double worst_distance_px(const CameraModel& a, const CameraModel& b) {
  double worst = 0;
  for (int v = 0; v < a.height_px; v += 37)
    for (int u = 0; u < a.width_px; u += 37) {
      const auto direction = ray(a, {u, v});
      worst = std::max(worst, (*project(b, *direction) - Eigen::Vector2d(u, v)).norm());
    }
  return worst;
}

TEST(LensConversion, DivisionToBrown) {
  for (const CameraModel& camera : {narrow, wide}) {
    const LensConversion conversion = to_brown(camera);
    ASSERT_TRUE(conversion.model);
    EXPECT_EQ(conversion.model->fx_px, camera.fx_px);
    EXPECT_EQ(conversion.model->cy_px, camera.cy_px);
    EXPECT_LE(worst_distance_px(camera, *conversion.model), conversion.worst_px * 1.001);
    EXPECT_LT(conversion.worst_px, 0.05);
    EXPECT_LE(conversion.rms_px, conversion.worst_px);
    // Without the conversion the models are far apart: distorted - undistorted at the corner.
    CameraModel none = camera;
    none.distortion = BrownConrady{};
    EXPECT_GT(worst_distance_px(camera, none), 1.5);
  }
}

// d = u (1 + k1 r^2 + ...) against d = u (1 + K d^2): the first orders are the same, k1 = K.
TEST(LensConversion, FirstOrderIsK) {
  CameraModel camera = narrow;
  camera.distortion = Division{1e-3};
  const auto brown = std::get<BrownConrady>(to_brown(camera).model->distortion);
  EXPECT_NEAR(brown.k1, 1e-3, 1e-8);
  EXPECT_EQ(brown.p1, 0);
}

TEST(LensConversion, ThereAndBackAgain) {
  const LensConversion there = to_brown(narrow), back = to_division(*there.model);
  ASSERT_TRUE(back.model);
  // Both fits are as good as their residuals: the corner's 25 px / K moves by no more than these.
  EXPECT_LE(worst_distance_px(narrow, *back.model), there.worst_px + back.worst_px);
  EXPECT_NEAR(std::get<Division>(back.model->distortion).K, -0.21, 1e-4);
}

TEST(LensConversion, TangentialDistortionRemainsAsResidual) {
  CameraModel camera = narrow;
  camera.distortion = BrownConrady{-0.2, 0, 2e-3, 0, 0};
  const LensConversion conversion = to_division(camera);
  ASSERT_TRUE(conversion.model);
  // p1 (r^2 + 2 y^2) fy at the lower corner: x = 0.0984, y = 0.0788: about 0.19 px.
  EXPECT_GT(conversion.worst_px, 0.1);
  EXPECT_LT(conversion.worst_px, 0.4);
}

TEST(LensConversion, SameModelIsLeftAlone) {
  const LensConversion same = to_division(wide);
  ASSERT_TRUE(same.model);
  EXPECT_EQ(std::get<Division>(same.model->distortion).K, -0.12);
  EXPECT_LT(same.worst_px, 1e-9);
}

TEST(LensConversion, NoImageInTheCornersIsRefused) {
  CameraModel camera = wide;
  camera.distortion = Division{-3};  // 1 + K r^2 < 0 in the corners
  EXPECT_FALSE(to_brown(camera).model);
  camera.distortion = BrownConrady{-1.5, 0, 0, 0, 0};
  EXPECT_FALSE(to_division(camera).model);
}

}  // namespace
}  // namespace zeropose
