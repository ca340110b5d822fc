// Zero measurement and compensation (spec 50 M4, M5).
#include "measure/zero.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/eccentricity.h"
#include "measure/compensation.h"
#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;

std::vector<std::vector<Observation>> frames_of(const CellScene& scene, const Pose& X_WO, int count,
                                                double sigma_px, test::Random& random) {
  std::vector<std::vector<Observation>> frames;
  for (int frame = 0; frame < count; ++frame)
    frames.push_back(test::observe(scene.cameras, scene.job, X_WO, sigma_px, random));
  return frames;
}

// Exact pixels, a wrong calibration, and the pose that is estimated with it.
struct Wrong {
  CellScene scene = test::car_body();
  std::vector<CalibratedCamera> believed;
  std::vector<Observation> observations;
  PoseResult pose;

  explicit Wrong(std::uint64_t seed) : believed(wrong_calibration(scene.cameras, {}, seed)) { observe(); }

  void observe() {
    test::Random random(1);
    observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
    pose = estimate(scene.job);
  }
  PoseResult estimate(const Job& job) const {
    PoseProblem problem = test::problem_of(believed, job, observations, Pose::Identity());
    problem.reject_wrong_marks = false;
    return estimate_pose(problem);
  }
  CompensationResult compensated(double alpha) const {
    CompensationProblem problem;
    problem.cameras = believed;
    problem.marks = scene.job.marks;
    problem.observations = observations;
    problem.X_WO0 = pose.X_WO;
    problem.alpha = alpha;
    return compensate(problem);
  }
};

TEST(Compensation, CarriesEveryMarkToWhereItIsSeenAtConstantDepth) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Wrong wrong(seed);
    const CompensationResult result = wrong.compensated(0.5);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    EXPECT_LT(result.rounds, 20);
    EXPECT_LT(result.largest_deviation_px, 1e-4);
    for (const Observation& observation : wrong.observations) {
      const Pose X_CO = wrong.believed[observation.camera].X_WC.inverse() * wrong.pose.X_WO;
      const Eigen::Vector3d shift_C = X_CO.linear() * result.shifts_O_mm[observation.mark];
      EXPECT_NEAR(shift_C.z(), 0, 1e-9);
      EXPECT_GT(shift_C.norm(), 0);
    }
  }
}

TEST(Compensation, LeavesTheZeroPoseWhereItIs) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Wrong wrong(seed);
    const CompensationResult result = wrong.compensated(0.5);
    const Job job = compensated(wrong.scene.job, {wrong.pose.X_WO, result.shifts_O_mm});
    // 2e-8 deg are 1e-6 mm at 3 m.
    test::expect_near(wrong.estimate(job).X_WO, wrong.pose.X_WO, 1e-6, 2e-8);
  }
}

TEST(Compensation, ConvergesForEveryShareOfTheWay) {
  const Wrong wrong(3);
  const CompensationResult half = wrong.compensated(0.5);
  for (const double alpha : {0.2, 0.9, 1.0}) {
    const CompensationResult result = wrong.compensated(alpha);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    for (std::size_t i = 0; i < 12; ++i)
      EXPECT_LT((result.shifts_O_mm[i] - half.shifts_O_mm[i]).norm(), 3e-4);
  }
}

TEST(Compensation, OfAMarkThatSeveralCamerasSeeIsTheirBestCompromise) {
  Wrong wrong(5);
  // A mark between cameras 1 and 3, and one between all.
  for (auto& camera : wrong.believed) camera.model.distortion = Division{};
  for (auto& camera : wrong.scene.cameras) camera.model.distortion = Division{};
  for (const std::size_t mark : {1u, 7u})
    for (std::size_t camera = 0; camera < 4; ++camera)
      if (std::none_of(wrong.scene.job.views.begin(), wrong.scene.job.views.end(),
                       [&](const View& view) { return view.mark == mark && view.camera == camera; }))
        wrong.scene.job.views.push_back({camera, mark});
  for (std::size_t mark : {1u, 7u}) wrong.scene.job.marks[mark].radius_mm = 0;
  wrong.observe();
  ASSERT_EQ(wrong.observations.size(), 18u);
  ASSERT_EQ(wrong.pose.code, Code::ok) << wrong.pose.reason;
  const CompensationResult result = wrong.compensated(0.5);
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  EXPECT_LT(result.rounds, 30);
  EXPECT_GT(result.largest_deviation_px, 0.1);  // the cameras contradict each other
  const Job job = compensated(wrong.scene.job, {wrong.pose.X_WO, result.shifts_O_mm});
  const PoseResult again = wrong.estimate(job);
  test::expect_near(again.X_WO, wrong.pose.X_WO, 2e-4, 1e-5);
  // No other place of the mark fits all cameras better.
  const auto misfit = [&](std::size_t mark, const Eigen::Vector3d& shift_O) {
    double sum = 0;
    for (const Observation& observation : wrong.observations) {
      if (observation.mark != mark) continue;
      const auto& camera = wrong.believed[observation.camera];
      const Eigen::Vector3d p_O = wrong.scene.job.marks[mark].p_O_mm + shift_O;
      sum += (observation.u_px - *project(camera.model, camera.X_WC.inverse() * wrong.pose.X_WO * p_O))
                 .squaredNorm();
    }
    return sum;
  };
  for (const std::size_t mark : {1u, 7u})
    for (int axis = 0; axis < 3; ++axis)
      for (const double step : {-0.01, 0.01})
        EXPECT_GT(misfit(mark, result.shifts_O_mm[mark] + step * Eigen::Vector3d::Unit(axis)),
                  misfit(mark, result.shifts_O_mm[mark]));
}

