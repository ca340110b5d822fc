// project_with_all_jacobians() against differences of pixels made another way.
#include <gtest/gtest.h>

#include "calib/camera_model.h"
#include "views_scene.h"

namespace zeropose {
namespace {

TEST(AllJacobians, AreTheDerivativesOfThePixel) {
  test::Random random(41);
  const std::vector<Distortion> lenses{Division{-0.2}, Division{0.1}, Division{0},
                                       BrownConrady{-0.2, 0.1, 0.001, -0.002, 0.05}};
  for (const Distortion& lens : lenses) {
    const CameraModel camera = test::camera_with(lens);
    const int last = std::holds_alternative<Division>(lens) ? 5 : internals_count;
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::Vector3d p(test::uniform(random, -300, 300), test::uniform(random, -250, 250), 800);
      const auto found = project_with_all_jacobians(camera, p).value();
      EXPECT_LE((found.u_px - test::independent_pixel(camera, p)).norm(), 1e-9);
      for (int k = 0; k < last; ++k) {
        const double step = k < 4 ? 1e-2 : 1e-4;
        Internals up = internals_of(camera), down = up;
        up[k] += step, down[k] -= step;
        const Eigen::Vector2d slope = (test::independent_pixel(with_internals(camera, up), p) -
                                       test::independent_pixel(with_internals(camera, down), p)) /
                                      (2 * step);
        // The third derivative by K times step^2, and rounding over the step.
        EXPECT_LE((found.du_di.col(k) - slope).norm(), 1e-6 * (1 + slope.norm())) << k;
      }
      EXPECT_EQ(found.du_di.rightCols(internals_count - last).norm(), 0);
      EXPECT_LE((found.du_dp - project_with_jacobian(camera, p)->du_dp).norm(), 1e-12);
    }
  }
}

TEST(AllJacobians, NoImageNoJacobian) {
  EXPECT_FALSE(project_with_all_jacobians(test::camera_with(Division{-0.2}), {0, 0, -1}));
  EXPECT_FALSE(project_with_all_jacobians(test::camera_with(Division{2}), {700, 0, 700}));
  EXPECT_FALSE(project_with_all_jacobians(test::camera_with(BrownConrady{-0.5}), {2000, 0, 700}));
}

}  // namespace
}  // namespace zeropose
