#include "calib/eccentricity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;

CameraModel camera_with(Distortion lens) {
  return CameraModel{768, 572, 4323.44, 4315.07, 398.94, 243.58, lens};
}

std::vector<Vector2d> outline_px(const CameraModel& camera, const Vector3d& p, const Vector3d& n, double r) {
  const Vector3d e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  std::vector<Vector2d> points;
  for (int k = 0; k < 120; ++k) {
    const double a = 2 * pi * k / 120;
    points.push_back(project(camera, p + r * (std::cos(a) * e1 + std::sin(a) * e2)).value());
  }
  return points;
}

// Foot of a point on an axis-parallel ellipse with half axes h by bisection-safe Newton on the angle.
double distance_to_ellipse(const Vector2d& h, const Vector2d& q) {
  double t = std::atan2(q.y() / h.y(), q.x() / h.x());
  for (int i = 0; i < 50; ++i) {
    const double c = std::cos(t), s = std::sin(t);
    const Vector2d p(h.x() * c, h.y() * s), d(-h.x() * s, h.y() * c);
    const double f = (p - q).dot(d), df = d.squaredNorm() - (p - q).dot(p);
    t -= f / df;
    if (std::abs(f) < 1e-13) break;
  }
  const Vector2d p(h.x() * std::cos(t), h.y() * std::sin(t));
  return (q - p).norm() * (q.norm() > p.norm() ? 1 : -1);
}

// Orthogonal-distance fit with weights by arc length, numerical Jacobian: shares nothing with the closed
// form.
Vector2d fitted_centre(const std::vector<Vector2d>& points) {
  const int n = static_cast<int>(points.size());
  Eigen::Matrix<double, 5, 1> x;  // centre, half axes, angle
  x.setZero();
  Eigen::Matrix2d cov = Eigen::Matrix2d::Zero();
  for (const auto& p : points) x.head<2>() += p / n;
  for (const auto& p : points) cov += (p - x.head<2>()) * (p - x.head<2>()).transpose() / n;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eig(cov);
  x(2) = std::sqrt(2 * eig.eigenvalues()(1));
  x(3) = std::sqrt(2 * eig.eigenvalues()(0));
  x(4) = std::atan2(eig.eigenvectors()(1, 1), eig.eigenvectors()(0, 1));
  const auto residuals = [&](const Eigen::Matrix<double, 5, 1>& at) {
    Eigen::VectorXd r(n);
    const Eigen::Rotation2Dd turn(-at(4));
    for (int i = 0; i < n; ++i) {
      const auto& before = points[static_cast<std::size_t>((i + n - 1) % n)];
      const auto& after = points[static_cast<std::size_t>((i + 1) % n)];
      const double weight = std::sqrt((after - before).norm());
      r(i) = weight * distance_to_ellipse(at.segment<2>(2),
                                          turn * (points[static_cast<std::size_t>(i)] - at.head<2>()));
    }
    return r;
  };
  for (int step = 0; step < 4; ++step) {
    Eigen::MatrixXd J(n, 5);
    for (int k = 0; k < 5; ++k) {
      Eigen::Matrix<double, 5, 1> up = x, down = x;
      up(k) += 1e-5;
      down(k) -= 1e-5;
      J.col(k) = (residuals(up) - residuals(down)) / 2e-5;
    }
    x -= J.colPivHouseholderQr().solve(residuals(x));
  }
  return x.head<2>();
}

struct Scene {
  Vector3d p, n;
  double r;
};

Scene random_scene(std::mt19937& random, const CameraModel& camera, double max_tilt) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Vector3d view = ray(camera, Vector2d(20 + 728 * unit(random), 20 + 532 * unit(random))).value();
  const double tilt = max_tilt * unit(random), turn = 2 * pi * unit(random);
  const Vector3d n(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), -std::cos(tilt));
  return {view * (2700 + 600 * unit(random)), n, 10 + 10 * unit(random)};
}

TEST(Eccentricity, AgreesWithFittedOutlines) {
  std::mt19937 random(1);
  const std::vector<Distortion> lenses{Division{0}, Division{-0.0107}, Division{1.0613}, Division{0.376},
                                       BrownConrady{-0.9, 0.5, 0.002, -0.001, 0}};
  for (const auto& lens : lenses) {
    const CameraModel camera = camera_with(lens);
    for (int trial = 0; trial < 40; ++trial) {
      const Scene s = random_scene(random, camera, pi / 3);
      const Vector2d want = fitted_centre(outline_px(camera, s.p, s.n, s.r)) - project(camera, s.p).value();
      const Vector2d got = ellipse_centre_offset(camera, s.p, s.n, s.r);
      EXPECT_LT((got - want).norm(), 1e-4) << got.transpose() << " for " << want.transpose();
    }
  }
}

// Without distortion the closed form is exact, also where perspective is strong.
TEST(Eccentricity, ExactWithoutDistortion) {
  std::mt19937 random(2);
  const CameraModel camera = camera_with(Division{0});
  for (int trial = 0; trial < 40; ++trial) {
    Scene s = random_scene(random, camera, pi / 3);
    s.p /= 10;
    const Vector2d want = fitted_centre(outline_px(camera, s.p, s.n, s.r)) - project(camera, s.p).value();
    EXPECT_LT((ellipse_centre_offset(camera, s.p, s.n, s.r) - want).norm(), 1e-6);
    EXPECT_GT(want.norm(), 1e-3);
  }
}

// Golden: a 20 mm disc (radius 10) at 45 deg, 1 m, f 4200: r^2 n_x n_z / z^2 * f = 10^2 * 0.5 / 10^6 * 4200 =
// 0.21 px, away from the side that leans to the camera.
TEST(Eccentricity, TiltedDiscOnTheAxis) {
  const CameraModel camera{768, 572, 4200, 4200, 384, 286, Division{0}};
  const double c = std::sqrt(0.5);
  const Vector2d offset = ellipse_centre_offset(camera, Vector3d(0, 0, 1000), Vector3d(c, 0, -c), 10);
  EXPECT_NEAR(offset.x(), -0.21, 2e-5);
  EXPECT_NEAR(offset.y(), 0, 1e-12);
}

TEST(Eccentricity, SignAndLengthOfTheNormalDoNotMatter) {
  const CameraModel camera = camera_with(Division{1.06});
  const Vector3d p(150, -120, 3000), n(0.3, 0.5, -0.8);
  const Vector2d offset = ellipse_centre_offset(camera, p, n, 15);
  EXPECT_GT(offset.norm(), 1e-3);
  EXPECT_LT((ellipse_centre_offset(camera, p, -3 * n, 15) - offset).norm(), 1e-9);
}

TEST(Eccentricity, UnknownOrImpossibleIsZero) {
  const CameraModel camera = camera_with(Division{1.06});
  const Vector3d p(150, -120, 3000), n(0.3, 0.5, -0.8);
  EXPECT_EQ(ellipse_centre_offset(camera, p, Vector3d::Zero(), 15), Vector2d::Zero());
  EXPECT_EQ(ellipse_centre_offset(camera, p, n, 0), Vector2d::Zero());
  EXPECT_EQ(ellipse_centre_offset(camera, -p, n, 15), Vector2d::Zero());
  EXPECT_EQ(ellipse_centre_offset(camera, Vector3d(0, 0, 10), Vector3d(1, 0, 0), 15), Vector2d::Zero());
}

}  // namespace
}  // namespace zeropose
