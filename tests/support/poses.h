// Poses in tests: reading them from tables, drawing them, comparing them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calib/rigid.h"
#include "tests/support/csv.h"

namespace zeropose::test {

inline SixNumbers six_numbers(const CsvTable& table, std::size_t row) {
  return {table.number(row, "x_mm"),   table.number(row, "y_mm"),   table.number(row, "z_mm"),
          table.number(row, "rx_deg"), table.number(row, "ry_deg"), table.number(row, "rz_deg")};
}

inline Pose pose(const CsvTable& table, std::size_t row) { return from_six_numbers(six_numbers(table, row)); }

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline double normal(Random& random, double sigma = 1) {
  return std::normal_distribution<double>(0, sigma)(random);
}
inline Eigen::Vector3d uniform_vector(Random& random, double half_width) {
  return {uniform(random, -half_width, half_width), uniform(random, -half_width, half_width),
          uniform(random, -half_width, half_width)};
}
inline Eigen::Matrix3d uniform_rotation(Random& random) {
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized()
      .toRotationMatrix();
}
inline Pose uniform_pose(Random& random, double half_width_mm) {
  Pose X = Pose::Identity();
  X.linear() = uniform_rotation(random);
  X.translation() = uniform_vector(random, half_width_mm);
  return X;
}

// Distance of the origins and angle between the frames.
inline double distance_mm(const Pose& a, const Pose& b) { return difference(a, b).head<3>().norm(); }
inline double angle_deg(const Pose& a, const Pose& b) {
  return difference(a, b).tail<3>().norm() * degrees_per_radian;
}

inline void expect_near(const Pose& actual, const Pose& expected, double mm, double deg) {
  EXPECT_LE(distance_mm(actual, expected), mm);
  EXPECT_LE(angle_deg(actual, expected), deg);
}

// Component by component, as two printed tables are compared. Angles modulo 360.
inline void expect_six_near(const SixNumbers& actual, const SixNumbers& expected, double mm, double deg) {
  const auto turn = [](double a, double b) { return std::remainder(a - b, 360.0); };
  EXPECT_NEAR(actual.x_mm, expected.x_mm, mm);
  EXPECT_NEAR(actual.y_mm, expected.y_mm, mm);
  EXPECT_NEAR(actual.z_mm, expected.z_mm, mm);
  EXPECT_NEAR(turn(actual.rx_deg, expected.rx_deg), 0, deg);
  EXPECT_NEAR(turn(actual.ry_deg, expected.ry_deg), 0, deg);
  EXPECT_NEAR(turn(actual.rz_deg, expected.rz_deg), 0, deg);
}

}  // namespace zeropose::test
