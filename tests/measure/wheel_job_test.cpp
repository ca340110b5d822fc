// A job of a wheel: from pictures and a zero to a checked answer, in any world, and what is refused.
#include "measure/wheel_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/wheel_scene.h"
#include "tests/support/sanitized.h"

namespace zeropose::test {
namespace {

using testing::HasSubstr;

constexpr double aim_deg = 0.05;

class WheelJob : public testing::Test {
 protected:
  WheelJob() {
    job.name = "wheel";
    job.wheel.emplace();
    for (std::size_t s = 0; s < wheel_sensors; ++s)
      job.wheel->sensors.push_back({"s" + std::to_string(s + 1), cell().angles_rad[s], 2 * s, 2 * s + 1});
    job.wheel->layout = cell().layout;
    job.wheel->tyre = expected(cell().tyre);
    job.requirements.limits = {{{-6, 6}, {-6, 6}, {-8, 8}, {-3.5, 2.5}, {-3.5, 2.5}, {0, 0}}};
    into_world(Pose::Identity());
  }
  // The nominal wheel stands at X_WN, all cameras with it.
  void into_world(const Pose& X_WN) {
    job.X_WO_nominal = X_WN;
    cameras.assign(cell().believed.begin(), cell().believed.end());
    for (CalibratedCamera& camera : cameras) camera.X_WC = X_WN * camera.X_WC;
  }
  static const WheelCell& cell() {
    static const WheelCell cell = wheel_cell(example_tyres()[1]);
    return cell;
  }
  static const CleanPictures& clean(bool tilted) {
    static const CleanPictures straight = rendered(cell(), Pose::Identity()),
                               pictures = rendered(cell(), tilted_wheel(-1.2, 0.8, {2, -1, 3}));
    return tilted ? pictures : straight;
  }
  static std::vector<CameraImage> images_of(const WheelPictures& pictures) {
    std::vector<CameraImage> images;
    for (std::size_t c = 0; c < wheel_cameras; ++c) {
      const CameraModel& model = cell().cameras[c].model;
      images.push_back({c, {pictures[c].data(), model.width_px, model.height_px, model.width_px}});
    }
    return images;
  }
  WheelResult seen(bool tilted, const Zero& zero = {}) {
    const WheelPictures pictures = exposed(clean(tilted), noise);
    return look_at_wheel(images_of(pictures), job, cameras, zero);
  }
  // Where the wheel stands at the world's origin: taken once for all tests, it is the same.
  Zero zero() {
    static const Zero once = fresh_zero();
    return once;
  }
  Zero fresh_zero() {
    const std::vector<WheelResult> exposures{seen(false), seen(false)};
    const ZeroResult result = make_wheel_zero(job, exposures);
    EXPECT_EQ(result.code, Code::ok) << result.reason;
    return result.zero;
  }
  Measurement measured(const WheelPictures& pictures, const Zero& zero) const {
    return measure({images_of(pictures), job, cameras, zero});
  }
  static void expect_true(const Measurement& m) {
    ASSERT_EQ(m.code, Code::ok) << m.reason;
    const SixNumbers six = to_six_numbers(m.X_O0O);
    EXPECT_NEAR(six.rx_deg, -1.2, aim_deg);
    EXPECT_NEAR(six.ry_deg, 0.8, aim_deg);
    EXPECT_NEAR(six.rz_deg, 0, 1e-9);
    // The profile's plane lies 5 mm behind the wheel's origin: that much times the tilt sideways.
    EXPECT_NEAR(six.x_mm, 2, 0.15);
    EXPECT_NEAR(six.y_mm, -1, 0.15);
    EXPECT_NEAR(six.z_mm, 3, 0.05);
  }

