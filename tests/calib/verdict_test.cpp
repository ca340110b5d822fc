// What a report says about a calibration: uncertainty in six numbers, comparison, coverage, verdict.
#include "calib/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "calib/comparison.h"
#include "calib/uncertainty.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using testing::HasSubstr;

const CameraModel camera{800, 600, 2000, 2000, 390, 310, Division{-0.2}};

std::array<double, 6> six_of(const Pose& X) {
  const SixNumbers six = to_six_numbers(X);
  return {six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
}

// d(six numbers of the moved frame) / d(delta), by differences.
Matrix6 numeric_jacobian(const Pose& X_WC, double offset_mm) {
  constexpr double h = 1e-6;
  Matrix6 J;
  for (int i = 0; i < 6; ++i) {
    const Vector6 delta = h * Vector6::Unit(i);
    const auto more = six_of(with_frame_offset(moved(X_WC, delta), offset_mm)),
               less = six_of(with_frame_offset(moved(X_WC, -delta), offset_mm));
    for (int row = 0; row < 6; ++row)
      J(row, i) = (more[static_cast<std::size_t>(row)] - less[static_cast<std::size_t>(row)]) / (2 * h);
  }
  return J;
}

ParameterCovariance pose_covariance(const Matrix6& covariance) {
  return {{Parameter::x, Parameter::y, Parameter::z, Parameter::rx, Parameter::ry, Parameter::rz},
          covariance};
}

TEST(ReportedUncertainty, IsThatOfTheSixNumbers) {
  const Pose X_WC = from_six_numbers({100, -200, 900, 170, 35, -60});
  test::Random random(3);
  Matrix6 root;
  for (double& entry : root.reshaped()) entry = test::normal(random);
  const Matrix6 covariance = root * root.transpose();
  for (const double offset_mm : {0.0, 30.0}) {
    const Matrix6 J = numeric_jacobian(X_WC, offset_mm);
    const Matrix6 wanted = J * covariance * J.transpose();
    const auto reported = reported_uncertainty(pose_covariance(covariance), X_WC, offset_mm);
    ASSERT_EQ(reported.parameters.size(), 6u);
    for (int i = 0; i < 6; ++i) {
      // The differences are good to about 1e-9 of the numbers' size, 1e3.
      EXPECT_NEAR(reported.sigma(i) / std::sqrt(wanted(i, i)), 1, 1e-5);
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(reported.correlation(i, j), wanted(i, j) / std::sqrt(wanted(i, i) * wanted(j, j)), 1e-5);
    }
  }
}

TEST(ReportedUncertainty, AnglesThatWereHeldAlone) {
  // Two free angles are the six numbers' already: only the unit changes.
  const ParameterCovariance angles{{Parameter::rx, Parameter::rz}, Eigen::Vector2d(4e-6, 1e-6).asDiagonal()};
  const auto reported = reported_uncertainty(angles, from_six_numbers({0, 0, 0, 10, 40, 80}));
  EXPECT_NEAR(sigma_of(reported, Parameter::rx), 2e-3 * degrees_per_radian, 1e-12);
  EXPECT_NEAR(sigma_of(reported, Parameter::rz), 1e-3 * degrees_per_radian, 1e-12);
  EXPECT_EQ(sigma_of(reported, Parameter::ry), -1);
  EXPECT_EQ(sigma_of(reported, Parameter::x), -1);
  // A moved frame inherits their uncertainty: 100 mm times 2 mrad and more.
  EXPECT_GT(sigma_of(reported_uncertainty(angles, from_six_numbers({0, 0, 0, 10, 0, 0}), 100), Parameter::y),
            0.19);
}

TEST(ReportedUncertainty, NothingWithoutRefinement) {
  EXPECT_TRUE(reported_uncertainty({}, Pose::Identity()).parameters.empty());
}

TEST(Comparison, InternalsAlone) {
  CalibratedCamera active{"", camera, from_six_numbers({10, 20, 30, 170, 5, 9})}, fresh = active;
  const CameraComparison same = compare(active, fresh, 800);
  EXPECT_LT(same.worst_camera_px, 1e-9);
  EXPECT_EQ(same.moved_mm, 0);
  fresh.model.cx_px += 3;
  fresh.model.cy_px -= 4;
  const CameraComparison moved_origin = compare(active, fresh, 800);
  for (const PixelShift& shift : moved_origin.shifts) {
    ASSERT_TRUE(shift.internals_px && shift.camera_px);
    EXPECT_NEAR((*shift.internals_px - Vector2d(3, -4)).norm(), 0, 1e-9);
    EXPECT_NEAR((*shift.camera_px - Vector2d(3, -4)).norm(), 0, 1e-9);
  }
  EXPECT_NEAR(moved_origin.worst_internals_px, 5, 1e-9);
}

TEST(Comparison, PoseMakesUpForTheOrigin) {
  const CalibratedCamera active{"", camera, Pose::Identity()};
  CalibratedCamera fresh = active;
  fresh.model.cx_px += 20;
  fresh.X_WC.linear() = exp_so3({0, 20 / camera.fx_px, 0});  // turned so that the centre stays
  const CameraComparison comparison = compare(active, fresh, 800);
  EXPECT_GT(comparison.worst_internals_px, 19.9);
  EXPECT_LT(comparison.worst_camera_px, 2);
  EXPECT_NEAR(comparison.turned_deg, 20 / camera.fx_px * degrees_per_radian, 1e-9);
}

// A calibration in which everything is well; tests spoil one thing each.
struct Example {
  std::vector<CalibrationPoint> points;
  CalibrationProblem problem;
  CalibrationResult result;

  Example() {
    for (int v = 30; v < 600; v += 60)
      for (int u = 40; u < 800; u += 80) {
        CalibrationPoint point;
        point.u_px = {u, v};
        points.push_back(point);
        const double sign = (u / 80 + v / 60) % 2 == 0 ? 1 : -1;
        result.deviations.push_back(
            {Vector2d(0.1 * sign, 0.1), Vector2d(0.04 * sign, 0.04), 800.0 + u / 4.0, true});
      }
    problem.points = points;
    problem.width_px = 800;
    problem.height_px = 600;
    problem.sigma_px = 0.1;
    result.status = CalibrationStatus::ok;
    result.model = camera;
    result.rms_px = 0.1414;
    result.uncertainty = {{Parameter::fx, Parameter::cx, Parameter::cy},
                          Eigen::Vector3d(1, 1, 1).asDiagonal()};
  }
  Quality quality() const { return judge(problem, result).quality; }
  std::string first_finding() const { return judge(problem, result).findings.front().text; }
};

TEST(CalibrationVerdict, GoodWhereEverythingIsWell) {
  const Example example;
  const CalibrationVerdict verdict = judge(example.problem, example.result);
  EXPECT_EQ(verdict.quality, Quality::good) << verdict.findings.front().text;
  EXPECT_THAT(verdict.summary, HasSubstr("Good"));
}

TEST(CalibrationVerdict, NoResult) {
  Example example;
  example.result.status = CalibrationStatus::coplanar;
  example.result.reason = "all points lie in one plane";
  EXPECT_EQ(example.quality(), Quality::not_usable);
  EXPECT_EQ(example.first_finding(), "all points lie in one plane");
}

TEST(CalibrationVerdict, ResidualsAgainstTheNoise) {
  Example example;
  example.result.rms_px = 0.3;
  EXPECT_EQ(example.quality(), Quality::usable);
  EXPECT_THAT(example.first_finding(), HasSubstr("2.1 times"));
  example.result.rms_px = 0.5;
  EXPECT_EQ(example.quality(), Quality::not_usable);
  // Noisier points may have larger residuals: 0.1 px times 4.
  for (CalibrationPoint& point : example.points) point.covariance_px2 *= 16;
  EXPECT_EQ(example.quality(), Quality::good);
  // Without a stated noise only the size counts.
  example.problem.sigma_px = 0;
  EXPECT_EQ(example.quality(), Quality::good);
  example.result.rms_px = 4;
  EXPECT_EQ(example.quality(), Quality::not_usable);
}

TEST(CalibrationVerdict, RejectedPoints) {
  Example example;
  for (std::size_t i = 0; i < 10; ++i) example.result.deviations[5 * i + 22].used = false;
  EXPECT_EQ(example.quality(), Quality::usable);
  EXPECT_THAT(example.first_finding(), HasSubstr("10 of 100 points were rejected (10 %)"));
  for (std::size_t i = 0; i < 30; ++i) example.result.deviations[2 * i + 20].used = false;
  EXPECT_EQ(example.quality(), Quality::not_usable);
}

TEST(CalibrationVerdict, CoverageOfTheImage) {
  Example example;
  const Coverage all = coverage_of(example.problem, example.result);
  // Corners of the hull: (40, 30) .. (760, 570).
  EXPECT_NEAR(all.area, 720.0 * 540 / (800 * 600), 1e-12);
  EXPECT_EQ(all.hull_px.size(), 4u);
  EXPECT_EQ(all.counts[0] + all.counts[Coverage::columns - 1], 4);
  EXPECT_EQ(std::accumulate(all.counts.begin(), all.counts.end(), 0), 100);
  for (std::size_t i = 0; i < 100; ++i)
    example.result.deviations[i].used = example.points[i].u_px.x() < 400 && example.points[i].u_px.y() < 400;
  example.result.deviations[0].depth_mm = 1000;  // depth is not what is judged here
  EXPECT_NEAR(coverage_of(example.problem, example.result).area, 320.0 * 360 / 480000, 1e-12);
  EXPECT_THAT(judge(example.problem, example.result).findings[1].text, HasSubstr("cover 24 % of the image"));
}

TEST(CalibrationVerdict, DepthOriginAndRedundancy) {
  Example flat;
  for (auto& deviation : flat.result.deviations) deviation.depth_mm = 900;
  EXPECT_EQ(flat.quality(), Quality::usable);
  EXPECT_THAT(flat.first_finding(), HasSubstr("(0 %): focal length and distance"));
  Example vague;
  vague.result.uncertainty.covariance(2, 2) = 100;
  EXPECT_EQ(vague.quality(), Quality::usable);
  EXPECT_THAT(vague.first_finding(), HasSubstr("image origin known to 10.00 px"));
  vague.result.uncertainty.covariance(2, 2) = 50 * 50;
  EXPECT_EQ(vague.quality(), Quality::not_usable);
  Example unrefined;
  unrefined.result.uncertainty = {};
  EXPECT_EQ(unrefined.quality(), Quality::usable);
}

TEST(CalibrationVerdict, StrongCorrelationsAreNamed) {
  Example example;
  example.result.uncertainty.covariance(0, 1) = example.result.uncertainty.covariance(1, 0) = 0.995;
  const CalibrationVerdict verdict = judge(example.problem, example.result);
  EXPECT_EQ(verdict.quality, Quality::good);
  EXPECT_THAT(verdict.findings.back().text, HasSubstr("fx-cx"));
}

}  // namespace
}  // namespace zeropose
