// What holds for every measurement whatever the cell: frames and orders do not matter, covariances hold,
// compensation and weights leave the zero pose alone, virtual cameras are cameras (spec 50 M3 to M6).
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <numbers>
#include <numeric>

#include "measure/compensation.h"
#include "measure/zero.h"
#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;
using Random = test::Random;

constexpr double quantile95_of_6 = 12.592;

PoseResult estimate(const CellScene& scene, std::span<const Observation> observations,
                    const Pose& X_WO_start) {
  PoseProblem problem = test::problem_of(scene.cameras, scene.job, observations, X_WO_start);
  problem.reject_wrong_marks = false;
  return estimate_pose(problem);
}

// The car body with some marks that all cameras see. Lenses without distortion: the published ones do not
// reach that far.
CellScene shared_marks(const std::vector<std::size_t>& shared) {
  CellScene scene = test::car_body_points();
  for (auto& camera : scene.cameras) camera.model.distortion = Division{};
  for (const std::size_t mark : shared)
    for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera)
      if (std::none_of(scene.job.views.begin(), scene.job.views.end(),
                       [&](const View& view) { return view.mark == mark && view.camera == camera; }))
        scene.job.views.push_back({camera, mark});
  return scene;
}

// --- frames and orders

TEST(MeasurementLaws, ThePoseGoesWithTheWorld) {
  Random random(1);
  const CellScene scene = test::car_body();
  const Pose X_WO = test::random_shift(random, 30, 0.2);
  const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0.1, random);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  for (int trial = 0; trial < 20; ++trial) {
    const Pose X_VW = test::uniform_pose(random, 5000);
    CellScene other = scene;
    for (auto& camera : other.cameras) camera.X_WC = X_VW * camera.X_WC;
    const PoseResult again = estimate(other, observations, X_VW);
    ASSERT_EQ(again.code, Code::ok) << again.reason;
    test::expect_near(again.X_WO, X_VW * result.X_WO, 1e-7, 1e-8);
    Matrix6 turn = Matrix6::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = X_VW.linear();
    const Matrix6 turned = turn * result.covariance * turn.transpose();
    EXPECT_LT((again.covariance - turned).norm(), 1e-6 * turned.norm());
  }
}

TEST(MeasurementLaws, ThePoseDoesNotDependOnTheOrderOfCamerasAndMarks) {
  Random random(2);
  const CellScene scene = test::car_body();
  const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<std::size_t> cameras(4), marks(12);
    std::iota(cameras.begin(), cameras.end(), 0);
    std::iota(marks.begin(), marks.end(), 0);
    std::shuffle(cameras.begin(), cameras.end(), random);
    std::shuffle(marks.begin(), marks.end(), random);
    CellScene other = scene;
    for (std::size_t i = 0; i < 4; ++i) other.cameras[cameras[i]] = scene.cameras[i];
    for (std::size_t i = 0; i < 12; ++i) other.job.marks[marks[i]] = scene.job.marks[i];
    auto others = observations;
    for (auto& observation : others) {
      observation.camera = cameras[observation.camera];
      observation.mark = marks[observation.mark];
    }
    std::shuffle(others.begin(), others.end(), random);
    const PoseResult again = estimate(other, others, Pose::Identity());
    ASSERT_EQ(again.code, Code::ok) << again.reason;
    test::expect_near(again.X_WO, result.X_WO, 1e-8, 1e-9);
  }
}

TEST(MeasurementLaws, WeightZeroIsTheSameAsNotBeingThere) {
  Random random(3);
  for (std::size_t mark = 0; mark < 12; ++mark) {
    CellScene scene = test::car_body();
    scene.job.marks[mark].weight = 0;
    auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
    const PoseResult with = estimate(scene, observations, Pose::Identity());
    std::erase_if(observations, [mark](const Observation& o) { return o.mark == mark; });
    const PoseResult without = estimate(scene, observations, Pose::Identity());
    test::expect_near(with.X_WO, without.X_WO, 1e-9, 1e-10);  // sums in another order
    EXPECT_LT((with.covariance - without.covariance).norm(), 1e-9 * without.covariance.norm());
  }
}

// --- covariance

