// How far relative poses are from the truth, from rendered frames through the whole staircase: marks, pose,
// security. The figures of docs/performance.md. With ZEROPOSE_QUICK set, and under sanitizers, with fewer
// cars.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <thread>

#include "config/cell.h"
#include "measure/measurement.h"
#include "sim/renderer.h"
#include "sim/scene.h"
#include "sim/wrong_calibration.h"
#include "tests/support/cell_scene.h"
#include "tests/support/sanitized.h"

namespace zeropose {
namespace {

bool quick() { return test::sanitized() || std::getenv("ZEROPOSE_QUICK") != nullptr; }

using CleanPictures = std::vector<std::vector<float>>;  // one per camera

// Calls job(0 .. count - 1) on all cores; what a call does may depend on its number only.
void in_parallel(int count, const std::function<void(int)>& job) {
  std::atomic<int> next = 0;
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
    threads.emplace_back([&] {
      for (int number = next++; number < count; number = next++) job(number);
    });
  for (std::thread& thread : threads) thread.join();
}

// The shipped car-body cell and its truth.
class RenderedCell {
 public:
  RenderedCell()
      : cell_(load_cell(root() + "car-body.json")), scene_(load_scene(cell_, root() + "car-body.sim.json")) {
    for (std::size_t camera = 0; camera < scene_.cameras.size(); ++camera)
      renderers_.emplace_back(scene_, camera);
  }

  const Job& job() const { return cell_.jobs.front(); }
  int zero_frames() const { return cell_.zero_frames; }
  const std::vector<CalibratedCamera>& truth() const { return scene_.cameras; }

  CleanPictures clean(const Pose& X_WO, const Faults& faults = {}) const {
    CleanPictures pictures;
    for (const CameraRenderer& renderer : renderers_)
      pictures.push_back(renderer.clean_picture(X_WO, faults));
    return pictures;
  }
  CleanPictures clean_zero() const { return clean(job().X_WO_nominal); }

  double noise_sigma_grey() const { return scene_.picture.noise_sigma_grey; }

 private:
  static std::string root() { return std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/"; }

  Cell cell_;
  Scene scene_;
  std::vector<CameraRenderer> renderers_;
};

const RenderedCell& rendered_cell() {
  static const RenderedCell cell;
  return cell;
}

// One grab of all cameras: noise is drawn anew for every one.
class Frame {
 public:
  Frame(const CleanPictures& clean, std::uint64_t& noise_state) {
    const auto& cameras = rendered_cell().truth();
    for (std::size_t camera = 0; camera < clean.size(); ++camera) {
      const CameraModel& model = cameras[camera].model;
      auto& pixels = pixels_.emplace_back(clean[camera].size());
      add_noise(clean[camera], rendered_cell().noise_sigma_grey(), noise_state, pixels);
      images_.push_back({camera, {pixels.data(), model.width_px, model.height_px, model.width_px}});
    }
  }
  std::span<const CameraImage> images() const { return images_; }

