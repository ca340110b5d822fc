// From pictures of a board to a camera: render, find the circles, calibrate, compare with the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calib/views.h"
#include "measure/board.h"
#include "tests/support/board_picture.h"

namespace zeropose {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr int pictures = 8;

test::BoardScene board(double K) {
  test::BoardScene scene;
  scene.camera = {768, 572, 1210, 1204, 392, 279, Division{K}};
  return scene;
}

// The board fills most of the picture, tilted by 35 degrees about another axis in every one.
Pose pose_of(const test::BoardScene& scene, int k) {
  return test::board_pose(scene, 300, 35 * degree, 45 * degree * k, 20 * degree * k);
}

std::vector<ViewPoint> photograph(test::BoardScene scene, bool tell_radius, double& noise_px) {
  std::vector<ViewPoint> points;
  double variance = 0;
  for (int k = 0; k < pictures; ++k) {
    scene.X_CB = pose_of(scene, k);
    std::mt19937_64 random(100 + static_cast<unsigned>(k));
    const test::Pixels picture = test::expose(test::paint(scene), 2, random);
    const BoardResult found = find_board(picture.view(), scene.problem());
    EXPECT_EQ(found.status, BoardStatus::found) << k << ": " << found.reason;
    for (const BoardPoint& point : found.points) {
      ViewPoint seen;
      seen.view = static_cast<std::size_t>(k);
      seen.point.p_W_mm = point.p_B_mm;
      seen.point.u_px = point.u_px;
      seen.point.covariance_px2 = point.covariance_px2;
      if (tell_radius) {
        seen.point.disc_radius_mm = scene.diameter_mm / 2;
        seen.point.disc_normal_W = Eigen::Vector3d::UnitZ();
      }
      variance += point.covariance_px2.trace();
      points.push_back(seen);
    }
  }
  noise_px = std::sqrt(variance / static_cast<double>(points.size()));  // of a point's distance
  return points;
}

ViewsResult calibrated(const test::BoardScene& scene, const std::vector<ViewPoint>& points) {
  const std::vector<ViewsCamera> cameras{
      {"camera", scene.camera.width_px, scene.camera.height_px, LensModel::division, {}, {}, false}};
  std::vector<BoardView> views(pictures);
  for (int k = 0; k < pictures; ++k) views[static_cast<std::size_t>(k)].name = std::to_string(k);
  ViewsProblem problem;
  problem.cameras = cameras;
  problem.views = views;
  problem.points = points;
  problem.sigma_px = 1;  // the covariances are those of the found centres
  return calibrate_views(problem);
}

TEST(BoardCalibration, FromPicturesToTheCameraThatTookThem) {
  const test::BoardScene scene = board(-0.15);
  double noise_px = 0;
  const auto points = photograph(scene, true, noise_px);
  const ViewsResult result = calibrated(scene, points);
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  // 968 points; what the model of the edge leaves is below a quarter of the noise.
  EXPECT_NEAR(result.rms_px / noise_px, 1, 0.15);
  const CameraEstimate& camera = result.cameras.front();
  const Eigen::VectorXd sigma = camera.internals.covariance.diagonal().cwiseSqrt();
  ASSERT_EQ(sigma.size(), 5);
  EXPECT_NEAR(camera.model.fx_px, scene.camera.fx_px, 4 * sigma(0));
  EXPECT_NEAR(camera.model.fy_px, scene.camera.fy_px, 4 * sigma(1));
  EXPECT_NEAR(camera.model.cx_px, scene.camera.cx_px, 4 * sigma(2));
  EXPECT_NEAR(camera.model.cy_px, scene.camera.cy_px, 4 * sigma(3));
  EXPECT_NEAR(std::get<Division>(camera.model.distortion).K, -0.15, 4 * sigma(4));
  EXPECT_LT(sigma(0), 0.2);
}

// The board's middle as the views have it, found minus true, root mean square over the views, mm. The middle
// is the same however the symmetric board is read.
double middle_error_mm(const test::BoardScene& scene, const ViewsResult& result) {
  const Eigen::Vector3d middle = scene.p_B_mm({(scene.rows - 1) / 2, (scene.cols - 1) / 2});
  double sum = 0;
  for (int k = 0; k < pictures; ++k)
    sum +=
        (result.views[static_cast<std::size_t>(k)].X_WB * middle - pose_of(scene, k) * middle).squaredNorm();
  return std::sqrt(sum / pictures);
}

// The centre of a tilted circle's image is beside the image of its centre, all circles of a board to the same
// side: the poses take it up, so that the residuals do not show it.
TEST(BoardCalibration, EccentricityOfTheCirclesMovesThePoses) {
  test::BoardScene scene = board(-0.15);
  scene.diameter_mm = 7;
  double noise_px = 0;
  const ViewsResult with = calibrated(scene, photograph(scene, true, noise_px));
  const ViewsResult without = calibrated(scene, photograph(scene, false, noise_px));
  ASSERT_EQ(with.status, CalibrationStatus::ok) << with.reason;
  ASSERT_EQ(without.status, CalibrationStatus::ok) << without.reason;
  EXPECT_NEAR(with.rms_px / noise_px, 1, 0.15);
  EXPECT_GT(middle_error_mm(scene, without), 2 * middle_error_mm(scene, with))
      << "with " << middle_error_mm(scene, with) << " without " << middle_error_mm(scene, without);
}

}  // namespace
}  // namespace zeropose
