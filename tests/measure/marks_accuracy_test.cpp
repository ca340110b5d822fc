// How well marks are measured, against pictures whose maker shares nothing with the estimator (spec 88).
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "measure/marks.h"
#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using test::Drawing;
using test::ellipse;
using test::expose;
using test::paint;
using test::Picture;
using test::Pixels;

constexpr double noise = 2;
constexpr double chi2_95 = 5.991;  // two degrees of freedom

struct Disc {
  Vector2d centre_px;
  double diameter_px, axis_ratio = 1, angle_rad = 0;
};

Drawing drawing_of(const Disc& disc) {
  Drawing drawing;
  drawing.width_px = drawing.height_px = static_cast<int>(disc.diameter_px) + 28;
  drawing.figures = {ellipse(disc.centre_px, disc.diameter_px, disc.axis_ratio, disc.angle_rad, 60)};
  return drawing;
}

Disc random_disc(double diameter, double axis_ratio, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(-0.5, 0.5);
  const double middle = 0.5 * (static_cast<int>(diameter) + 27);
  const Vector2d off(phase(random), phase(random));
  return {Vector2d(middle, middle) + off, diameter, axis_ratio, std::numbers::pi * phase(random)};
}

MarkFinding find(const Pixels& pixels, double diameter) {
  MarkSearch search;
  search.expected_px = 0.5 * Vector2d(pixels.width_px - 1, pixels.height_px - 1);
  search.half_window_px = search.expected_px;
  search.min_diameter_px = 0.8 * diameter;
  search.max_diameter_px = 1.2 * diameter;
  return find_marks(pixels.view(), {&search, 1}).front();
}

// Cramer-Rao bound of the centre from the pictures themselves: central differences in the true centre.
Matrix2d bound_of(const Disc& disc) {
  constexpr double h = 0.01;
  const auto shifted = [&disc](double du, double dv) {
    Disc moved = disc;
    moved.centre_px += Vector2d(du, dv);
    return paint(drawing_of(moved));
  };
  const Picture right = shifted(h, 0), left = shifted(-h, 0), down = shifted(0, h), up = shifted(0, -h);
  Matrix2d information = Matrix2d::Zero();
  for (std::size_t i = 0; i < right.grey.size(); ++i) {
    const Vector2d slope = Vector2d(right.grey[i] - left.grey[i], down.grey[i] - up.grey[i]) / (2 * h);
    information += slope * slope.transpose();
  }
  return (noise * noise + 1.0 / 12) * information.inverse();
}

// The picture maker itself: the missing grey is the area, its centroid the centre.
TEST(MarkPicture, AreaAndCentroidAreThoseOfTheEllipse) {
  std::mt19937_64 random(1);
  for (const double diameter : {8.0, 20.0, 55.5}) {
    const Disc disc = random_disc(diameter, 0.6, random);
    const Drawing drawing = drawing_of(disc);
    const Picture picture = paint(drawing);
    double area = 0;
    Vector2d first = Vector2d::Zero();
    for (int v = 0; v < picture.height_px; ++v) {
      for (int u = 0; u < picture.width_px; ++u) {
        const double share =
            (drawing.background - picture.grey[static_cast<std::size_t>(v * picture.width_px + u)]) / 100;
        area += share;
        first += share * Vector2d(u, v);
      }
    }
    EXPECT_NEAR(area, std::numbers::pi / 4 * diameter * diameter * 0.6, 2e-3 * diameter);
    EXPECT_LT((first / area - disc.centre_px).norm(), 2e-4);
  }
}

struct Statistics {
  double squares = 0, bound = 0, held = 0, count = 0;
};

Statistics measure_many(double diameter, double axis_ratio, int phases, int draws) {
  std::mt19937_64 random(17);
  Statistics s;
  for (int phase = 0; phase < phases; ++phase) {
    const Disc disc = random_disc(diameter, axis_ratio, random);
    s.bound += bound_of(disc).trace();
    const Picture picture = paint(drawing_of(disc));
    for (int draw = 0; draw < draws; ++draw) {
      const MarkFinding found = find(expose(picture, noise, random), diameter);
      EXPECT_EQ(found.status, MarkStatus::found) << name_of(found.status);
      const Vector2d error = found.u_px - disc.centre_px;
      s.squares += error.squaredNorm();
      s.held += error.dot(found.covariance_px2.inverse() * error) < chi2_95 ? 1 : 0;
      s.count += 1;
    }
  }
  s.bound /= phases;
  return s;
}

// 400 marks of 2 coordinates: the ratio is known to 2.5 % (one sigma).
class MarkAccuracy : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(MarkAccuracy, NearTheBoundWithHonestCovariance) {
  const auto [diameter, axis_ratio] = GetParam();
  const Statistics s = measure_many(diameter, axis_ratio, 10, 40);
  EXPECT_LE(std::sqrt(s.squares / s.count / s.bound), 1.2);
  EXPECT_GE(std::sqrt(s.squares / s.count / s.bound),
            0.9);  // below the bound something is wrong with the bound
  EXPECT_GE(s.held / s.count, 0.95 - 4 * std::sqrt(0.95 * 0.05 / s.count));
}

