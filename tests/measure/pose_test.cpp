#include "measure/pose.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "measure/pose_model.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::car_body_points;
using test::CellScene;
using test::estimate;
using Random = test::Random;

void use_brown(CellScene& scene) {
  for (auto& camera : scene.cameras) camera.model.distortion = BrownConrady{-0.2, 0.05, 0.001, -0.001, 0.01};
}

TEST(Pose, OfExactPixelsIsExactFromAnyStartWithin500MillimetresAnd30Degrees) {
  const CellScene scene = test::car_body();
  Random random(1);
  for (int trial = 0; trial < 150; ++trial) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0, random);
    Vector6 delta;
    delta << test::uniform_vector(random, 500), test::uniform_vector(random, 30 / degrees_per_radian);
    const PoseResult result = estimate(scene, observations, moved(X_WO, delta));
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    test::expect_near(result.X_WO, X_WO, 1e-6, 1e-7);
    EXPECT_EQ(result.effective_marks, 12);
    EXPECT_EQ(result.effective_cameras, 4);
    EXPECT_EQ(result.redundancy, 18);
  }
}

TEST(Pose, NeedsNoStart) {
  const CellScene scene = test::car_body();
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    CellScene turned = scene;
    // The same view of an object whose coordinates are turned any way.
    const Pose X_WO = test::uniform_pose(random, 2000);
    for (Mark& mark : turned.job.marks) {
      mark.p_O_mm = X_WO.inverse() * mark.p_O_mm;
      mark.normal_O = X_WO.linear().transpose() * mark.normal_O;
    }
    const auto observations = test::observe(turned.cameras, turned.job, X_WO, 0.1, random);
    const PoseResult far = estimate(turned, observations, std::nullopt);
    ASSERT_EQ(far.code, Code::ok) << far.reason;
    test::expect_near(far.X_WO, estimate(turned, observations, X_WO).X_WO, 1e-5, 1e-6);
  }
}

TEST(Pose, NeedsNoStartWithOneCamera) {
  CellScene scene = car_body_points();
  Random random(3);
  scene.job.marks.resize(6);
  scene.job.views.clear();
  for (std::size_t i = 0; i < 6; ++i) scene.job.views.push_back({0, i});
  int solved = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Pose X_WO = scene.cameras[0].X_WC * Pose(Eigen::Translation3d(0, 0, 2000));
    X_WO.linear() = test::uniform_rotation(random);
    for (Mark& mark : scene.job.marks) mark.p_O_mm = test::uniform_vector(random, 250);
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0, random);
    const PoseResult result = estimate(scene, observations, std::nullopt);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    test::expect_near(result.X_WO, X_WO, 1e-4, 1e-4);
    ++solved;
  }
  EXPECT_EQ(solved, 20);
}

TEST(Pose, JacobianAgreesWithFiniteDifferences) {
  Random random(4);
  for (const bool brown : {false, true})
    for (const Residual residual : {Residual::reprojection, Residual::algebraic}) {
      CellScene scene = car_body_points();
      if (brown) use_brown(scene);
      const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 3, random);
      PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
      problem.residual = residual;
      PoseModel model(problem), other(problem);
      const CentredPose at = model.centred(test::random_shift(random, 30, 0.2));
      NormalEquations equations, ignored;
      ASSERT_TRUE(model.linearise(at, equations));
      Matrix6 N = Matrix6::Zero();
      for (std::size_t i = 0; i < model.size(); ++i) N += model.WJ(i).transpose() * model.WJ(i);
      EXPECT_LT((N - equations.N).norm(), 1e-12 * N.norm());
      for (int axis = 0; axis < 6; ++axis) {
        const double h = axis < 3 ? 1e-2 : 1e-5, unit = axis < 3 ? 1 : model.extent_mm();
        Vector6 delta = Vector6::Zero();
        delta(axis) = h;
        std::vector<Eigen::Vector2d> slopes;
        ASSERT_TRUE(other.linearise(moved(at, delta), ignored));
        for (std::size_t i = 0; i < other.size(); ++i) slopes.push_back(-other.Wr(i));
        ASSERT_TRUE(other.linearise(moved(at, -delta), ignored));
        for (std::size_t i = 0; i < slopes.size(); ++i) {
          const Eigen::Vector2d slope = (slopes[i] + other.Wr(i)) / (2 * h * unit);
          const Eigen::Vector2d analytic = model.WJ(i).col(axis);
          EXPECT_LT((slope - analytic).norm(), 1e-5 * std::max(1.0 / unit, analytic.norm()));
        }
      }
    }
}