  Job job;
  std::vector<CalibratedCamera> cameras;
  std::uint64_t noise = 21;
};

// Also where the wheel's axis lies along x of the world, and its forward direction is none of the world's.
TEST_F(WheelJob, AnswersShiftCamberAndToeInAnyWorld) {
  std::vector<Pose> worlds{from_six_numbers({-500, 900, 1200, 30, -40, 110}), Pose::Identity(),
                           from_six_numbers({1320, -775, 318, 90, 0, 0}),
                           from_six_numbers({10, 20, 30, 90, 0, 90})};
  if (sanitized()) worlds.resize(1);
  for (const Pose& X_WN : worlds) {
    into_world(X_WN);
    const Zero at_zero = fresh_zero();
    EXPECT_GT(at_zero.profile_radius_mm, 200);
    EXPECT_LT((X_WN.inverse() * at_zero.X_WO0).translation().norm(), 6);
    const Measurement m = measured(exposed(clean(true), noise), at_zero);
    expect_true(m);
    EXPECT_EQ(m.pose.effective_marks, 9);
    EXPECT_EQ(m.pose.effective_cameras, 6);
    EXPECT_GT(m.sigma_mm, 0);
    EXPECT_LT(m.sigma_mm, 0.03);
  }
}

TEST_F(WheelJob, NeedsAZeroWithAProfile) {
  const WheelPictures pictures = exposed(clean(true), noise);
  EXPECT_EQ(measured(pictures, {}).code, Code::zero_missing);
  Zero broken = zero();
  broken.X_WO0.linear().setZero();
  EXPECT_EQ(measured(pictures, broken).code, Code::zero_outdated);
}

TEST_F(WheelJob, KeepsTheProfileOfTheZero) {
  Zero other = zero();
  other.profile_radius_mm = 306;  // there is none
  const Measurement m = measured(exposed(clean(true), noise), other);
  EXPECT_EQ(m.code, Code::lines_not_found);
  EXPECT_THAT(m.reason, HasSubstr("near the radius 306.0 mm"));
}

TEST_F(WheelJob, RefusesWhatIsBeyondALimitOrTooUncertain) {
  const WheelPictures pictures = exposed(clean(true), noise);
  const Zero at_zero = zero();
  job.requirements.limits[3] = {-1, 1};
  EXPECT_EQ(measured(pictures, at_zero).code, Code::limit_rx);
  job.requirements.limits[3] = {-3.5, 2.5};
  job.requirements.limits[2] = {-1, 1};
  EXPECT_EQ(measured(pictures, at_zero).code, Code::limit_z);
  job.wheel->max_sigma_rad = 1e-6;
  const Measurement m = measured(pictures, at_zero);
  EXPECT_EQ(m.code, Code::sigma_too_large);
  EXPECT_THAT(m.reason, HasSubstr("deg, allowed are 5.7"));
}

TEST_F(WheelJob, SaysFurtherThanItCanMeasure) {
  std::uint64_t state = 5;
  const WheelPictures far = exposed(rendered(cell(), tilted_wheel(4.2, -4.2)), state);
  const Measurement m = measured(far, zero());
  EXPECT_EQ(m.code, Code::limit_displacement) << m.reason;
}

TEST_F(WheelJob, NamesTheCameraWhoseLinesAreMissing) {
  WheelCell dark = cell();
  dark.projectors[1].lines[2].brightness = 0;
  CleanPictures pictures = clean(true);
  render_sensor(dark, tilted_wheel(-1.2, 0.8, {2, -1, 3}), 1, pictures);
  const Measurement m = measured(exposed(pictures, noise), zero());
  EXPECT_EQ(m.code, Code::lines_not_found);
  EXPECT_THAT(m.reason, HasSubstr("s2 left: 2 of 3 radial lines are found: the right one is missing"));
  ASSERT_TRUE(m.wheel);
  EXPECT_EQ(m.wheel->order, LineArrayStatus::radial_missing);
}

TEST_F(WheelJob, ACameraOfAnotherSensorSeesNoSideWall) {
  const Zero at_zero = zero();
  std::swap(job.wheel->sensors[0].left, job.wheel->sensors[1].left);
  const Measurement m = measured(exposed(clean(true), noise), at_zero);
  EXPECT_EQ(m.code, Code::marks_invalid) << m.reason;
  EXPECT_THAT(m.reason, HasSubstr("does not see the nominal side wall"));
}

TEST_F(WheelJob, NamesACameraWithoutAPicture) {
  const WheelPictures pictures = exposed(clean(true), noise);
  auto images = images_of(pictures);
  const Zero at_zero = zero();
  images.pop_back();
  const Measurement m = measure({images, job, cameras, at_zero});
  EXPECT_EQ(m.code, Code::camera_missing);
  EXPECT_THAT(m.reason, HasSubstr("s3 right"));
  job.wheel->sensors[2].right = 9;
  EXPECT_EQ(measure({images, job, cameras, at_zero}).code, Code::marks_invalid);
}

TEST_F(WheelJob, AZeroIsTheMeanOfWheelsThatStandStill) {
  const std::vector<WheelResult> still{seen(false), seen(false), seen(false)};
  const ZeroResult result = make_wheel_zero(job, still);
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  EXPECT_GT(result.spread.norm(), 0);
  double mean_x = 0;
  for (const WheelResult& wheel : still) mean_x += wheel.X_WO.translation().x() / 3;
  EXPECT_NEAR(result.zero.X_WO0.translation().x(), mean_x, 1e-9);

  const ZeroResult moved = make_wheel_zero(job, std::vector{seen(false), seen(true), seen(false)});
  EXPECT_EQ(moved.code, Code::deviation_not_attributable);
  EXPECT_THAT(moved.reason, HasSubstr("the wheel moved by"));

  WheelResult failed;
  failed.status = WheelStatus::lines_not_ordered;
  failed.reason = "camera s1 left: too dirty";
  EXPECT_EQ(make_wheel_zero(job, std::vector{still[0], failed, still[1]}).code, Code::ok);
  const ZeroResult bad = make_wheel_zero(job, std::vector{failed, still[1], failed});
  EXPECT_EQ(bad.code, Code::lines_not_found);
  EXPECT_THAT(bad.reason, HasSubstr("2 of 3 exposures of the zero measurement failed: camera s1 left"));
  EXPECT_NE(make_wheel_zero(job, {}).code, Code::ok);
}

}  // namespace
}  // namespace zeropose::test
