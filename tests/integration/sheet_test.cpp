// A sheet on a conveyor from rendered pictures to the correction (spec 70 press-shop).
#include <gtest/gtest.h>

#include "measure/correction.h"
#include "sim/wrong_calibration.h"
#include "tests/support/rendered_pictures.h"
#include "tests/support/sheet_scene.h"

namespace zeropose {
namespace {

constexpr double noise_grey = 2;

Scene scene_of(const test::CellScene& sheet) {
  Scene scene;
  scene.cameras = sheet.cameras;
  scene.marks = sheet.job.marks;
  scene.views = sheet.job.views;
  scene.X_WO_nominal = sheet.job.X_WO_nominal;
  scene.picture.clutter = 0;  // a sheet is bare
  return scene;
}

class RenderedSheet : public testing::Test {
 protected:
  const test::CellScene sheet = test::sheet_scene();
  const test::SceneRenderer renderer{scene_of(sheet)};
  const std::vector<CalibratedCamera> believed = wrong_calibration(sheet.cameras, {}, 1);
  std::uint64_t noise_state = 1;

  test::Exposed exposed(const Pose& X_WO) {
    return {sheet.cameras, renderer.clean(X_WO), noise_grey, noise_state};
  }
  ZeroResult taken_zero() {
    const auto clean = renderer.clean(sheet.job.X_WO_nominal);
    std::vector<std::vector<Observation>> frames;
    for (int i = 0; i < 10; ++i) {
      test::Exposed frame(sheet.cameras, clean, noise_grey, noise_state);
      frames.push_back(observations_of(
          find_job_marks(frame.images(), sheet.job, believed, sheet.job.X_WO_nominal), sheet.job));
    }
    return make_zero(believed, sheet.job, frames);
  }
};

TEST_F(RenderedSheet, IsCorrectedToTwoMillimetresAtItsEnds) {
  const ZeroResult zero = taken_zero();
  ASSERT_EQ(zero.code, Code::ok) << zero.reason;
  test::Random random(1);
  for (int i = 0; i < 5; ++i) {
    const Pose X_O0O = test::random_sheet_shift(random, 50, 0.8);
    const Pose X_WO = sheet.job.X_WO_nominal * X_O0O;
    test::Exposed frame = exposed(X_WO);
    const Measurement measurement = measure({frame.images(), sheet.job, believed, zero.zero});
    ASSERT_EQ(measurement.code, Code::ok) << measurement.reason;
    EXPECT_EQ(measurement.pose.effective_marks, 6);
    const SixNumbers six = to_six_numbers(measurement.X_O0O);
    EXPECT_EQ(six.z_mm, 0);
    EXPECT_EQ(six.rx_deg, 0);
    EXPECT_EQ(six.ry_deg, 0);
    const Pose D_W = correction(CorrectionFrame::world_shift, {}, zero.zero.X_WO0, measurement.pose.X_WO);
    EXPECT_LT(test::worst_end_mm(D_W, sheet.job.X_WO_nominal, X_WO), 2);
  }
}

// The limits' axes are those of the sheet at its zero, as for other objects.
TEST_F(RenderedSheet, KeepsItsLimitsAndItsStep) {
  const ZeroResult zero = taken_zero();
  ASSERT_EQ(zero.code, Code::ok) << zero.reason;
  test::Exposed frame = exposed(sheet.job.X_WO_nominal * from_six_numbers({30, -20, 0, 0, 0, 0.5}));
  const auto code = [&](const Job& job, const std::optional<Pose>& X_O0O_last) {
    const Measurement measurement = measure({frame.images(), job, believed, zero.zero, X_O0O_last});
    EXPECT_EQ(measurement.code == Code::ok, measurement.reason.empty());
    return measurement.code;
  };
  EXPECT_EQ(code(sheet.job, std::nullopt), Code::ok);
  for (const auto& [axis, range, expected] : {std::tuple{0u, Range{-100, 25}, Code::limit_x},
                                              {1u, Range{-15, 100}, Code::limit_y},
                                              {5u, Range{-1, 0.4}, Code::limit_rz}}) {
    Job job = sheet.job;
    job.requirements.limits[axis] = range;
    EXPECT_EQ(code(job, std::nullopt), expected);
  }
  Job job = sheet.job;
  job.requirements.max_displacement_mm = 35;  // the first end goes 36 mm
  EXPECT_EQ(code(job, std::nullopt), Code::limit_displacement);
  job = sheet.job;
  job.requirements.max_step_mm = 10;
  EXPECT_EQ(code(job, std::nullopt), Code::ok);
  EXPECT_EQ(code(job, Pose::Identity()), Code::step_too_large);
  EXPECT_EQ(code(job, from_six_numbers({31, -20, 0, 0, 0, 0.5})), Code::ok);
  job.requirements = sheet.job.requirements;
  job.requirements.max_step_deg = 0.2;
  EXPECT_EQ(code(job, from_six_numbers({-500, 0, 0, 0, 0, 0.6})), Code::ok);
  EXPECT_EQ(code(job, from_six_numbers({30, -20, 0, 0, 0, 0.2})), Code::step_too_large);
}

}  // namespace
}  // namespace zeropose
