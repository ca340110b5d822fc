// Points that several cameras see (spec 50 M2). The pixels are made by a camera that shares nothing with the
// code under test; OpenCV's triangulation is the peer.
#include "measure/triangulation.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "calib/chance.h"
#include "tests/support/poses.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Random = test::Random;

constexpr double quantile95_of_3 = 7.8147;

// Cameras on a cone about the origin, 1200 mm away.
std::vector<CalibratedCamera> rig(std::size_t count, bool brown) {
  std::vector<CalibratedCamera> cameras;
  for (std::size_t i = 0; i < count; ++i) {
    const double turn_deg = 20 + 360.0 * static_cast<double>(i) / static_cast<double>(count);
    cameras.push_back({"camera" + std::to_string(i + 1),
                       brown ? test::brown_camera() : test::division_camera(-0.2),
                       test::looking_at_origin(1200, 20, turn_deg)});
  }
  return cameras;
}

std::vector<Observation> seen(const std::vector<CalibratedCamera>& cameras, const Vector3d& p_W_mm,
                              const Matrix2d& covariance_px2 = 1e-4 * Matrix2d::Identity()) {
  std::vector<Observation> observations;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    observations.push_back(
        {i, 0, test::photograph(cameras[i].model, cameras[i].X_WC, p_W_mm), covariance_px2});
  return observations;
}

void add_noise(std::vector<Observation>& observations, double system_sigma_px, Random& random) {
  for (Observation& observation : observations) {
    const Matrix2d C = observation.covariance_px2 + system_sigma_px * system_sigma_px * Matrix2d::Identity();
    const Matrix2d L = C.llt().matrixL();
    observation.u_px += L * Vector2d(test::normal(random), test::normal(random));
  }
}

// Distinct and not round.
Matrix2d covariance(Random& random) {
  const double suu = test::uniform(random, 0.0004, 0.01), svv = test::uniform(random, 0.0004, 0.01);
  Matrix2d C;
  C << suu, 0.4 * std::sqrt(suu * svv), 0.4 * std::sqrt(suu * svv), svv;
  return C;
}

TEST(ChiSquared, TailIsAsInTables) {
  const double table[][3] = {{3.8415, 1, 0.05},   {5.9915, 2, 0.05},  {7.8147, 3, 0.05},  {9.4877, 4, 0.05},
                             {10.8276, 1, 0.001}, {20.515, 5, 0.001}, {29.588, 10, 0.001}};
  for (const auto& [square, degrees, chance] : table)
    EXPECT_NEAR(chi_square_tail(square, static_cast<int>(degrees)), chance, 1e-4 * chance + 1e-6);
  EXPECT_DOUBLE_EQ(chi_square_tail(0, 1), 1);
  EXPECT_DOUBLE_EQ(chi_square_tail(0, 6), 1);
  EXPECT_DOUBLE_EQ(chi_square_tail(1e6, 7), 0);
}

TEST(Triangulation, OfExactPixelsIsExact) {
  Random random(1);
  for (const bool brown : {false, true})
    for (const std::size_t count : {2u, 3u, 4u}) {
      const auto cameras = rig(count, brown);
      for (int trial = 0; trial < 50; ++trial) {
        const Vector3d p_W = test::uniform_vector(random, 120);
        const auto observations = seen(cameras, p_W);
        const TriangulatedPoint point = triangulate({cameras, observations});
        ASSERT_EQ(point.code, Code::ok) << point.reason;
        EXPECT_LT((point.p_W_mm - p_W).norm(), 1e-6);
        EXPECT_LT(point.ray_gap_mm, 1e-6);
        ASSERT_EQ(point.deviations_px.size(), count);
        for (const Vector2d& deviation : point.deviations_px) EXPECT_LT(deviation.norm(), 1e-6);
      }
    }
}