INSTANTIATE_TEST_SUITE_P(Sizes, MarkAccuracy,
                         testing::Values(std::pair{10.0, 1.0}, std::pair{20.0, 1.0}, std::pair{40.0, 1.0},
                                         std::pair{60.0, 1.0}, std::pair{20.0, 0.6}, std::pair{40.0, 0.4}));

// 2000 marks: 93..97 % is four sigma.
TEST(MarkCovariance, NinetyFivePercentEllipseHolds) {
  Statistics s;
  for (const auto& [diameter, ratio] : {std::pair{12.0, 0.8}, std::pair{24.0, 0.5}, std::pair{30.0, 0.9}}) {
    const Statistics one = measure_many(diameter, ratio, 20, 34);
    s.held += one.held;
    s.count += one.count;
  }
  EXPECT_GE(s.held / s.count, 0.93);
  EXPECT_LE(s.held / s.count, 0.97);
}

// Rounding to whole grey levels stays; it makes up nearly all of the single errors.
TEST(MarkBias, NoiseFreeOverAThousandPhases) {
  std::mt19937_64 random(3);
  Vector2d sum = Vector2d::Zero();
  double lengths = 0;
  constexpr int phases = 1000;
  for (int k = 0; k < phases; ++k) {
    const Disc disc = random_disc(20, 1 - 0.5 * (k % 3) / 2, random);
    const MarkFinding found = find(expose(paint(drawing_of(disc)), 0, random), 20);
    ASSERT_EQ(found.status, MarkStatus::found);
    sum += found.u_px - disc.centre_px;
    lengths += (found.u_px - disc.centre_px).norm();
  }
  EXPECT_LE((sum / phases).norm(), 0.0003);
  EXPECT_LE(lengths / phases, 0.0015);
}

// Light that falls off linearly: 0.0004 per px is the cell's (30 % over the picture), 0.003 is 20 % over the
// mark's surroundings.
TEST(MarkShading, DoesNotShiftTheCentre) {
  for (const double gradient : {0.0004, 0.003}) {
    for (const double diameter : {10.0, 20.0, 40.0, 60.0}) {
      std::mt19937_64 random(5);
      Vector2d shift = Vector2d::Zero();
      constexpr int phases = 40;
      for (int k = 0; k < phases; ++k) {
        const Disc disc = random_disc(diameter, 1, random);
        Drawing drawing = drawing_of(disc);
        drawing.shading_per_px = gradient * Vector2d(0.8, 0.6);
        const MarkFinding found = find(expose(paint(drawing), 0, random), diameter);
        ASSERT_EQ(found.status, MarkStatus::found);
        shift += (found.u_px - disc.centre_px) / phases;
      }
      EXPECT_LE(shift.norm(), 0.002) << diameter << " px, " << gradient << " per px";
    }
  }
}

// A plate's edge or a neighbour beside the band must not pull the centre: the error stays what its covariance
// says.
TEST(MarkSurroundings, NeighboursBesideTheBandDoNotBias) {
  for (const double gap : {4.0, 5.0, 6.5}) {
    std::mt19937_64 random(7);
    Vector2d sum = Vector2d::Zero();
    constexpr int phases = 30;
    double sigma2 = 0;
    for (int k = 0; k < phases; ++k) {
      const Disc disc = random_disc(24, 1, random);
      Drawing drawing = drawing_of(disc);
      const double edge = disc.centre_px.x() + 12 + gap;  // everything to the right of it is another surface
      drawing.figures.push_back({});
      drawing.figures.back().corners_px = {{edge, -20}, {edge + 99, -20}, {edge + 99, 99}, {edge, 99}};
      drawing.figures.back().grey = 90;
      const MarkFinding found = find(expose(paint(drawing), noise, random), 24);
      ASSERT_EQ(found.status, MarkStatus::found) << gap << ' ' << name_of(found.status);
      sum += found.u_px - disc.centre_px;
      sigma2 += found.covariance_px2.trace() / 2;
    }
    EXPECT_LE((sum / phases).norm(), 4 * std::sqrt(2 * sigma2 / phases / phases)) << gap;
  }
}

TEST(MarkFit, RepeatsBitByBit) {
  std::mt19937_64 random(9);
  const Pixels pixels = expose(paint(drawing_of(random_disc(30, 0.7, random))), noise, random);
  const MarkFinding a = find(pixels, 30), b = find(pixels, 30);
  EXPECT_EQ(a.u_px, b.u_px);
  EXPECT_EQ(a.covariance_px2, b.covariance_px2);
  EXPECT_EQ(a.quality, b.quality);
}

TEST(MarkFit, ReportsSizeShapeContrast) {
  std::mt19937_64 random(10);
  const MarkFinding found = find(expose(paint(drawing_of(random_disc(40, 0.5, random))), noise, random), 40);
  EXPECT_NEAR(found.diameter_px, 40, 0.15);
  EXPECT_NEAR(found.axis_ratio, 0.5, 0.01);
  EXPECT_NEAR(found.contrast, 100, 1);
  EXPECT_GT(found.quality, 0.8);
}

}  // namespace
}  // namespace zeropose
