// The whole staircase from pictures: the same pictures give the same answer, to the last bit.
#include <gtest/gtest.h>

#include <numbers>

#include "measure/measurement.h"
#include "tests/support/cell_scene.h"
#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using test::CellScene;
using Random = test::Random;

// The four pictures of the car body, discs as polygons of 120 corners.
std::vector<test::Pixels> pictures_of(const CellScene& scene, const Pose& X_WO, Random& random) {
  std::vector<test::Pixels> pictures;
  for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera) {
    const CalibratedCamera& seen_by = scene.cameras[camera];
    test::Drawing drawing;
    drawing.width_px = seen_by.model.width_px;
    drawing.height_px = seen_by.model.height_px;
    drawing.fineness = 3;
    for (const View& view : scene.job.views) {
      if (view.camera != camera) continue;
      const Mark& mark = scene.job.marks[view.mark];
      const Eigen::Vector3d across = mark.normal_O.unitOrthogonal();
      test::Figure figure;
      figure.grey = 60;
      for (int corner = 0; corner < 120; ++corner) {
        const Eigen::AngleAxisd turn(corner * std::numbers::pi / 60, mark.normal_O);
        figure.corners_px.push_back(*project(
            seen_by.model, seen_by.X_WC.inverse() * X_WO * (mark.p_O_mm + mark.radius_mm * (turn * across))));
      }
      drawing.figures.push_back(figure);
    }
    pictures.push_back(test::expose(test::paint(drawing), 2, random));
  }
  return pictures;
}

std::vector<CameraImage> images_of(const std::vector<test::Pixels>& pictures) {
  std::vector<CameraImage> images;
  for (std::size_t camera = 0; camera < pictures.size(); ++camera)
    images.push_back({camera, pictures[camera].view()});
  return images;
}

TEST(Measurement, CanBeRepeatedBitByBit) {
  Random random(13);
  const CellScene scene = test::car_body();
  const auto zero_pictures = pictures_of(scene, Pose::Identity(), random);
  const auto findings =
      find_job_marks(images_of(zero_pictures), scene.job, scene.cameras, scene.job.X_WO_nominal);
  const std::vector<std::vector<Observation>> frames{observations_of(findings, scene.job)};
  const ZeroResult zero = make_zero(scene.cameras, scene.job, frames);
  ASSERT_EQ(zero.code, Code::ok) << zero.reason;
  const Pose X_O0O = from_six_numbers({12, -9, 7, 0.1, -0.05, 0.12});
  const auto pictures = pictures_of(scene, X_O0O, random);
  const auto images = images_of(pictures);
  const MeasurementProblem problem{images, scene.job, scene.cameras, zero.zero};
  const Measurement first = measure(problem);
  ASSERT_EQ(first.code, Code::ok) << first.reason;
  test::expect_near(first.X_O0O, X_O0O, 0.05, 0.002);
  for (int time = 0; time < 3; ++time) {
    const Measurement again = measure(problem);
    ASSERT_EQ(again.code, Code::ok);
    EXPECT_EQ(again.X_O0O.matrix(), first.X_O0O.matrix());
    EXPECT_EQ(again.pose.X_WO.matrix(), first.pose.X_WO.matrix());
    EXPECT_EQ(again.pose.covariance, first.pose.covariance);
    EXPECT_EQ(again.pose.total_covariance, first.pose.total_covariance);
    EXPECT_EQ(again.sigma_mm, first.sigma_mm);
    ASSERT_EQ(again.observations.size(), first.observations.size());
    for (std::size_t i = 0; i < first.observations.size(); ++i) {
      EXPECT_EQ(again.observations[i].u_px, first.observations[i].u_px);
      EXPECT_EQ(again.observations[i].covariance_px2, first.observations[i].covariance_px2);
    }
  }
}

}  // namespace
}  // namespace zeropose