// Rows of the whitened Jacobian W J by differences of the whole chain, about O's origin, axes of W.
Eigen::MatrixXd whitened_jacobian(const CellScene& scene, std::span<const Observation> observations,
                                  const Pose& X_WO) {
  const auto pixels = [&](const Pose& pose) {
    Eigen::VectorXd u(2 * observations.size());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const auto& camera = scene.cameras[observations[i].camera];
      u.segment<2>(static_cast<Eigen::Index>(2 * i)) =
          *project(camera.model, camera.X_WC.inverse() * pose * scene.job.marks[observations[i].mark].p_O_mm);
    }
    return u;
  };
  Eigen::MatrixXd J(2 * observations.size(), 6);
  for (int axis = 0; axis < 6; ++axis) {
    const double h = axis < 3 ? 1e-2 : 1e-5;
    Vector6 delta = Vector6::Zero();
    delta(axis) = h;
    J.col(axis) = (pixels(moved(X_WO, delta)) - pixels(moved(X_WO, -delta))) / (2 * h);
  }
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Eigen::Matrix2d L = observations[i].covariance_px2.llt().matrixL();
    const auto row = static_cast<Eigen::Index>(2 * i);
    J.middleRows<2>(row) = (L.inverse() * J.middleRows<2>(row)).eval();
  }
  return J;
}

TEST(Pose, CovarianceIsThatOfWeightsWhichAreNoInverseVariances) {
  CellScene scene = car_body_points();
  Random random(5);
  for (Mark& mark : scene.job.marks) mark.weight = test::uniform(random, 0.2, 1);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
  for (Observation& observation : observations)
    observation.covariance_px2 << test::uniform(random, 0.01, 0.04), 0.005, 0.005,
        test::uniform(random, 0.01, 0.04);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  ASSERT_EQ(result.code, Code::ok);
  const Eigen::MatrixXd J = whitened_jacobian(scene, observations, result.X_WO);
  Eigen::VectorXd w2(J.rows());
  for (std::size_t i = 0; i < observations.size(); ++i)
    w2.segment<2>(static_cast<Eigen::Index>(2 * i))
        .setConstant(std::pow(scene.job.marks[observations[i].mark].weight, 2));
  const Matrix6 N = J.transpose() * w2.asDiagonal() * J;
  const Matrix6 expected = N.inverse() * (J.transpose() * w2.cwiseAbs2().asDiagonal() * J) * N.inverse();
  const Vector6 scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6 error = scale.asDiagonal() * (result.covariance - expected) * scale.asDiagonal();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((result.covariance - result.total_covariance).norm(), 1e-12 * expected.norm());
}

TEST(Pose, ErrorsAreAsLargeAsTheCovarianceSays) {
  CellScene scene = car_body_points();
  Random random(6);
  for (Mark& mark : scene.job.marks) mark.weight = test::uniform(random, 0.3, 1);
  constexpr int trials = 500;
  double errors = 0, deviations = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    PoseProblem problem = test::problem_of(scene.cameras, scene.job, {}, Pose::Identity());
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0.1, random);
    problem.observations = observations;
    problem.reject_wrong_marks = false;
    const PoseResult result = estimate_pose(problem);
    const Vector6 error = difference(X_WO, result.X_WO);
    errors += error.dot(result.covariance.inverse() * error) / trials;
    for (const Deviation& deviation : result.deviations)
      deviations += deviation.normalised * deviation.normalised / (12 * trials);
  }
  // Chi-squared with 6 and 2 degrees of freedom; four standard deviations of the means (the 12 of a trial
  // taken as dependent).
  EXPECT_NEAR(errors, 6, 4 * std::sqrt(12.0 / trials));
  EXPECT_NEAR(deviations, 2, 4 * std::sqrt(4.0 / trials));
}

TEST(Pose, TotalCovarianceContainsSystemAndMarks) {
  CellScene scene = car_body_points();
  Random random(7);
  const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  const Matrix6 plain = estimate(scene, observations, Pose::Identity()).total_covariance;
  scene.job.system_sigma_px = 0.1;
  const PoseResult system = estimate(scene, observations, Pose::Identity());
  EXPECT_LT((system.total_covariance - 2 * plain).norm(), 1e-9 * plain.norm());
  EXPECT_LT((system.covariance - plain).norm(), 1e-9 * plain.norm());
  scene.job.system_sigma_px = 0;
  for (Mark& mark : scene.job.marks) mark.sigma_mm = 0.5;
  EXPECT_GT(estimate(scene, observations, Pose::Identity()).total_covariance(0, 0), 4 * plain(0, 0));
}