// OpenCV minimises another sum: a tenth of a sigma apart, and the same without noise.
TEST(Triangulation, AgreesWithOpenCV) {
  Random random(2);
  auto cameras = rig(2, false);
  for (auto& camera : cameras) camera.model.distortion = Division{};
  for (const bool noisy : {false, true}) {
    for (int trial = 0; trial < 20; ++trial) {
      auto observations = seen(cameras, test::uniform_vector(random, 120), 0.01 * Matrix2d::Identity());
      if (noisy) add_noise(observations, 0, random);
      const TriangulatedPoint point = triangulate({cameras, observations});
      ASSERT_EQ(point.code, Code::ok) << point.reason;
      cv::Mat matrix[2], pixel[2], peer;
      for (std::size_t i = 0; i < 2; ++i) {
        const CameraModel& model = cameras[i].model;
        const Pose X_CW = cameras[i].X_WC.inverse();
        Matrix3d K;
        K << model.fx_px, 0, model.cx_px, 0, model.fy_px, model.cy_px, 0, 0, 1;
        const Eigen::Matrix<double, 3, 4> P = K * X_CW.matrix().topRows<3>();
        matrix[i].create(3, 4, CV_64F);
        for (int row = 0; row < 3; ++row)
          for (int column = 0; column < 4; ++column) matrix[i].at<double>(row, column) = P(row, column);
        pixel[i] = (cv::Mat_<double>(2, 1) << observations[i].u_px.x(), observations[i].u_px.y());
      }
      cv::triangulatePoints(matrix[0], matrix[1], pixel[0], pixel[1], peer);
      const Vector3d p_peer =
          Vector3d(peer.at<double>(0), peer.at<double>(1), peer.at<double>(2)) / peer.at<double>(3);
      const double sigma_mm = std::sqrt(point.covariance_mm2.trace());
      EXPECT_LT((point.p_W_mm - p_peer).norm(), noisy ? 0.1 * sigma_mm : 1e-6);
    }
  }
}

TEST(Triangulation, IsTheMostLikelyPlace) {
  Random random(3);
  for (const bool brown : {false, true}) {
    const auto cameras = rig(3, brown);
    auto observations = seen(cameras, {40, -60, 25});
    for (auto& observation : observations) observation.covariance_px2 = covariance(random);
    add_noise(observations, 0, random);
    const TriangulatedPoint point = triangulate({cameras, observations});
    ASSERT_EQ(point.code, Code::ok) << point.reason;
    const auto cost = [&](const Vector3d& p_W) {
      double sum = 0;
      for (const Observation& observation : observations) {
        const auto& camera = cameras[observation.camera];
        const Vector2d deviation = observation.u_px - test::photograph(camera.model, camera.X_WC, p_W);
        sum += deviation.dot(observation.covariance_px2.inverse() * deviation);
      }
      return sum;
    };
    const double least = cost(point.p_W_mm);
    for (int i = 0; i < 27; ++i) {
      if (i == 13) continue;
      const Vector3d step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      EXPECT_GT(cost(point.p_W_mm + 1e-3 * step), least);
      // Second differences are the inverse covariance.
      const double bend = (cost(point.p_W_mm + 0.02 * step) + cost(point.p_W_mm - 0.02 * step) - 2 * least) /
                          (2 * 0.02 * 0.02);
      EXPECT_NEAR(bend / step.dot(point.covariance_mm2.inverse() * step), 1, 2e-3);
    }
  }
}

// 2000 trials: a frequency of 95 % is known to 0.5 %, one of 0.1 % gives 2, more than 10 hardly ever.
TEST(Triangulation, ErrorsAreAsLargeAsTheCovarianceSays) {
  constexpr int trials = 2000;
  Random random(4);
  for (const std::size_t count : {2u, 4u})
    for (const double system_sigma_px : {0.0, 0.08}) {
      const auto cameras = rig(count, count == 4);
      const Vector3d p_W(30, 70, -40);
      auto exact = seen(cameras, p_W);
      for (auto& observation : exact) observation.covariance_px2 = covariance(random);
      int inside = 0, refused = 0;
      for (int trial = 0; trial < trials; ++trial) {
        auto observations = exact;
        add_noise(observations, system_sigma_px, random);
        const TriangulatedPoint point = triangulate({cameras, observations, system_sigma_px});
        if (point.code == Code::deviation_not_attributable) ++refused;
        const Vector3d error = point.p_W_mm - p_W;
        inside += error.dot(point.covariance_mm2.inverse() * error) < quantile95_of_3;
      }
      EXPECT_GE(inside, 0.93 * trials) << count << " cameras, system " << system_sigma_px;
      EXPECT_LE(inside, 0.97 * trials) << count << " cameras, system " << system_sigma_px;
      EXPECT_LE(refused, 10);
    }
}

TEST(Triangulation, DoesNotDependOnTheOrderOfTheCameras) {
  Random random(5);
  auto cameras = rig(4, false);
  auto observations = seen(cameras, {10, 20, 30});
  add_noise(observations, 0, random);
  const TriangulatedPoint point = triangulate({cameras, observations});
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<std::size_t> order{0, 1, 2, 3};
    std::shuffle(order.begin(), order.end(), random);
    std::vector<CalibratedCamera> other_cameras(4);
    auto others = observations;
    for (std::size_t i = 0; i < 4; ++i) other_cameras[order[i]] = cameras[i];
    for (auto& observation : others) observation.camera = order[observation.camera];
    std::shuffle(others.begin(), others.end(), random);
    const TriangulatedPoint again = triangulate({other_cameras, others});
    ASSERT_EQ(again.code, Code::ok);
    EXPECT_LT((again.p_W_mm - point.p_W_mm).norm(), 1e-8);
    EXPECT_LT((again.covariance_mm2 - point.covariance_mm2).norm(), 1e-8 * point.covariance_mm2.norm());
    EXPECT_NEAR(again.ray_gap_mm, point.ray_gap_mm, 1e-8);
  }
}