 private:
  std::vector<std::vector<std::uint8_t>> pixels_;
  std::vector<CameraImage> images_;
};

ZeroResult measured_zero(const CleanPictures& clean, std::span<const CalibratedCamera> believed,
                         std::uint64_t& noise_state) {
  const Job& job = rendered_cell().job();
  std::vector<std::vector<Observation>> frames;
  for (int i = 0; i < rendered_cell().zero_frames(); ++i) {
    const Frame frame(clean, noise_state);
    frames.push_back(observations_of(find_job_marks(frame.images(), job, believed, job.X_WO_nominal), job));
  }
  return make_zero(believed, job, frames);
}

struct Car {
  Pose X_O0O_true = Pose::Identity();
  Measurement measurement;
};

std::vector<Pose> random_shifts(std::uint64_t seed, int count) {
  test::Random random(seed);
  std::vector<Pose> shifts;
  for (int i = 0; i < count; ++i) shifts.push_back(test::random_shift(random, 30, 0.2));
  return shifts;
}

Pose zero_pose() { return rendered_cell().job().X_WO_nominal; }

test::ErrorStatistics statistics_of(std::span<const Car> cars) {
  test::ErrorStatistics errors;
  for (const Car& car : cars) {
    EXPECT_EQ(car.measurement.code, Code::ok) << car.measurement.reason;
    if (car.measurement.code == Code::ok) errors.add(car.measurement.X_O0O, car.X_O0O_true);
  }
  return errors;
}

std::size_t removed_in(std::span<const Car> cars) {
  std::size_t count = 0;
  for (const Car& car : cars) count += car.measurement.pose.removed.size();
  return count;
}

TEST(AccuracyLong, OfRelativePosesWithTheTrueCalibration) {
  const RenderedCell& cell = rendered_cell();
  std::uint64_t noise_state = 1;
  const ZeroResult zero = measured_zero(cell.clean_zero(), cell.truth(), noise_state);
  ASSERT_EQ(zero.code, Code::ok) << zero.reason;
  const auto shifts = random_shifts(1, quick() ? 6 : 200);
  std::vector<Car> cars(shifts.size());
  in_parallel(static_cast<int>(shifts.size()), [&](int i) {
    Car& car = cars[static_cast<std::size_t>(i)];
    car.X_O0O_true = shifts[static_cast<std::size_t>(i)];
    std::uint64_t state = 1000 + static_cast<std::uint64_t>(i);
    const Frame frame(cell.clean(zero_pose() * car.X_O0O_true), state);
    car.measurement = measure({frame.images(), cell.job(), cell.truth(), zero.zero});
  });
  const auto errors = statistics_of(cars);
  errors.print("rendered, true calibration");
  EXPECT_EQ(removed_in(cars), 0u);
  EXPECT_LE(errors.rms().head<3>().maxCoeff(), 0.008);
  EXPECT_LE(errors.rms().tail<3>().maxCoeff(), 0.001);
}

// Clean pictures of the zero object and of shifted ones, rendered once.
struct Series {
  CleanPictures zero;
  std::vector<Pose> shifts;
  std::vector<CleanPictures> pictures;

  Series(std::uint64_t seed, int count, const Faults& faults = {})
      : zero(rendered_cell().clean_zero()),
        shifts(random_shifts(seed, count)),
        pictures(static_cast<std::size_t>(count)) {
    in_parallel(count, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      pictures[k] = rendered_cell().clean(zero_pose() * shifts[k], faults);
    });
  }