TEST(Pose, MarksOfWeightZeroAreReportedButNotUsed) {
  CellScene scene = car_body_points();
  Random random(8);
  scene.job.marks[4].weight = 0;
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.01, random);
  const PoseResult before = estimate(scene, observations, Pose::Identity());
  observations[4].u_px += Eigen::Vector2d(30, 40);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  EXPECT_EQ(result.X_WO.matrix(), before.X_WO.matrix());
  EXPECT_FALSE(result.deviations[4].used);
  EXPECT_FALSE(result.deviations[4].removed);
  EXPECT_NEAR(result.deviations[4].dev_px.norm(), 50, 0.2);
  EXPECT_EQ(result.effective_marks, 11);
  EXPECT_EQ(result.redundancy, 16);
}

TEST(Pose, DeviationsAreFoundMinusProjectedInPixelsAndAtTheMarksDistance) {
  CellScene scene = car_body_points();
  Random random(9);
  const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.5, random);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const auto& camera = scene.cameras[observations[i].camera];
    const Eigen::Vector3d p_C =
        camera.X_WC.inverse() * result.X_WO * scene.job.marks[observations[i].mark].p_O_mm;
    const Eigen::Vector2d dev_px = observations[i].u_px - *project(camera.model, p_C);
    EXPECT_LT((result.deviations[i].dev_px - dev_px).norm(), 1e-4);
    EXPECT_NEAR(result.deviations[i].dev_mm.x(), dev_px.x() / camera.model.fx_px * p_C.z(), 1e-4);
    EXPECT_NEAR(result.deviations[i].dev_mm.y(), dev_px.y() / camera.model.fy_px * p_C.z(), 1e-4);
  }
}

TEST(Pose, IsRepeatableBitByBit) {
  const CellScene scene = test::car_body();
  Random random(10);
  const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  const PoseResult first = estimate(scene, observations, std::nullopt);
  const PoseResult again = estimate(scene, observations, std::nullopt);
  EXPECT_EQ(first.X_WO.matrix(), again.X_WO.matrix());
  EXPECT_EQ(first.covariance, again.covariance);
}

TEST(Pose, ByAlgebraicResidualsIsExactAsWell) {
  const CellScene scene = test::car_body();
  Random random(11);
  for (const double sigma_px : {0.0, 0.1}) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, sigma_px, random);
    PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
    problem.residual = Residual::algebraic;
    const PoseResult result = estimate_pose(problem);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    const Vector6 error = difference(X_WO, result.X_WO);
    const Vector6 sigmas = result.covariance.diagonal().cwiseSqrt();
    EXPECT_LT(error.cwiseQuotient(sigmas).cwiseAbs().maxCoeff(), sigma_px > 0 ? 5 : 1e-3);
    const PoseResult pixels = estimate(scene, observations, Pose::Identity());
    for (int axis = 0; axis < 6; ++axis)
      EXPECT_NEAR(result.covariance(axis, axis) / pixels.covariance(axis, axis), 1, 0.3);
  }
}

TEST(Pose, OfASheetHasThreeUnknownsAndNeedsTwoMarks) {
  CellScene scene = car_body_points();
  Random random(12);
  const Pose X_WP = from_six_numbers({1000, 20, 200, 2, -3, 15});
  for (const std::size_t count : {2u, 3u, 12u})
    for (const bool start : {true, false}) {
      CellScene sheet = scene;
      sheet.job.views.clear();
      for (std::size_t i = 0; i < count; ++i) sheet.job.views.push_back(scene.job.views[i * 12 / count]);
      const Pose X_PO = from_six_numbers({-980, 10, 0, 0, 0, -14.5});
      const Pose X_WO = X_WP * X_PO;
      for (Mark& mark : sheet.job.marks) mark.p_O_mm = X_WO.inverse() * mark.p_O_mm;
      const auto observations = test::observe(sheet.cameras, sheet.job, X_WO, 0, random);
      PoseProblem problem = test::problem_of(sheet.cameras, sheet.job, observations, X_WP);
      problem.X_WP_planar = X_WP;
      if (!start) problem.X_WO_start.reset();
      const PoseResult result = estimate_pose(problem);
      ASSERT_EQ(result.code, Code::ok) << result.reason;
      test::expect_near(result.X_WO, X_WO, 1e-5, 1e-6);
      EXPECT_EQ(result.redundancy, 2 * static_cast<int>(count) - 3);
      const SixNumbers flat = to_six_numbers(X_WP.inverse() * result.X_WO);
      EXPECT_NEAR(flat.z_mm, 0, 1e-9);
      EXPECT_NEAR(flat.rx_deg, 0, 1e-9);
      const Eigen::Vector3d normal_W = X_WP.linear().col(2);
      EXPECT_NEAR(normal_W.dot(result.covariance.topLeftCorner<3, 3>() * normal_W), 0, 1e-15);
    }
}

}  // namespace
}  // namespace zeropose