TEST(Triangulation, GoesWithTheWorld) {
  Random random(6);
  const auto cameras = rig(3, true);
  auto observations = seen(cameras, {-50, 20, 30});
  add_noise(observations, 0, random);
  const TriangulatedPoint point = triangulate({cameras, observations});
  for (int trial = 0; trial < 20; ++trial) {
    const Pose X_VW = test::uniform_pose(random, 5000);
    auto moved_cameras = cameras;
    for (auto& camera : moved_cameras) camera.X_WC = X_VW * camera.X_WC;
    const TriangulatedPoint moved_point = triangulate({moved_cameras, observations});
    ASSERT_EQ(moved_point.code, Code::ok) << moved_point.reason;
    const Matrix3d turned = X_VW.linear() * point.covariance_mm2 * X_VW.linear().transpose();
    EXPECT_LT((moved_point.p_W_mm - X_VW * point.p_W_mm).norm(), 1e-7);
    EXPECT_LT((moved_point.covariance_mm2 - turned).norm(), 1e-7 * turned.norm());
    EXPECT_NEAR(moved_point.ray_gap_mm, point.ray_gap_mm, 1e-7);
  }
}

// Two cameras that look across at each other's axis, in the plane y = 0.
std::vector<CalibratedCamera> pair() {
  std::vector<CalibratedCamera> cameras(2);
  for (std::size_t i = 0; i < 2; ++i) {
    cameras[i].name = i == 0 ? "left" : "right";
    cameras[i].model = {768, 572, 2000, 2000, 384, 286, Division{}};
    cameras[i].X_WC = from_six_numbers({i == 0 ? -400.0 : 400.0, 0, 0, 0, i == 0 ? 20.0 : -20.0, 0});
  }
  return cameras;
}

TEST(Triangulation, RayGapIsTheShortestDistanceOfTheRays) {
  const auto cameras = pair();
  const auto observations = seen(cameras, {30, 0, 1000}, Matrix2d::Identity());
  auto lifted = cameras;  // its ray stays in a plane y = 0.4
  lifted[1].X_WC.translation().y() += 0.4;
  const TriangulatedPoint point = triangulate({lifted, observations});
  ASSERT_EQ(point.code, Code::ok) << point.reason;
  EXPECT_NEAR(point.ray_gap_mm, 0.4, 1e-9);
  EXPECT_NEAR(point.p_W_mm.y(), 0.2, 0.02);
}

TEST(Triangulation, RayGapOfThreeCamerasIsTheRootMeanSquareDistance) {
  Random random(7);
  const auto cameras = rig(3, false);
  auto observations = seen(cameras, {0, 10, 20}, 0.01 * Matrix2d::Identity());
  add_noise(observations, 0, random);
  const TriangulatedPoint point = triangulate({cameras, observations});
  double sum = 0;
  for (const Observation& observation : observations) {
    const auto& camera = cameras[observation.camera];
    const Vector3d p_C = camera.X_WC.inverse() * point.p_W_mm;
    const Vector3d direction = ray(camera.model, observation.u_px)->normalized();
    sum += (p_C - direction.dot(p_C) * direction).squaredNorm() / 3;
  }
  EXPECT_NEAR(point.ray_gap_mm, std::sqrt(sum), 1e-9);
  EXPECT_GT(point.ray_gap_mm, 0.01);
}

void expect_refused(const TriangulatedPoint& point, Code code, const std::string& words) {
  EXPECT_EQ(point.code, code) << point.reason;
  EXPECT_NE(point.reason.find(words), std::string::npos) << point.reason;
}

TEST(Triangulation, NeedsTwoCameras) {
  const auto cameras = pair();
  auto observations = seen(cameras, {30, 0, 1000});
  observations[1] = observations[0];  // one camera twice
  expect_refused(triangulate({cameras, observations}), Code::too_few_cameras, "seen by 1");
  expect_refused(triangulate({cameras, {}}), Code::too_few_cameras, "seen by 0");
  auto again = seen(cameras, {30, 0, 1000});
  again.push_back(again[0]);
  expect_refused(triangulate({cameras, again}), Code::marks_invalid, "twice");
}