  // Zero measurement and all cars as a cell with the seed's wrong calibration sees them.
  std::vector<Car> measured(std::uint64_t seed) const {
    const RenderedCell& cell = rendered_cell();
    const auto believed = wrong_calibration(cell.truth(), {}, seed);
    std::uint64_t noise_state = 100000 + seed;
    const ZeroResult measured = measured_zero(zero, believed, noise_state);
    EXPECT_EQ(measured.code, Code::ok) << "seed " << seed << ": " << measured.reason;
    std::vector<Car> cars;
    for (std::size_t i = 0; i < shifts.size(); ++i) {
      const Frame frame(pictures[i], noise_state);
      cars.push_back({shifts[i], measure({frame.images(), cell.job(), believed, measured.zero})});
    }
    return cars;
  }
};

// What the demo demands of each car.
void expect_each_car_within_limits(const test::ErrorStatistics& errors, int count) {
  EXPECT_EQ(errors.count(), count);
  EXPECT_LE(errors.largest().head<3>().maxCoeff(), 0.4);
  EXPECT_LE(errors.largest().tail<3>().maxCoeff(), 0.012);
}

TEST(Accuracy, OfRelativePosesWithACalibrationAsWrongAsInPractice) {
  const Series series(2, quick() ? 2 : 12);
  std::vector<std::vector<Car>> cars(quick() ? 3 : 100);
  in_parallel(static_cast<int>(cars.size()), [&](int i) {
    cars[static_cast<std::size_t>(i)] = series.measured(static_cast<std::uint64_t>(i) + 1);
  });
  test::ErrorStatistics errors;
  std::size_t removed = 0;
  for (const auto& of_seed : cars) {
    removed += removed_in(of_seed);
    for (const Car& car : of_seed) {
      EXPECT_EQ(car.measurement.code, Code::ok) << car.measurement.reason;
      if (car.measurement.code == Code::ok) errors.add(car.measurement.X_O0O, car.X_O0O_true);
    }
  }
  errors.print("rendered, wrong calibrations");
  statistics_of(cars.front()).print("rendered, wrong calibration of seed 1");
  EXPECT_EQ(removed, 0u);
  expect_each_car_within_limits(errors, static_cast<int>(cars.size() * series.shifts.size()));
  if (quick()) return;  // three calibrations tell nothing about the mean of many
  const Vector6 rms = errors.rms();
  EXPECT_LE(rms(0), 0.06);
  EXPECT_LE(rms(1), 0.08);
  EXPECT_LE(rms(2), 0.08);
  EXPECT_LE(rms.tail<3>().maxCoeff(), 0.004);
}

TEST(AccuracyLong, StaysWithOneMarkCovered) {
  const int count = quick() ? 1 : 12;
  const std::string covered = rendered_cell().job().marks[3].name;
  const auto cars = Series(3, count, {{covered}, {}}).measured(1);
  const auto errors = statistics_of(cars);
  errors.print("rendered, seed 1, one mark covered");
  expect_each_car_within_limits(errors, count);
  for (const Car& car : cars) {
    EXPECT_NE(car.measurement.findings[3].status, MarkStatus::found);
    EXPECT_EQ(car.measurement.pose.effective_marks, 11);
  }
}

TEST(AccuracyLong, StaysWithOneMarkTwentyPixelsOff) {
  const int count = quick() ? 1 : 6;
  for (const std::size_t wrong : {0u, 7u}) {
    const Mark& mark = rendered_cell().job().marks[wrong];
    const auto cars = Series(4 + wrong, count, {{}, {{mark.name, 20}}}).measured(1);
    const auto errors = statistics_of(cars);
    errors.print(("rendered, seed 1, wrong mark " + mark.name).c_str());
    expect_each_car_within_limits(errors, count);
    for (const Car& car : cars) {
      ASSERT_EQ(car.measurement.pose.removed.size(), 1u);
      EXPECT_EQ(car.measurement.observations[car.measurement.pose.removed[0]].mark, wrong);
      EXPECT_NEAR(car.measurement.pose.deviations[car.measurement.pose.removed[0]].dev_px.norm(), 20, 1);
      EXPECT_EQ(car.measurement.pose.effective_marks, 11);
    }
  }
}

// The finder's covariance is what lets the estimate tell noise from mistakes.
TEST(Accuracy, OfMarksIsAsTheirCovarianceSays) {
  const RenderedCell& cell = rendered_cell();
  const CleanPictures clean = cell.clean_zero();
  const int frames = quick() ? 20 : 60;
  std::uint64_t noise_state = 7;
  std::vector<std::vector<Observation>> all;
  for (int i = 0; i < frames; ++i) {
    const Frame frame(clean, noise_state);
    all.push_back(
        observations_of(find_job_marks(frame.images(), cell.job(), cell.truth(), zero_pose()), cell.job()));
    ASSERT_EQ(all.back().size(), 12u);
  }
  test::Random unused(1);
  const auto exact = test::observe(cell.truth(), cell.job(), zero_pose(), 0, unused);
  double noise = 0;
  for (std::size_t mark = 0; mark < 12; ++mark) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& frame : all) mean += frame[mark].u_px / frames;
    EXPECT_LT((mean - exact[mark].u_px).norm(), 0.01) << cell.job().marks[mark].name;
    for (const auto& frame : all) {
      const Eigen::Vector2d error = frame[mark].u_px - mean;
      noise += error.dot(frame[mark].covariance_px2.llt().solve(error)) / (12 * (frames - 1));
    }
  }
  // Chi-squared of two degrees of freedom each, four standard deviations of the mean.
  EXPECT_NEAR(noise, 2, 4 * std::sqrt(4.0 / (12 * frames)) + 0.1);
}

}  // namespace
}  // namespace zeropose