// What is different about the object in one trial, beside the noise of the pixels.
using Disturb = std::function<void(Job& truth, Random&)>;

// Of 1500 trials the share in which the true pose is inside the ellipsoid of 95 %; a frequency of 95 % is
// known to 0.6 %.
double share_inside(const CellScene& scene, std::span<const Eigen::Matrix2d> covariances,
                    const Disturb& disturb, Random& random) {
  constexpr int trials = 1500;
  int inside = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    Job truth = scene.job;
    if (disturb) disturb(truth, random);
    auto observations = test::observe(scene.cameras, truth, X_WO, 0, random);
    for (std::size_t i = 0; i < observations.size(); ++i) {
      observations[i].covariance_px2 = covariances[i];
      const Eigen::Matrix2d C =
          covariances[i] + std::pow(scene.job.system_sigma_px, 2) * Eigen::Matrix2d::Identity();
      const Eigen::Matrix2d L = C.llt().matrixL();
      observations[i].u_px += L * Eigen::Vector2d(test::normal(random), test::normal(random));
    }
    const PoseResult result = estimate(scene, observations, Pose::Identity());
    EXPECT_EQ(result.code, Code::ok) << result.reason;
    const Vector6 error = difference(X_WO, result.X_WO);
    inside += error.dot(result.total_covariance.inverse() * error) < quantile95_of_6;
  }
  return static_cast<double>(inside) / trials;
}

void expect_95(double share) {
  EXPECT_GE(share, 0.93);
  EXPECT_LE(share, 0.97);
}

std::vector<Eigen::Matrix2d> unequal(std::size_t count, Random& random) {
  std::vector<Eigen::Matrix2d> covariances(count);
  for (auto& C : covariances) {
    const double u = test::uniform(random, 0.02, 0.2), v = test::uniform(random, 0.02, 0.2);
    C << u * u, 0.5 * u * v, 0.5 * u * v, v * v;
  }
  return covariances;
}

TEST(CovarianceLaws, HoldForUnequalObservations) {
  Random random(4);
  const auto scene = test::car_body_points();
  expect_95(share_inside(scene, unequal(12, random), nullptr, random));
}

TEST(CovarianceLaws, HoldForUsersWeights) {
  Random random(5);
  auto scene = test::car_body_points();
  for (Mark& mark : scene.job.marks) mark.weight = test::uniform(random, 0.2, 1);
  expect_95(share_inside(scene, unequal(12, random), nullptr, random));
}

TEST(CovarianceLaws, HoldForTheSystemsSigma) {
  Random random(6);
  auto scene = test::car_body_points();
  scene.job.system_sigma_px = 0.15;
  expect_95(share_inside(scene, unequal(12, random), nullptr, random));
}

TEST(CovarianceLaws, HoldForMarksThatAreNotRigid) {
  Random random(7);
  auto scene = test::car_body_points();
  for (std::size_t i = 0; i < 12; ++i) scene.job.marks[i].sigma_mm = i % 3 == 0 ? 0 : 0.4;
  const auto bend = [](Job& truth, Random& dice) {
    for (Mark& mark : truth.marks)
      for (double& coordinate : mark.p_O_mm) coordinate += test::normal(dice, mark.sigma_mm);
  };
  expect_95(share_inside(scene, unequal(12, random), bend, random));
}

TEST(CovarianceLaws, HoldForMarksThatSeveralCamerasSee) {
  Random random(8);
  const CellScene scene = shared_marks({1, 4, 7, 10});
  ASSERT_EQ(scene.job.views.size(), 24u);
  expect_95(share_inside(scene, unequal(24, random), nullptr, random));
}

// --- compensation and weights