TEST(Triangulation, RefusesRaysThatAreParallelWithinTheirNoise) {
  auto cameras = pair();
  for (auto& camera : cameras) camera.X_WC.linear().setIdentity();
  std::vector<Observation> observations(2);
  for (std::size_t i = 0; i < 2; ++i) {
    observations[i].camera = i;
    observations[i].u_px = {400, 300};
    observations[i].covariance_px2 = 1e-4 * Matrix2d::Identity();
  }
  expect_refused(triangulate({cameras, observations}), Code::geometry_degenerate, "parallel");
  // 800 mm apart, 0.01 px of 2000: at 5000 m the angle is 23 sigmas, at 50 km it is two.
  EXPECT_EQ(triangulate({cameras, seen(cameras, {0, 0, 5e6})}).code, Code::ok);
  expect_refused(triangulate({cameras, seen(cameras, {0, 0, 5e7})}), Code::geometry_degenerate, "parallel");
  expect_refused(triangulate({cameras, seen(cameras, {0, 0, 5e6}), 0.1}), Code::geometry_degenerate,
                 "parallel");
  // Two cameras that look at each other: the point is anywhere between them.
  cameras[0].X_WC = from_six_numbers({-400, 0, 0, 0, 90, 0});
  cameras[1].X_WC = from_six_numbers({400, 0, 0, 0, -90, 0});
  for (auto& observation : observations) observation.u_px = {384, 286};
  expect_refused(triangulate({cameras, observations}), Code::geometry_degenerate, "parallel");
}

TEST(Triangulation, RefusesRaysThatMeetBehindACamera) {
  auto cameras = pair();
  std::vector<Observation> observations(2);
  for (std::size_t i = 0; i < 2; ++i) {
    cameras[i].X_WC.linear() = from_six_numbers({0, 0, 0, 0, i == 0 ? -20.0 : 20.0, 0}).linear();
    observations[i].camera = i;
    observations[i].u_px = {384, 286};
  }
  expect_refused(triangulate({cameras, observations}), Code::not_converged, "behind camera left");
}

TEST(Triangulation, NamesTheCameraThatContradicts) {
  const auto cameras = rig(4, false);
  auto observations = seen(cameras, {0, 0, 50});
  observations[2].u_px += Vector2d(3, -4);
  const TriangulatedPoint point = triangulate({cameras, observations});
  expect_refused(point, Code::deviation_not_attributable, "camera3");
  EXPECT_EQ(point.deviations_px.size(), 4u);
  EXPECT_GT(point.ray_gap_mm, 0.5);
  // Two cameras notice what is across their common plane, and the system's sigma excuses it.
  const auto two = pair();
  auto seen_by_two = seen(two, {30, 0, 1000});
  seen_by_two[0].u_px.y() += 0.1;
  expect_refused(triangulate({two, seen_by_two}), Code::deviation_not_attributable, "contradict");
  EXPECT_EQ(triangulate({two, seen_by_two, 0.1}).code, Code::ok);
}

TEST(Triangulation, AnswersWithACodeToNumbersThatCannotBeUsed) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto good_cameras = pair();
  const auto good = seen(good_cameras, {30, 0, 1000});
  const auto refuses = [&](const std::string& words, auto spoil) {
    auto cameras = good_cameras;
    auto observations = good;
    TriangulationProblem problem{cameras, observations};
    spoil(cameras, observations, problem);
    expect_refused(triangulate(problem), Code::marks_invalid, words);
  };
  using Cameras = std::vector<CalibratedCamera>;
  using Observations = std::vector<Observation>;
  using Problem = TriangulationProblem;
  refuses("observation 2", [](Cameras&, Observations& o, Problem&) { o[1].camera = 2; });
  refuses("not finite", [](Cameras&, Observations& o, Problem&) { o[0].u_px.y() = nan; });
  refuses("positive definite", [](Cameras&, Observations& o, Problem&) { o[0].covariance_px2.setZero(); });
  refuses("positive definite",
          [](Cameras&, Observations& o, Problem&) { o[0].covariance_px2 << 1, 2, 2, 1; });
  refuses("not usable", [](Cameras& c, Observations&, Problem&) { c[1].model.fx_px = 0; });
  refuses("not usable", [](Cameras& c, Observations&, Problem&) { c[1].X_WC.translation().x() = nan; });
  refuses("no ray", [](Cameras& c, Observations& o, Problem&) {
    c[1].model.distortion = Division{-2.0};
    o[1].u_px.x() = 1e5;
  });
  refuses("system's sigma", [](Cameras&, Observations&, Problem& p) { p.system_sigma_px = -1; });
  refuses("system's sigma", [](Cameras&, Observations&, Problem& p) { p.system_sigma_px = nan; });
}

}  // namespace
}  // namespace zeropose
