// What zero, compensation and weights are worth: the table of docs/accuracy.md.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "measure/zero.h"
#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;
using test::ErrorStatistics;
using Random = test::Random;

constexpr double pixel_sigma_px = 0.02;
constexpr int zero_frames = 10, seeds = 100, cars_per_seed = 12;

enum Way { without_zero, with_zero, compensation, weights, ways };
constexpr const char* way_names[] = {"without zero (absolute)", "zero", "zero, compensation",
                                     "zero, compensation, weights"};

// A cell as it is believed: wrong calibration, marks where the drawing has them.
struct Believed {
  std::vector<CalibratedCamera> cameras;
  Job equal, weighted;  // all weights 1, and as in the cell file
  Zero zero_equal, zero_weighted;
};

void set_equal(Job& job) {
  for (Mark& mark : job.marks) mark.weight = 1;
}

Zero zero_of(std::span<const CalibratedCamera> cameras, const Job& job,
             std::span<const std::vector<Observation>> frames) {
  const ZeroResult zero = make_zero(cameras, job, frames);
  EXPECT_EQ(zero.code, Code::ok) << zero.reason;
  return zero.zero;
}

// The car as it is: marks on the shell up to 2 mm per coordinate from where the drawing has them, those on
// the rigid parts (weight 1) exactly there.
Job built(Job drawing, Random& random) {
  for (Mark& mark : drawing.marks)
    if (mark.weight < 1) mark.p_O_mm += test::uniform_vector(random, 2);
  return drawing;
}

Believed commissioned(const CellScene& truth, const Job& car, std::uint64_t seed, Random& random) {
  Believed believed;
  believed.cameras = wrong_calibration(truth.cameras, {}, seed);
  believed.equal = believed.weighted = truth.job;
  believed.equal.requirements.max_compensation_mm = believed.weighted.requirements.max_compensation_mm = 20;
  set_equal(believed.equal);
  std::vector<std::vector<Observation>> frames;
  for (int frame = 0; frame < zero_frames; ++frame)
    frames.push_back(test::observe(truth.cameras, car, Pose::Identity(), pixel_sigma_px, random));
  believed.zero_equal = zero_of(believed.cameras, believed.equal, frames);
  believed.zero_weighted = zero_of(believed.cameras, believed.weighted, frames);
  return believed;
}

Pose pose_of(const Believed& believed, const Job& job, std::span<const Observation> observations) {
  PoseProblem problem = test::problem_of(believed.cameras, job, observations, Pose::Identity());
  problem.reject_wrong_marks = false;
  const PoseResult result = estimate_pose(problem);
  EXPECT_EQ(result.code, Code::ok) << result.reason;
  return result.X_WO;
}

using Figures = std::array<ErrorStatistics, ways>;

void add(const Believed& believed, std::span<const Observation> observations, const Pose& X_O0O,
         Figures& figures) {
  const Pose plain = pose_of(believed, believed.equal, observations);
  figures[without_zero].add(plain, X_O0O);  // the zero object stands at W
  figures[with_zero].add(believed.zero_equal.X_WO0.inverse() * plain, X_O0O);
  const Job equal = compensated(believed.equal, believed.zero_equal);
  figures[compensation].add(believed.zero_equal.X_WO0.inverse() * pose_of(believed, equal, observations),
                            X_O0O);
  const Job weighted = compensated(believed.weighted, believed.zero_weighted);
  figures[weights].add(believed.zero_weighted.X_WO0.inverse() * pose_of(believed, weighted, observations),
                       X_O0O);
}

struct Effects {
  Figures all, one_lost;
};

Effects effects() {
  const CellScene truth = test::car_body();
  Effects effects;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Random random(7000 + seed);
    const Job car = built(truth.job, random);
    const Believed believed = commissioned(truth, car, seed, random);
    for (int i = 0; i < cars_per_seed; ++i) {
      const Pose X_O0O = test::random_shift(random, 30, 0.2);
      auto observations = test::observe(truth.cameras, car, X_O0O, pixel_sigma_px, random);
      add(believed, observations, X_O0O, effects.all);
      const auto lost = std::uniform_int_distribution<std::ptrdiff_t>(0, 11)(random);
      observations.erase(observations.begin() + lost);
      add(believed, observations, X_O0O, effects.one_lost);
    }
  }
  return effects;
}

void print(const char* title, const Figures& figures) {
  std::printf("%s: RMS of %d, mm and degrees\n", title, figures[0].count());
  for (std::size_t way = 0; way < ways; ++way) {
    const Vector6 rms = figures[way].rms();
    std::printf("| %-27s | %.3f %.3f %.3f | %.4f %.4f %.4f |\n", way_names[way], rms(0), rms(1), rms(2),
                rms(3), rms(4), rms(5));
  }
}

TEST(Effects, OfZeroCompensationAndWeights) {
  const Effects found = effects();
  print("all marks", found.all);
  print("one mark lost after the zero", found.one_lost);
  for (const Way way : {with_zero, compensation, weights}) {
    const Vector6 rms = found.all[way].rms();
    EXPECT_LE(rms(0), 0.06) << way_names[way];
    EXPECT_LE(rms(1), 0.08) << way_names[way];
    EXPECT_LE(rms(2), 0.08) << way_names[way];
    EXPECT_LE(rms.tail<3>().maxCoeff(), 0.004) << way_names[way];
    EXPECT_GT((found.all[without_zero].rms().head<3>().array() / rms.head<3>().array()).minCoeff(), 3);
  }
  const Vector6 plain = found.one_lost[with_zero].rms();
  for (const Way way : {compensation, weights})
    EXPECT_GE((plain.head<3>().array() / found.one_lost[way].rms().head<3>().array()).minCoeff(), 3)
        << way_names[way];
}

}  // namespace
}  // namespace zeropose
