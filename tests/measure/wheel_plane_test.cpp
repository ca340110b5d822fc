// The frame, the angles and the plane through nine points, without images.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "measure/wheel_plane.h"
#include "tests/support/sanitized.h"

namespace zeropose::test {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

Pose pose(double rx_deg, double ry_deg, double rz_deg = 0) {
  return from_six_numbers({12, -7, 30, rx_deg, ry_deg, rz_deg});
}

// Nine points of a circle as three sensors see it, three lines 8 degrees apart each.
std::vector<WheelPlanePoint> nine(const Pose& X_WO, double radius_mm, double sigma_mm,
                                  std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, 1);
  std::vector<WheelPlanePoint> points;
  for (int i = 0; i < 9; ++i) {
    const double angle = (90 + 120 * (i / 3) + 8 * (i % 3 - 1)) * degree;
    const double r = radius_mm + 3 * sigma_mm * normal(random), h = sigma_mm * normal(random);
    points.push_back({X_WO * Vector3d(r * std::cos(angle), r * std::sin(angle), h), sigma_mm, 3 * sigma_mm});
  }
  return points;
}

TEST(WheelAngles, AreRxAndRyOfTheRelativeFrameWhateverItsTurn) {
  const Pose X_WO0 = pose(1.5, -0.7);
  for (const double rx : {-3.0, -0.4, 2.0}) {
    for (const double ry : {-3.0, 0.9, 2.0}) {
      for (const double rz : {0.0, 77.0}) {
        // R = Rz Ry Rx turns the axis by rz too: what is seen is the axis alone.
        const Pose X_O0O = pose(rx, ry) * from_six_numbers({0, 0, 0, 0, 0, rz});
        const WheelAngles angles = wheel_angles(X_WO0, X_WO0 * X_O0O);
        EXPECT_NEAR(angles.camber_rad / degree, rx, 1e-9);
        EXPECT_NEAR(angles.toe_rad / degree, ry, 1e-9);
      }
    }
  }
}

TEST(WheelFrame, HasItsAxisAndNoTurnAboutIt) {
  const Vector3d axis = Vector3d(0.05, -0.03, 1).normalized(), centre(3, -5, 8);
  const Pose X_WO = wheel_frame(centre, axis);
  EXPECT_LT((X_WO.linear().col(2) - axis).norm(), 1e-12);
  EXPECT_EQ(X_WO.translation(), centre);
  EXPECT_NEAR(to_six_numbers(X_WO).rz_deg, 0, 1e-12);
}

TEST(WheelPlane, FindsFrameAndRadius) {
  std::mt19937_64 random(1);
  for (const double rx : {-3.0, 0.0, 2.0}) {
    const Pose X_WO = pose(rx, 1.2);
    const WheelPlaneResult result = fit_wheel_plane({nine(X_WO, 262, 1e-9, random)});
    ASSERT_EQ(result.status, WheelPlaneStatus::ok) << result.reason;
    EXPECT_LT(difference(X_WO, result.X_WO).norm(), 1e-7);
    EXPECT_NEAR(result.radius_mm, 262, 1e-7);
  }
}

TEST(WheelPlane, AxisPointsToTheSideAskedFor) {
  std::mt19937_64 random(1);
  const WheelPlaneResult result = fit_wheel_plane({nine(pose(1, 1), 262, 1e-9, random), -Vector3d::UnitZ()});
  ASSERT_EQ(result.status, WheelPlaneStatus::ok) << result.reason;
  EXPECT_LT((result.X_WO.linear().col(2) + pose(1, 1).linear().col(2)).norm(), 1e-9);
}

TEST(WheelPlane, NamesAPointOffThePlane) {
  std::mt19937_64 random(2);
  const Pose X_WO = pose(-2, 1);
  for (std::size_t wrong = 0; wrong < 9; ++wrong) {
    auto points = nine(X_WO, 262, 0.03, random);
    points[wrong].p_W_mm += 1.2 * X_WO.linear().col(2);  // 1.2 / 0.15 * sqrt(redundancy >= 0.6) = 6 sigmas
    const WheelPlaneResult result = fit_wheel_plane({points});
    EXPECT_EQ(result.status, WheelPlaneStatus::contradiction);
    EXPECT_EQ(result.wrong_point, wrong);
    EXPECT_NE(result.reason.find("plane"), std::string::npos) << result.reason;
  }
}

TEST(WheelPlane, NamesAPointOffTheCircle) {
  std::mt19937_64 random(3);
  const Pose X_WO = pose(-2, 1);
  for (std::size_t wrong = 0; wrong < 9; ++wrong) {
    auto points = nine(X_WO, 262, 0.03, random);
    points[wrong].p_W_mm += 2.6 * (points[wrong].p_W_mm - X_WO.translation()).normalized();
    const WheelPlaneResult result = fit_wheel_plane({points});
    EXPECT_EQ(result.status, WheelPlaneStatus::contradiction);
    EXPECT_EQ(result.wrong_point, wrong);
    EXPECT_NE(result.reason.find("circle"), std::string::npos) << result.reason;
  }
}

TEST(WheelPlane, RefusesWhatIsNoWheel) {
  std::mt19937_64 random(4);
  auto points = nine(pose(0, 0), 262, 0.03, random);
  const std::vector<WheelPlanePoint> three(points.begin(), points.begin() + 3);
  EXPECT_EQ(fit_wheel_plane({three}).status, WheelPlaneStatus::wrong_problem);
  std::vector<WheelPlanePoint> arc(points.begin(), points.begin() + 3);  // one sensor's
  arc.push_back(arc.front());
  EXPECT_EQ(fit_wheel_plane({arc}).status, WheelPlaneStatus::not_determined);
  points[4].sigma_mm = 0;
  EXPECT_EQ(fit_wheel_plane({points}).status, WheelPlaneStatus::wrong_problem);
  points[4] = {Vector3d(0, 0, std::nan("")), 1, 1};
  EXPECT_EQ(fit_wheel_plane({points}).status, WheelPlaneStatus::wrong_problem);
}

// Of 2000 wheels: the variance of a normal variable has the relative sigma sqrt(2 / 2000) = 3.2 %; 5 sigmas.
TEST(WheelPlane, SigmasAreTrueAndFalseAlarmsRare) {
  std::mt19937_64 random(5);
  const int count = trials(2000);
  const Pose X_WO = pose(-2, 1);
  double squares = 0;
  int alarms = 0;
  for (int i = 0; i < count; ++i) {
    const WheelPlaneResult result = fit_wheel_plane({nine(X_WO, 262, 0.05, random), Vector3d::UnitZ(), 0, 0});
    alarms += result.status == WheelPlaneStatus::contradiction;
    const WheelAngles angles = wheel_angles(X_WO, result.X_WO);
    const Eigen::Vector2d off(angles.camber_rad, angles.toe_rad);
    squares += off.dot(result.covariance_rad2.inverse() * off) / 2;
  }
  EXPECT_NEAR(squares / count, 1, 5 * std::sqrt(1.0 / count));  // two angles each
  EXPECT_LE(alarms, 2 + 10 * count / 2000);                     // 0.1 % meant: 2 of 2000
}

}  // namespace
}  // namespace zeropose::test