TEST(CompensationLaws, SettlesInLessThanTwentyRoundsFromTenPixels) {
  Random random(9);
  const CellScene scene = test::car_body();
  for (int trial = 0; trial < 20; ++trial) {
    auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
    for (auto& observation : observations) {
      const double angle = test::uniform(random, 0, 2 * std::numbers::pi);
      observation.u_px += 10 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
    CompensationProblem problem;
    problem.cameras = scene.cameras;
    problem.marks = scene.job.marks;
    problem.observations = observations;
    const CompensationResult result = compensate(problem);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    EXPECT_LT(result.rounds, 20);
    EXPECT_LT(result.largest_deviation_px, 1e-4);
  }
}

// A zero with a calibration as wrong as in practice.
struct WrongZero {
  CellScene scene;  // with the cameras that are believed
  std::vector<Observation> observations;
  ZeroResult zero;

  WrongZero(std::uint64_t seed, CellScene truth, const std::function<void(Job&)>& change)
      : scene(std::move(truth)) {
    change(scene.job);
    scene.job.requirements.max_compensation_mm = 20;
    Random random(seed);
    observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
    scene.cameras = wrong_calibration(scene.cameras, {}, seed);
    const std::vector<std::vector<Observation>> frames{observations};
    zero = make_zero(scene.cameras, scene.job, frames);
  }
  // With the marks where the zero puts them.
  PoseResult again(const std::function<void(Job&)>& change) const {
    CellScene relaxed = scene;
    relaxed.job = compensated(scene.job, zero.zero);
    change(relaxed.job);
    return estimate(relaxed, observations, zero.zero.X_WO0);
  }
};

void as_it_is(Job&) {}

TEST(CompensationLaws, NoWeightMovesTheZeroPose) {
  Random random(10);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const WrongZero wrong(seed, test::car_body(), as_it_is);
    ASSERT_EQ(wrong.zero.code, Code::ok) << wrong.zero.reason;
    const auto reweighted = [&random](Job& job) {
      for (Mark& mark : job.marks) mark.weight = test::uniform(random, 0.05, 1);
    };
    // 1e-4 px that compensation leaves are 1e-4 mm at the marks when weights are drawn; with the zero's own
    // weights they cancel.
    test::expect_near(wrong.again(as_it_is).X_WO, wrong.zero.zero.X_WO0, 1e-6, 2e-8);
    test::expect_near(wrong.again(reweighted).X_WO, wrong.zero.zero.X_WO0, 3e-4, 1e-5);
  }
}

TEST(CompensationLaws, NoMarkThatIsLeftOutMovesTheZeroPose) {
  const WrongZero wrong(3, test::car_body(), as_it_is);
  ASSERT_EQ(wrong.zero.code, Code::ok) << wrong.zero.reason;
  double largest_without_mm = 0;
  for (std::size_t mark = 0; mark < 12; ++mark) {
    const auto leave_out = [mark](Job& job) { job.marks[mark].weight = 0; };
    test::expect_near(wrong.again(leave_out).X_WO, wrong.zero.zero.X_WO0, 3e-4, 1e-5);
    CellScene plain = wrong.scene;
    leave_out(plain.job);
    const PoseResult uncompensated = estimate(plain, wrong.observations, Pose::Identity());
    largest_without_mm =
        std::max(largest_without_mm, test::distance_mm(uncompensated.X_WO, wrong.zero.zero.X_WO0));
  }
  EXPECT_GT(largest_without_mm, 0.3);  // what compensation is for
}

TEST(CompensationLaws, MarksOfWeightZeroAreCompensatedAsWell) {
  const auto silent = [](Job& job) { job.marks[5].weight = 0; };
  const WrongZero wrong(4, test::car_body(), silent);
  ASSERT_EQ(wrong.zero.code, Code::ok) << wrong.zero.reason;
  EXPECT_GT(wrong.zero.zero.compensation_O_mm[5].norm(), 0.1);
  const PoseResult heard = wrong.again([](Job& job) { job.marks[5].weight = 1; });
  EXPECT_LT(heard.deviations[5].dev_px.norm(), 2e-4);
  test::expect_near(heard.X_WO, wrong.zero.zero.X_WO0, 3e-4, 1e-5);
}