TEST(Compensation, AnswersWithACodeToWhatItCannotUse) {
  const Wrong wrong(1);
  for (const double alpha : {0.0, -1.0, 1.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(wrong.compensated(alpha).code, Code::marks_invalid);
  Wrong other(1);
  other.observations[2].mark = 99;
  EXPECT_EQ(other.compensated(0.5).code, Code::marks_invalid);
}

TEST(Zero, IsTheMeanOfItsFrames) {
  const CellScene scene = test::car_body();
  test::Random random(1);
  const Pose X_WO0 = from_six_numbers({3, -2, 1, 0.1, -0.1, 0.05});
  const auto frames = frames_of(scene, X_WO0, 10, 0.1, random);
  const ZeroResult result = make_zero(scene.cameras, scene.job, frames);
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  std::vector<Pose> singles;
  for (const auto& frame : frames) {
    PoseProblem problem = test::problem_of(scene.cameras, scene.job, frame, Pose::Identity());
    problem.reject_wrong_marks = false;
    singles.push_back(estimate_pose(problem).X_WO);
  }
  test::expect_near(result.zero.X_WO0, average(singles), 1e-3, 1e-4);
  test::expect_near(result.zero.X_WO0, X_WO0, 0.2, 0.01);
  // Spread of ten: between half and twice its expectation.
  PoseProblem problem = test::problem_of(scene.cameras, scene.job, frames[0], X_WO0);
  const Vector6 sigma = estimate_pose(problem).covariance.diagonal().cwiseSqrt();
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_GT(result.spread(axis), 0.4 * sigma(axis));
    EXPECT_LT(result.spread(axis), 2 * sigma(axis));
  }
  EXPECT_NEAR(std::sqrt(result.pose.covariance(0, 0)), sigma(0) / std::sqrt(10.0), 0.1 * sigma(0));
}

// Round the mean of the single frames' poses, whatever the pose of the averaged pixels is.
TEST(Zero, SpreadIsRoundTheMeanOfTheFrames) {
  const CellScene scene = test::car_body();
  test::Random random(6);
  const auto frames = frames_of(scene, Pose::Identity(), 5, 0.1, random);
  const ZeroResult result = make_zero(scene.cameras, scene.job, frames);
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  const Job job = compensated(scene.job, result.zero);
  std::vector<Pose> singles;
  for (const auto& frame : frames) {
    PoseProblem problem = test::problem_of(scene.cameras, job, frame, result.zero.X_WO0);
    problem.reject_wrong_marks = false;
    singles.push_back(estimate_pose(problem).X_WO);
  }
  Vector6 squares = Vector6::Zero();
  for (const Pose& X_WO : singles) squares += difference(average(singles), X_WO).cwiseAbs2() / 4;
  EXPECT_LT((result.spread - squares.cwiseSqrt()).norm(), 1e-12);
}

TEST(Zero, OfOneFrameHasNoSpread) {
  const CellScene scene = test::car_body();
  test::Random random(2);
  const ZeroResult result =
      make_zero(scene.cameras, scene.job, frames_of(scene, Pose::Identity(), 1, 0.1, random));
  ASSERT_EQ(result.code, Code::ok);
  EXPECT_EQ(result.spread, Vector6::Zero());
  EXPECT_EQ(result.zero.compensation_O_mm.size(), 12u);
}

TEST(Zero, ToleratesAMarkMissingInSomeFrames) {
  const CellScene scene = test::car_body();
  test::Random random(3);
  auto frames = frames_of(scene, Pose::Identity(), 10, 0.1, random);
  for (std::size_t i = 0; i < 4; ++i) frames[i].erase(frames[i].begin() + 5);
  EXPECT_EQ(make_zero(scene.cameras, scene.job, frames).code, Code::ok);
  frames[4].erase(frames[4].begin() + 5);
  const ZeroResult result = make_zero(scene.cameras, scene.job, frames);
  EXPECT_EQ(result.code, Code::too_few_marks);
  EXPECT_NE(result.reason.find("camera2/3"), std::string::npos) << result.reason;
  EXPECT_TRUE(result.zero.compensation_O_mm.empty());
}

TEST(Zero, RefusesAMarkThatWanders) {
  const CellScene scene = test::car_body();
  test::Random random(4);
  auto frames = frames_of(scene, Pose::Identity(), 10, 0.01, random);
  frames[6][3].u_px.x() += 1.2;
  const ZeroResult result = make_zero(scene.cameras, scene.job, frames);
  EXPECT_EQ(result.code, Code::deviation_not_attributable);
  EXPECT_NE(result.reason.find("camera2/1"), std::string::npos) << result.reason;
}

TEST(Zero, DoesNotCompensateAWrongMarkAway) {
  const CellScene scene = test::car_body();
  test::Random random(5);
  auto frames = frames_of(scene, Pose::Identity(), 10, 0.01, random);
  for (auto& frame : frames) frame[8].u_px.y() += 20;
  const ZeroResult result = make_zero(scene.cameras, scene.job, frames);
  EXPECT_EQ(result.code, Code::compensation_too_large);
  EXPECT_NE(result.reason.find("camera3/3"), std::string::npos) << result.reason;
  EXPECT_TRUE(result.zero.compensation_O_mm.empty());
}

TEST(Zero, NeedsFrames) {
  const CellScene scene = test::car_body();
  EXPECT_EQ(make_zero(scene.cameras, scene.job, {}).code, Code::too_few_marks);
  Job broken = scene.job;
  broken.views[0].camera = 17;
  EXPECT_EQ(make_zero(scene.cameras, broken, {}).code, Code::marks_invalid);
}

}  // namespace
}  // namespace zeropose
