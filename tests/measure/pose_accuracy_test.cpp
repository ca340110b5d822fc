// How far relative poses are from the truth, from pixels with independent noise: no picture is rendered here
// (tests/integration does that).
#include <gtest/gtest.h>

#include "measure/measurement.h"
#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

// Noise of a mark's centre: 20 to 25 px across, contrast 100, 2 grey levels.
constexpr double mark_sigma_px = 0.006;
constexpr int zero_frames = 10;

Zero measured_zero(const test::CellScene& scene, std::span<const CalibratedCamera> believed,
                   test::Random& random) {
  std::vector<std::vector<Observation>> frames;
  for (int frame = 0; frame < zero_frames; ++frame)
    frames.push_back(test::observe(scene.cameras, scene.job, scene.job.X_WO_nominal, mark_sigma_px, random));
  const ZeroResult zero = make_zero(believed, scene.job, frames);
  EXPECT_EQ(zero.code, Code::ok) << zero.reason;
  return zero.zero;
}

struct Figures {
  test::ErrorStatistics relative, uncompensated, absolute;
  int failed = 0, removed = 0;
};

void measure_cars(const test::CellScene& scene, std::span<const CalibratedCamera> believed, int cars,
                  test::Random& random, Figures& figures) {
  const Zero zero = measured_zero(scene, believed, random);
  const Job job = compensated(scene.job, zero);
  for (int car = 0; car < cars; ++car) {
    const Pose X_O0O = test::random_shift(random, 30, 0.2);
    const auto observations =
        test::observe(scene.cameras, scene.job, scene.job.X_WO_nominal * X_O0O, mark_sigma_px, random);
    const PoseResult result = estimate_pose(test::problem_of(believed, job, observations, zero.X_WO0));
    figures.failed += result.code != Code::ok;
    figures.removed += static_cast<int>(result.removed.size());
    if (result.code != Code::ok) {
      ADD_FAILURE() << result.reason;
      continue;
    }
    figures.relative.add(zero.X_WO0.inverse() * result.X_WO, X_O0O);
    figures.absolute.add(result.X_WO, scene.job.X_WO_nominal * X_O0O);
    PoseProblem plain = test::problem_of(believed, scene.job, observations, zero.X_WO0);
    plain.reject_wrong_marks = false;
    figures.uncompensated.add(zero.X_WO0.inverse() * estimate_pose(plain).X_WO, X_O0O);
  }
}

void print(const char* title, const Figures& figures) {
  std::printf("%s: %d failed, %d marks removed\n", title, figures.failed, figures.removed);
  figures.relative.print("  relative pose");
  figures.uncompensated.print("  without compensation");
  figures.absolute.print("  absolute pose");
}

TEST(PoseAccuracy, WithTheTrueCalibration) {
  const test::CellScene scene = test::car_body();
  test::Random random(1);
  Figures figures;
  measure_cars(scene, scene.cameras, 200, random, figures);
  print("true calibration", figures);
  const Vector6 rms = figures.relative.rms();
  EXPECT_LE(rms.head<3>().maxCoeff(), 0.008);
  EXPECT_LE(rms.tail<3>().maxCoeff(), 0.001);
}

// The spec's figures for a calibration as wrong as in practice (spec 70, car-body).
void expect_within_figures(const Figures& figures) {
  const Vector6 rms = figures.relative.rms();
  EXPECT_LE(rms(0), 0.06);
  EXPECT_LE(rms(1), 0.08);
  EXPECT_LE(rms(2), 0.08);
  EXPECT_LE(rms.tail<3>().maxCoeff(), 0.004);
}

TEST(PoseAccuracy, WithAWrongCalibrationAndZero) {
  const test::CellScene scene = test::car_body();
  Figures figures;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    test::Random random(1000 + seed);
    measure_cars(scene, wrong_calibration(scene.cameras, {}, seed), 12, random, figures);
  }
  print("wrong calibration, seeds 1..100", figures);
  EXPECT_EQ(figures.failed, 0);
  expect_within_figures(figures);
}

TEST(PoseAccuracy, OfEachCarWithTheCalibrationOfTheDemo) {
  const test::CellScene scene = test::car_body();
  test::Random random(1);
  Figures figures;
  measure_cars(scene, wrong_calibration(scene.cameras, {}, 1), 500, random, figures);
  print("wrong calibration, seed 1", figures);
  EXPECT_EQ(figures.failed, 0);
  EXPECT_LE(figures.relative.largest().head<3>().maxCoeff(), 0.4);
  EXPECT_LE(figures.relative.largest().tail<3>().maxCoeff(), 0.012);
}

}  // namespace
}  // namespace zeropose
