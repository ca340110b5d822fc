#include "config/calibration_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<CalibrationPoint> points_in(const std::string& text) {
  const TemporaryFolder directory;
  return load_calibration_points(directory.write("points.csv", text));
}

CalibrationViews views_in(const std::string& text) {
  const TemporaryFolder directory;
  return load_calibration_views(directory.write("views.csv", text));
}

template <typename Load>
std::vector<std::string> mistakes_of(const Load& load) {
  try {
    load();
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

TEST(CalibrationTables, PointsAndPixels) {
  const auto points = points_in("u_px,v_px,x_mm,y_mm,z_mm\n10.5,20,1,2,3\n11,21,-4,5,-6e1\n");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].p_W_mm, Vector3d(1, 2, 3));
  EXPECT_EQ(points[0].u_px, Vector2d(10.5, 20));
  EXPECT_EQ(points[0].covariance_px2, Matrix2d::Identity());
  EXPECT_EQ(points[0].disc_radius_mm, 0);
  EXPECT_EQ(points[1].p_W_mm, Vector3d(-4, 5, -60));
}

TEST(CalibrationTables, APointMayHaveCovarianceAndDisc) {
  const auto points = points_in(
      "x_mm,y_mm,z_mm,u_px,v_px,suu,svv,suv,radius_mm,nx,ny,nz\n1,2,3,4,5,0.04,0.09,-0.01,8,0,0.6,0.8\n"
      "1,2,3,4,5,,,,,,,\n");
  EXPECT_EQ(points[0].covariance_px2, (Matrix2d() << 0.04, -0.01, -0.01, 0.09).finished());
  EXPECT_EQ(points[0].disc_radius_mm, 8);
  EXPECT_EQ(points[0].disc_normal_W, Vector3d(0, 0.6, 0.8));
  EXPECT_EQ(points[1].covariance_px2, Matrix2d::Identity());
  EXPECT_EQ(points[1].disc_radius_mm, 0);
}

// What find-board prints has row and col and no z.
TEST(CalibrationTables, ABoardNeedsNoThirdCoordinate) {
  const auto points = points_in("row,col,x_mm,y_mm,u_px,v_px\n0,1,10,0,100,101\n");
  EXPECT_EQ(points.front().p_W_mm, Vector3d(10, 0, 0));
}

TEST(CalibrationTables, EveryMistakeOfPointsIsNamed) {
  const auto mistakes = mistakes_of([] {
    points_in(
        "x_mm,y_mm,z_mm,u_px,v_px,suu,svv,suv,radius_mm,nx,ny,nz\n"
        "1,2,,4,5,,,,,,,\n"          // line 2: a blank z is no zero
        "1,nan,3,4,5,,,,,,,\n"       // line 3
        "1,2,3,4,5,1,1,1,,,,\n"      // line 4: no covariance
        "1,2,3,4,5,1,,,,,,\n"        // line 5: half a covariance, two mistakes
        "1,2,3,4,5,,,,8,,,\n"        // line 6: a disc without normal
        "1,2,3,4,5,,,,8,0,0,0\n"     // line 7: a normal without direction
        "1,2,3,4,5,,,,-8,0,0,1\n");  // line 8
  });
  ASSERT_EQ(mistakes.size(), 8u);
  EXPECT_THAT(mistakes,
              ElementsAre(HasSubstr("points.csv:2"), HasSubstr("points.csv:3"), HasSubstr("points.csv:4"),
                          HasSubstr("points.csv:5"), HasSubstr("points.csv:5"), HasSubstr("points.csv:6"),
                          HasSubstr("points.csv:7"), HasSubstr("points.csv:8")));
  EXPECT_THAT(mistakes[5], HasSubstr("the normal of its plane"));
}

TEST(CalibrationTables, ColumnsThatAreMissing) {
  EXPECT_THAT(mistakes_of([] { points_in("x_mm,z_mm,u_px,v_px\n1,2,3,4\n"); }),
              ElementsAre(HasSubstr("y_mm")));
  EXPECT_THAT(mistakes_of([] { views_in("x_mm,y_mm,z_mm,u_px,v_px\n1,2,3,4,5\n"); }),
              ElementsAre(HasSubstr("view")));
}

TEST(CalibrationTables, ViewsOfOneCamera) {
  const auto views =
      views_in("view,id,x_mm,y_mm,z_mm,u_px,v_px\nb,1,1,2,0,4,5\na,1,1,2,0,6,7\nb,2,3,4,0,8,9\n");
  EXPECT_THAT(views.cameras, ElementsAre("camera"));
  EXPECT_THAT(views.views, ElementsAre("b", "a"));
  ASSERT_EQ(views.points.size(), 3u);
  EXPECT_EQ(views.points[0].view, 0u);
  EXPECT_EQ(views.points[1].view, 1u);
  EXPECT_EQ(views.points[2].view, 0u);
  EXPECT_EQ(views.points[2].point.u_px, Vector2d(8, 9));
}

TEST(CalibrationTables, ViewsOfARigWithDiscs) {
  const auto views = views_in(
      "camera,view,x_mm,y_mm,u_px,v_px,radius_mm,nx,ny,nz\nleft,1,1,2,4,5,8,,,\nright,1,1,2,4,5,8,1,0,0\n");
  EXPECT_THAT(views.cameras, ElementsAre("left", "right"));
  EXPECT_EQ(views.points[1].camera, 1u);
  EXPECT_EQ(views.points[0].point.disc_normal_W, Vector3d::UnitZ());
  EXPECT_EQ(views.points[1].point.disc_normal_W, Vector3d::UnitX());
}

TEST(CalibrationTables, ANameLeftBlankIsNamed) {
  EXPECT_THAT(mistakes_of([] { views_in("camera,view,x_mm,y_mm,u_px,v_px\n,1,1,2,4,5\nleft,,1,2,4,5\n"); }),
              ElementsAre(HasSubstr("views.csv:2"), HasSubstr("views.csv:3")));
  EXPECT_THAT(mistakes_of([] { points_in("x_mm,y_mm,u_px,v_px\n1,2,4,5\n"); }), IsEmpty());
}

}  // namespace
}  // namespace zeropose
