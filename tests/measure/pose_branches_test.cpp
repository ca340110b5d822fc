// One camera (spec 50 M1), and poses that cannot be told apart: all of them are reported.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "measure/pose.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;
using Random = test::Random;

// `count` marks in a cube (or a square: `flat`) of 500 mm, 3 m before one camera, any turn.
struct MonoScene {
  CellScene scene;
  Pose X_WO = Pose::Identity();
  std::vector<Observation> observations;

  MonoScene(std::size_t count, bool flat, double sigma_px, Random& random) {
    CalibratedCamera camera;
    camera.model = {2448, 2048, 4200, 4200, 1223.5, 1023.5, Division{-0.05}};
    camera.X_WC = test::uniform_pose(random, 1000);
    scene.cameras = {camera};
    for (std::size_t i = 0; i < count; ++i) {
      Mark mark;
      mark.p_O_mm = test::uniform_vector(random, 250);
      if (flat) mark.p_O_mm.z() = 0;
      scene.job.marks.push_back(mark);
      scene.job.views.push_back({0, i});
    }
    Pose X_CO = test::uniform_pose(random, 100);
    X_CO.translation().z() += 3000;
    X_WO = camera.X_WC * X_CO;
    observations = test::observe(scene.cameras, scene.job, X_WO, sigma_px, random);
  }

  PoseResult estimate() const { return test::estimate(scene, observations, std::nullopt); }
  PoseResult estimate(const Pose& start) const { return test::estimate(scene, observations, start); }
  double squares_px2(const Pose& pose) const {
    double sum = 0;
    for (const Observation& seen : observations) {
      const auto u = project(scene.cameras[0].model,
                             scene.cameras[0].X_WC.inverse() * pose * scene.job.marks[seen.mark].p_O_mm);
      sum += u ? (seen.u_px - *u).squaredNorm() : 1e30;
    }
    return sum;
  }
};

bool same(const Pose& a, const Pose& b) {
  return test::distance_mm(a, b) < 0.1 && test::angle_deg(a, b) < 0.1;
}

// Is the truth the answer, or among those that cannot be told apart?
bool has_truth(const PoseResult& result, const Pose& X_WO) {
  if (result.code == Code::ok) return same(result.X_WO, X_WO);
  return std::any_of(result.alternatives.begin(), result.alternatives.end(),
                     [&](const Pose& pose) { return same(pose, X_WO); });
}

TEST(PoseBranches, OfThreeMarksInOneCameraAreAllReported) {
  Random random(1);
  int answered = 0, most = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    const MonoScene mono(3, false, 0, random);
    const PoseResult result = mono.estimate();
    answered += has_truth(result, mono.X_WO);
    most = std::max(most, static_cast<int>(result.alternatives.size()));
    if (result.code == Code::ok) {
      EXPECT_TRUE(result.alternatives.empty());
    }
    EXPECT_LE(result.alternatives.size(), 4u);  // Grunert's equation has no more roots
    for (std::size_t i = 0; i < result.alternatives.size(); ++i) {
      EXPECT_LT(mono.squares_px2(result.alternatives[i]), 1e-9);
      for (std::size_t k = 0; k < i; ++k) EXPECT_FALSE(same(result.alternatives[i], result.alternatives[k]));
    }
    if (!result.alternatives.empty()) {
      EXPECT_EQ(result.code, Code::geometry_degenerate);
    }
  }
  EXPECT_GE(answered, trials * 99 / 100);  // three marks may be almost on a line, or seen along their plane
  EXPECT_EQ(most, 4);
}

TEST(PoseBranches, OfFourMarksInOneCameraHaveTheTruthAmongThem) {
  Random random(2);
  for (const bool flat : {false, true}) {
    int missing = 0, unique = 0;
    for (int trial = 0; trial < 300; ++trial) {
      const MonoScene mono(4, flat, 0, random);
      const PoseResult result = mono.estimate();
      missing += !has_truth(result, mono.X_WO);
      unique += result.code == Code::ok;
    }
    EXPECT_LE(missing, 3) << flat;  // degenerate by chance: on a line, or a plane seen edge-on
    EXPECT_GT(unique, 200) << flat;
  }
}

TEST(PoseBranches, AreNoneWithAGoodStart) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const MonoScene mono(6, false, 0.1, random);
    const PoseResult result = mono.estimate(mono.X_WO);
    EXPECT_EQ(result.code, Code::ok) << result.reason;
    EXPECT_TRUE(result.alternatives.empty());
  }
}

// One camera is no special case of M3: what M1 asks for is the least sum of squares, checked here by
// differences of the projection alone.
TEST(PoseBranches, OneCameraEndsWhereTheSumOfSquaresIsLeast) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const MonoScene mono(8, false, 0.1, random);
    const PoseResult result = mono.estimate();
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    const double least = mono.squares_px2(result.X_WO);
    for (int axis = 0; axis < 6; ++axis) {
      Vector6 delta = Vector6::Zero();
      delta(axis) = 0.2 * std::sqrt(result.covariance(axis, axis));
      const double up = mono.squares_px2(moved(result.X_WO, delta));
      const double down = mono.squares_px2(moved(result.X_WO, -delta));
      EXPECT_GT(up, least);
      EXPECT_GT(down, least);
      EXPECT_LT(std::abs(up - down), 1e-2 * (up + down - 2 * least));  // the bottom is here, not beside
    }
  }
}

TEST(PoseBranches, AnyStartWithin600MillimetresAnd30DegreesFindsTheOnlyPose) {
  const CellScene scene = test::car_body_points();
  Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    const Pose X_WO = test::random_shift(random, 30, 0.2);
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0, random);
    Vector6 delta;
    delta << test::uniform_vector(random, 600), test::uniform_vector(random, 30 / degrees_per_radian);
    const PoseResult result = test::estimate(scene, observations, moved(X_WO, delta));
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    test::expect_near(result.X_WO, X_WO, 1e-6, 1e-7);
  }
  for (int trial = 0; trial < 300; ++trial) {
    const MonoScene mono(6, false, 0, random);
    Vector6 delta;
    delta << test::uniform_vector(random, 600), test::uniform_vector(random, 30 / degrees_per_radian);
    const PoseResult result = mono.estimate(moved(mono.X_WO, delta));
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    test::expect_near(result.X_WO, mono.X_WO, 1e-3, 1e-4);
  }
}

}  // namespace
}  // namespace zeropose
