// The makers' orders against what others have published about them. The formulas are from the appendix "Pose
// formats" of the manuals of rc_visard and rc_cube (Roboception, Basler): KUKA XYZ-ABC, Mitsubishi XYZ-ABC,
// Yaskawa, Kawasaki XYZ-OAT, ABB, Universal Robots; they are written with half angles, apart from the
// matrices of the code.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "protocol/conventions.h"

namespace zeropose {
namespace {

using Eigen::Quaterniond;

struct Half {
  double s, c;
  explicit Half(double angle_deg)
      : s(std::sin(angle_deg / degrees_per_radian / 2)), c(std::cos(angle_deg / degrees_per_radian / 2)) {}
};

// r_z(z) r_y(y) r_x(x), as published for KUKA (z = A, y = B, x = C), Mitsubishi (z = C, y = B, x = A) and
// Yaskawa (z = Rz, y = Ry, x = Rx).
Quaterniond published_zyx(double z_deg, double y_deg, double x_deg) {
  const Half z(z_deg), y(y_deg), x(x_deg);
  return {z.c * y.c * x.c + z.s * y.s * x.s, z.c * y.c * x.s - z.s * y.s * x.c,
          z.c * y.s * x.c + z.s * y.c * x.s, z.s * y.c * x.c - z.c * y.s * x.s};
}

// r_z(O) r_y(A) r_z(T), as published for Kawasaki.
Quaterniond published_oat(double o_deg, double a_deg, double t_deg) {
  const Half o(o_deg), a(a_deg), t(t_deg);
  return {o.c * a.c * t.c - o.s * a.c * t.s, o.c * a.s * t.s - o.s * a.s * t.c,
          o.c * a.s * t.c + o.s * a.s * t.s, o.s * a.c * t.c + o.c * a.c * t.s};
}

// x = RX sin(theta/2)/theta ..., w = cos(theta/2), as published for Universal Robots.
Quaterniond published_rotation_vector(double rx, double ry, double rz) {
  const double theta = std::sqrt(rx * rx + ry * ry + rz * rz), k = std::sin(theta / 2) / theta;
  return {std::cos(theta / 2), rx * k, ry * k, rz * k};
}

void expect_rotation(Convention maker, std::vector<double> rotation, const Quaterniond& published) {
  rotation.insert(rotation.begin(), {0, 0, 0});
  const auto X = from_maker(maker, rotation);
  ASSERT_TRUE(X) << name_of(maker);
  EXPECT_LT((X->linear() - published.toRotationMatrix()).cwiseAbs().maxCoeff(), 1e-12) << name_of(maker);
}

TEST(PublishedConventions, FormulasOfSixMakers) {
  for (const auto& [a, b, c] : std::vector<std::array<double, 3>>{
           {20, -35, 50}, {-120, 75, 160}, {170, 10, -95}, {45, 90, 30}, {0, -90, 12}, {359, 181, -270}}) {
    expect_rotation(Convention::kuka, {a, b, c}, published_zyx(a, b, c));
    expect_rotation(Convention::mitsubishi, {a, b, c}, published_zyx(c, b, a));
    expect_rotation(Convention::yaskawa, {a, b, c}, published_zyx(c, b, a));
    expect_rotation(Convention::kawasaki, {a, b, c}, published_oat(a, b, c));
    const double r = degrees_per_radian;
    expect_rotation(Convention::universal_robots, {a / r, b / r, c / r},
                    published_rotation_vector(a / r, b / r, c / r));
    const Quaterniond q = published_zyx(a, b, c);  // "(x y z w) = (Q2 Q3 Q4 Q1)"
    expect_rotation(Convention::abb, {q.w(), q.x(), q.y(), q.z()}, q);
  }
}

// ABB, RobotWare technical reference manual, data type orient, as quoted in ABB's developer forum ("Manual
// Quaternion Example"): a tool turned by 30 degrees about y is [0.9659249, 0, 0.2588223, 0].
TEST(PublishedConventions, AbbsExampleOfATurnedTool) {
  const auto X = from_maker(Convention::abb, std::vector<double>{0, 0, 0, 0.9659249, 0, 0.2588223, 0});
  ASSERT_TRUE(X);
  const SixNumbers six = to_six_numbers(*X);
  EXPECT_NEAR(six.ry_deg, 30, 1e-3);
  EXPECT_NEAR(six.rx_deg, 0, 1e-9);
  EXPECT_NEAR(six.rz_deg, 0, 1e-9);
}

// Universal Robots' forum, "Pose Rotation Order": rotation vector from roll, pitch, yaw with R = Rz(yaw)
// Ry(pitch) Rx(roll), theta = acos((r11 + r22 + r33 - 1) / 2), kx = (r32 - r23) / (2 sin theta) ...
TEST(PublishedConventions, UniversalRobotsRollPitchYaw) {
  const Pose X = from_six_numbers({0, 0, 0, 20, -35, 50});
  const Eigen::Matrix3d R = published_zyx(50, -35, 20).toRotationMatrix();
  const double theta = std::acos((R.trace() - 1) / 2), k = theta / (2 * std::sin(theta));
  const std::vector<double> values = to_maker(Convention::universal_robots, X);
  EXPECT_NEAR(values[3], k * (R(2, 1) - R(1, 2)), 1e-12);
  EXPECT_NEAR(values[4], k * (R(0, 2) - R(2, 0)), 1e-12);
  EXPECT_NEAR(values[5], k * (R(1, 0) - R(0, 1)), 1e-12);
}

// Angles far outside one turn mean the same as inside.
TEST(PublishedConventions, BigAnglesAreTheSameRotation) {
  for (const Convention maker : all_conventions()) {
    const auto names = field_names(maker);
    if (names.size() != 6 || maker == Convention::universal_robots) continue;
    const std::vector<double> inside{1, 2, 3, 20, -35, 50};
    std::vector<double> outside = inside;
    outside[3] += 720;
    outside[4] -= 360;
    outside[5] += 3600;
    const auto a = from_maker(maker, inside), b = from_maker(maker, outside);
    ASSERT_TRUE(a && b);
    EXPECT_LT((a->linear() - b->linear()).cwiseAbs().maxCoeff(), 1e-12) << name_of(maker);
  }
}

// A turn by half a turn and next to it, where a rotation vector and a quaternion change their sign.
TEST(PublishedConventions, HalfATurnComesBack) {
  for (const double angle_deg : {180.0, 179.9999999, -179.9999999, 180.0000001, 359.9999, 540.0}) {
    for (const Eigen::Vector3d& axis :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1),
          Eigen::Vector3d(1, 2, -3), Eigen::Vector3d(-1, 1, 0)}) {
      Pose X = Pose::Identity();
      X.linear() = Eigen::AngleAxisd(angle_deg / degrees_per_radian, axis.normalized()).toRotationMatrix();
      for (const Convention maker : all_conventions()) {
        const auto back = from_maker(maker, to_maker(maker, X));
        ASSERT_TRUE(back);
        EXPECT_LT((back->linear() - X.linear()).cwiseAbs().maxCoeff(), 1e-9)
            << name_of(maker) << ' ' << angle_deg << " about " << axis.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace zeropose