// The weights decide which marks the zero pose believes, and so which ones have to give way to errors of the
// drawing.
TEST(CompensationLaws, HeavyMarksAreShiftedLess) {
  Random random(14);
  CellScene scene = test::car_body();
  for (std::size_t i = 0; i < 12; ++i) scene.job.marks[i].weight = i % 3 == 0 ? 1 : 0.1;
  double heavy = 0, light = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Job built = scene.job;
    for (Mark& mark : built.marks) mark.p_O_mm += test::uniform_vector(random, 2);
    const std::vector<std::vector<Observation>> frames{
        test::observe(scene.cameras, built, Pose::Identity(), 0, random)};
    const ZeroResult zero = make_zero(scene.cameras, scene.job, frames);
    ASSERT_EQ(zero.code, Code::ok) << zero.reason;
    for (std::size_t i = 0; i < 12; ++i)
      (i % 3 == 0 ? heavy : light) += zero.zero.compensation_O_mm[i].squaredNorm() / (i % 3 == 0 ? 4 : 8);
  }
  EXPECT_LT(heavy, 0.5 * light);
}

TEST(CompensationLaws, ShiftsAreInTheObjectsFrame) {
  Random random(11);
  const WrongZero wrong(6, test::car_body(), as_it_is);
  const Pose X_VW = test::uniform_pose(random, 2000);
  CellScene other = wrong.scene;
  for (auto& camera : other.cameras) camera.X_WC = X_VW * camera.X_WC;
  other.job.X_WO_nominal = X_VW;
  const std::vector<std::vector<Observation>> frames{wrong.observations};
  const ZeroResult again = make_zero(other.cameras, other.job, frames);
  ASSERT_EQ(again.code, Code::ok) << again.reason;
  for (std::size_t i = 0; i < 12; ++i)
    EXPECT_LT((again.zero.compensation_O_mm[i] - wrong.zero.zero.compensation_O_mm[i]).norm(), 1e-6);
}

// A mark that several cameras see moves once, from all of them, and leaves the zero pose alone as well.
TEST(CompensationLaws, MarksThatSeveralCamerasSeeLeaveTheZeroPose) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const WrongZero wrong(seed, shared_marks({1, 7}), as_it_is);
    ASSERT_EQ(wrong.zero.code, Code::ok) << wrong.zero.reason;
    EXPECT_EQ(wrong.observations.size(), 18u);
    EXPECT_EQ(wrong.zero.zero.compensation_O_mm.size(), 12u);
    const PoseResult again = wrong.again(as_it_is);
    test::expect_near(again.X_WO, wrong.zero.zero.X_WO0, 1e-3, 1e-4);
    for (std::size_t i = 0; i < wrong.observations.size(); ++i) {
      const std::size_t mark = wrong.observations[i].mark;
      if (mark == 1 || mark == 7) continue;
      EXPECT_LT(again.deviations[i].dev_px.norm(), 1e-3);
    }
  }
}

// --- virtual cameras

TEST(VirtualCameras, AreTheSameAsRealOnesInTheirPlaces) {
  Random random(12);
  CellScene real = test::car_body_points();
  for (auto& camera : real.cameras) camera.model = real.cameras[0].model;
  // The hand carries the one camera to where the four stand.
  CalibratedCamera in_hand = real.cameras[0];
  const Pose X_HC = from_six_numbers({80, -30, 120, 10, -20, 95});
  in_hand.X_WC = X_HC;
  CellScene one = real;
  for (std::size_t i = 0; i < 4; ++i) {
    const Pose X_RH = real.cameras[i].X_WC * X_HC.inverse();
    one.cameras[i] = virtual_camera(in_hand, X_RH);
    EXPECT_EQ(one.cameras[i].name, in_hand.name);
    test::expect_near(one.cameras[i].X_WC, real.cameras[i].X_WC, 1e-11, 1e-12);
  }
  EXPECT_EQ(in_hand.X_WC.matrix(), X_HC.matrix());
  for (int trial = 0; trial < 20; ++trial) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    const auto observations = test::observe(real.cameras, real.job, X_WO, 0.1, random);
    const PoseResult of_real = estimate(real, observations, Pose::Identity());
    const PoseResult of_one = estimate(one, observations, Pose::Identity());
    ASSERT_EQ(of_one.code, Code::ok) << of_one.reason;
    EXPECT_EQ(of_one.effective_cameras, 4);
    test::expect_near(of_one.X_WO, of_real.X_WO, 1e-8, 1e-9);
    EXPECT_LT((of_one.covariance - of_real.covariance).norm(), 1e-8 * of_real.covariance.norm());
  }
}

}  // namespace
}  // namespace zeropose
