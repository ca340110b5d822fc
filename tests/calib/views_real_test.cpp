// calibrate_views() on published data (../shared/data/real, README.md in each folder), with the RMS of the
// peers that are named there: root of the mean squared point distance.
#include <gtest/gtest.h>

#include <map>
#include <optional>

#include "calib/views.h"
#include "tests/support/csv.h"
#include "tests/support/photogrammetric_pose.h"
#include "tests/support/poses.h"
#include "tests/support/shared_data.h"

namespace zeropose {
namespace {

using test::CsvTable;

struct Input {
  std::vector<ViewsCamera> cameras;
  std::vector<BoardView> views;
  std::vector<ViewPoint> points;
  ViewsProblem problem() const {
    ViewsProblem given;
    given.cameras = cameras, given.views = views, given.points = points;
    return given;
  }
};

Input input_of(const CsvTable& table, int width, int height, const ParameterSet& fixed, double pixel_origin) {
  Input input;
  ViewsCamera camera;
  camera.name = "camera", camera.width_px = width, camera.height_px = height;
  camera.lens = LensModel::brown, camera.fixed = fixed;
  input.cameras = {camera};
  std::map<std::string, std::size_t> index;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const auto [found, added] = index.emplace(table.text(row, "view"), index.size());
    if (added) input.views.push_back({found->first, std::nullopt});
    ViewPoint seen{found->second, 0, {}};
    seen.point.p_W_mm = {table.number(row, "x_mm"), table.number(row, "y_mm"), table.number(row, "z_mm")};
    seen.point.u_px = {table.number(row, "u_px") - pixel_origin, table.number(row, "v_px") - pixel_origin};
    input.points.push_back(seen);
  }
  return input;
}

TEST(ViewsRealData, ZhangsFiveViews) {
  const auto file = test::shared_data("real/zhang/points.csv");
  if (!file) GTEST_SKIP() << test::data_not_found;
  const Input input = input_of(CsvTable(*file), 640, 480, {Parameter::p1, Parameter::p2, Parameter::k3}, 0);
  const ViewsResult result = calibrate_views(input.problem());
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LE(result.rms_px, 0.3369);  // OpenCV 0.336887
  const CameraModel& model = result.cameras[0].model;
  EXPECT_NEAR(model.fx_px, 832.2069, 0.01);
  EXPECT_NEAR(model.fy_px, 832.2425, 0.01);
  EXPECT_NEAR(model.cx_px, 304.0683, 0.01);
  EXPECT_NEAR(model.cy_px, 206.3725, 0.01);
  EXPECT_NEAR(std::get<BrownConrady>(model.distortion).k1, -0.228531, 1e-4);
  EXPECT_NEAR(std::get<BrownConrady>(model.distortion).k2, 0.191010, 1e-3);
}

TEST(ViewsRealData, TwentyOneImagesOfASheet) {
  const auto points = test::shared_data("real/dbat_camcal/points.csv"),
             poses = test::shared_data("real/dbat_camcal/reference_eo_dbat.csv");
  if (!points || !poses) GTEST_SKIP() << test::data_not_found;
  const Input input = input_of(CsvTable(*points), 2272, 1704, {Parameter::k3}, 0.5);
  const ViewsResult result = calibrate_views(input.problem());
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LE(result.rms_px, 0.21386);  // OpenCV 0.213857
  const CsvTable published(*poses);
  ASSERT_EQ(published.size(), 21u);
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  for (std::size_t row = 0; row < published.size(); ++row) {
    std::size_t v = 0;
    while (input.views[v].name != published.text(row, "view")) ++v;
    const Pose X_BC = result.views[v].X_WB.inverse();
    EXPECT_LE(test::angle_deg(X_BC, test::photogrammetric_pose(published, row)), 0.006);
    squares +=
        (X_BC.translation() - test::photogrammetric_pose(published, row).translation()).array().square() / 21;
  }
  EXPECT_LE(squares.sqrt().maxCoeff(), 0.15);  // per axis; the peer: 0.095 0.100 0.061 mm
}

TEST(ViewsRealData, BoardOnARobotsWrist) {
  const auto file = test::shared_data("real/rct_charuco_handeye/points.csv");
  if (!file) GTEST_SKIP() << test::data_not_found;
  const Input input = input_of(CsvTable(*file), 1600, 1200, {Parameter::k3}, 0);
  const ViewsResult result = calibrate_views(input.problem());
  ASSERT_EQ(result.status, CalibrationStatus::ok) << result.reason;
  EXPECT_LE(result.rms_px, 0.53525);  // OpenCV 0.5352
  EXPECT_NEAR(result.cameras[0].model.fx_px, 1361.257, 0.05);
  EXPECT_NEAR(result.cameras[0].model.cx_px, 776.826, 0.05);
}

}  // namespace
}  // namespace zeropose
