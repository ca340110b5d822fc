// Every check between an estimate and a robot: exact code, numbers in the reason (spec 50 M6, spec 85 R18).
#include "measure/security.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "measure/measurement.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::CellScene;
using testing::Test;

constexpr Code limit_codes[] = {Code::limit_x,  Code::limit_y,  Code::limit_z,
                                Code::limit_rx, Code::limit_ry, Code::limit_rz};

SixNumbers six_with(std::size_t axis, double value) {
  double numbers[6] = {};
  numbers[axis] = value;
  return {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]};
}

Requirements limits(double mm, double deg) {
  Requirements requirements;
  for (std::size_t i = 0; i < 6; ++i) requirements.limits[i] = i < 3 ? Range{-mm, mm} : Range{-deg, deg};
  return requirements;
}

TEST(Limits, HoldPerAxisToTheLastDigit) {
  const Requirements requirements = limits(40, 0.5);
  for (std::size_t axis = 0; axis < 6; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const double limit = sign * (axis < 3 ? 40 : 0.5), digit = sign * (axis < 3 ? 1e-3 : 1e-4);
      EXPECT_EQ(check_limits(requirements, from_six_numbers(six_with(axis, limit - digit))).code, Code::ok);
      const Verdict verdict = check_limits(requirements, from_six_numbers(six_with(axis, limit + digit)));
      EXPECT_EQ(verdict.code, limit_codes[axis]);
      EXPECT_NE(verdict.reason.find(axis < 3 ? "40.001" : "0.5001"), std::string::npos) << verdict.reason;
    }
}

TEST(Limits, IncludeTheirEnds) {
  Requirements requirements = limits(40, 0.5);
  EXPECT_EQ(check_limits(requirements, from_six_numbers({40, -40, 40, 0, 0, 0})).code, Code::ok);
  EXPECT_EQ(check_limits(requirements, from_six_numbers({40, -40, std::nextafter(40, 41), 0, 0, 0})).code,
            Code::limit_z);
}

TEST(Limits, NeverPassNumbersThatAreNone) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    Pose X_O0O = Pose::Identity();
    X_O0O.translation().y() = bad;
    EXPECT_EQ(check_limits(limits(40, 0.5), X_O0O).code, Code::limit_y);
    X_O0O = Pose::Identity();
    X_O0O.linear()(1, 0) = bad;
    EXPECT_NE(check_limits(limits(40, 0.5), X_O0O).code, Code::ok);
  }
}

TEST(Limits, ThatWereNeverSetPassNothingButZero) {
  EXPECT_EQ(check_limits({}, Pose::Identity()).code, Code::ok);
  EXPECT_EQ(check_limits({}, from_six_numbers({1e-9, 0, 0, 0, 0, 0})).code, Code::limit_x);
}

std::vector<View> without(std::vector<View> views, std::initializer_list<std::size_t> marks) {
  for (const std::size_t mark : marks)
    std::erase_if(views, [mark](const View& view) { return view.mark == mark; });
  return views;
}

TEST(MarksRequired, AreCountedInAllPerCameraAndByCameras) {
  CellScene scene = test::car_body();
  const auto verdict = [&scene](const std::vector<View>& used) {
    return check_marks(scene.job, scene.cameras, used);
  };
  const std::vector<View> all = scene.job.views;
  EXPECT_EQ(verdict(all).code, Code::ok);
  EXPECT_EQ(verdict(without(all, {0, 3, 6, 9, 1, 4})).code, Code::ok);
  const Verdict few = verdict(without(all, {0, 3, 6, 9, 1, 4, 7}));
  EXPECT_EQ(few.code, Code::too_few_marks);
  EXPECT_NE(few.reason.find("5 marks"), std::string::npos) << few.reason;
  EXPECT_NE(few.reason.find("camera3/2"), std::string::npos) << few.reason;
  const Verdict cameras = verdict(without(all, {0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(cameras.code, Code::too_few_cameras);
  EXPECT_NE(cameras.reason.find("2 cameras"), std::string::npos) << cameras.reason;
  scene.job.requirements.min_marks_per_camera = 2;
  EXPECT_EQ(verdict(without(all, {6})).code, Code::ok);
  const Verdict in_camera = verdict(without(all, {6, 8}));
  EXPECT_EQ(in_camera.code, Code::too_few_marks_in_camera);
  EXPECT_NE(in_camera.reason.find("camera3 has 1"), std::string::npos) << in_camera.reason;
}

TEST(MarksRequired, AreNeverFewerThanThreeAndNeedWeight) {
  CellScene scene = test::car_body();
  scene.job.requirements = {};
  scene.job.requirements.min_marks = 0;
  const std::vector<View> three = {scene.job.views[0], scene.job.views[4], scene.job.views[8]};
  EXPECT_EQ(check_marks(scene.job, scene.cameras, three).code, Code::ok);
  EXPECT_EQ(check_marks(scene.job, scene.cameras, std::span(three).first(2)).code, Code::too_few_marks);
  scene.job.marks[4].weight = 0;
  EXPECT_EQ(check_marks(scene.job, scene.cameras, three).code, Code::too_few_marks);
}

TEST(MarksRequired, CountAMarkOnceThatSeveralCamerasSee) {
  CellScene scene = test::car_body();
  scene.job.requirements.min_marks = 3;
  const std::vector<View> used = {{0, 0}, {1, 0}, {2, 0}, {3, 1}};
  EXPECT_EQ(check_marks(scene.job, scene.cameras, used).code, Code::too_few_marks);
}

TEST(Sigma, IsTheLargestAtTheWorstApplicationPoint) {
  CellScene scene = test::car_body();
  PoseResult pose;
  pose.total_covariance.diagonal() << 0.01, 0.04, 0.01, 0, 0, 1e-8;
  // At the point (3000, 0, 0): 1e-4 rad about z move y by 0.3 mm.
  scene.job.application_points = {{"near", {0, 0, 0}}, {"far", {3000, 0, 0}}};
  EXPECT_NEAR(worst_sigma_mm(scene.job, pose), std::sqrt(0.04 + 0.09), 1e-12);
  scene.job.requirements.max_sigma_mm = 0.37;
  EXPECT_EQ(check_sigma(scene.job, pose).code, Code::ok);
  scene.job.requirements.max_sigma_mm = 0.36;
  const Verdict verdict = check_sigma(scene.job, pose);
  EXPECT_EQ(verdict.code, Code::sigma_too_large);
  EXPECT_NE(verdict.reason.find("far is 0.361 mm"), std::string::npos) << verdict.reason;
  scene.job.requirements.max_sigma_mm = 0;
  EXPECT_EQ(check_sigma(scene.job, pose).code, Code::ok);
  scene.job.requirements.max_sigma_mm = 100;
  pose.total_covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(check_sigma(scene.job, pose).code, Code::sigma_too_large);
}

struct Picture {
  std::vector<std::uint8_t> pixels;
  ImageView view;
  explicit Picture(std::uint8_t grey, int width = 768, int height = 572)
      : pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), grey),
        view{pixels.data(), width, height, width} {}
};

TEST(ImageCheck, NamesBlackAndWhitePictures) {
  EXPECT_EQ(check_image(picture_health(Picture(100).view), "camera1").code, Code::ok);
  const Verdict dark = check_image(picture_health(Picture(3).view), "camera1");
  EXPECT_EQ(dark.code, Code::image_dark);
  EXPECT_NE(dark.reason.find("camera1"), std::string::npos);
  EXPECT_EQ(check_image(picture_health(Picture(255).view), "camera1").code, Code::image_saturated);
  EXPECT_EQ(check_image(picture_health({}), "camera1").code, Code::image_dark);
}

Zero some_zero() {
  Zero zero;
  zero.compensation_O_mm.assign(12, Eigen::Vector3d::Zero());
  return zero;
}

TEST(Measurement, StopsAtTheFirstThingThatIsMissing) {
  const CellScene scene = test::car_body();
  const Picture grey(100), small(100, 640, 480), black(0);
  std::vector<CameraImage> images;
  for (std::size_t camera = 0; camera < 4; ++camera) images.push_back({camera, grey.view});
  const auto code = [&](std::span<const CameraImage> pictures, const Zero& zero) {
    const Measurement measurement = measure({pictures, scene.job, scene.cameras, zero});
    EXPECT_FALSE(measurement.reason.empty());
    EXPECT_EQ(measurement.X_O0O.matrix(), Pose::Identity().matrix());
    return measurement.code;
  };
  EXPECT_EQ(code(images, {}), Code::zero_missing);
  Zero short_zero = some_zero();
  short_zero.compensation_O_mm.pop_back();
  EXPECT_EQ(code(images, short_zero), Code::zero_outdated);
  Zero nan_zero = some_zero();
  nan_zero.compensation_O_mm[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(images, nan_zero), Code::zero_outdated);
  EXPECT_EQ(code(std::span(images).first(3), some_zero()), Code::camera_missing);
  images[2].image = small.view;
  EXPECT_EQ(code(images, some_zero()), Code::frame_wrong_size);
  images[2].image = black.view;
  EXPECT_EQ(code(images, some_zero()), Code::image_dark);
  images[2].image = grey.view;
  EXPECT_EQ(code(images, some_zero()), Code::too_few_marks);
}

TEST(Measurement, RefusesAZeroThatIsNone) {
  const CellScene scene = test::car_body();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto expect = [&](const Zero& zero, const char* sentence) {
    const Measurement measurement = measure({{}, scene.job, scene.cameras, zero});
    EXPECT_EQ(measurement.code, Code::zero_outdated);
    EXPECT_NE(measurement.reason.find(sentence), std::string::npos) << measurement.reason;
  };
  std::vector<Zero> bad(5, some_zero());
  bad[0].X_WO0.translation().z() = nan;
  bad[1].X_WO0.linear()(0, 1) = inf;
  bad[2].X_WO0.linear() *= 1.001;
  bad[3].X_WO0.linear().col(0) *= -1;
  bad[4].compensation_O_mm[11].y() = -inf;
  for (const Zero& zero : bad) expect(zero, "holds numbers that are none");
  Zero longer = some_zero();
  longer.compensation_O_mm.emplace_back(0, 0, 0);
  expect(longer, "knows 13 marks, job body has 12");
}

TEST(Measurement, RefusesViewsOfWhatDoesNotExist) {
  const CellScene scene = test::car_body();
  const Picture grey(100);
  std::vector<CameraImage> images;
  for (std::size_t camera = 0; camera < 5; ++camera) images.push_back({camera, grey.view});
  for (const View& view : {View{4, 0}, View{0, 12}}) {
    Job job = scene.job;
    job.views.back() = view;
    const Measurement measurement = measure({images, job, scene.cameras, some_zero()});
    EXPECT_EQ(measurement.code, Code::marks_invalid) << measurement.reason;
    EXPECT_NE(measurement.reason.find("does not exist"), std::string::npos);
    EXPECT_TRUE(measurement.observations.empty());
  }
  // Pictures of cameras that no view asks for are nobody's business.
  EXPECT_EQ(measure({images, scene.job, scene.cameras, some_zero()}).code, Code::too_few_marks);
}

TEST(Measurement, SearchesAroundTheProjectionOfEachDisc) {
  const CellScene scene = test::car_body();
  const auto searches = job_searches(scene.job, scene.cameras, Pose::Identity());
  ASSERT_EQ(searches.size(), scene.job.views.size());
  test::Random random(1);
  const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0, random);
  for (std::size_t i = 0; i < searches.size(); ++i) {
    const Mark& mark = scene.job.marks[scene.job.views[i].mark];
    const CalibratedCamera& camera = scene.cameras[scene.job.views[i].camera];
    EXPECT_LT((searches[i].expected_px - observations[i].u_px).norm(), 1);
    const double mm_per_px = (camera.X_WC.inverse() * mark.p_O_mm).z() / camera.model.fx_px;
    EXPECT_NEAR(searches[i].half_window_px.x() * mm_per_px, mark.radius_mm + scene.job.search_mm, 0.1);
    EXPECT_NEAR(searches[i].min_diameter_px * mm_per_px, 1.4 * mark.radius_mm, 0.1);
    EXPECT_NEAR(searches[i].max_diameter_px * mm_per_px, 2.6 * mark.radius_mm, 0.1);
  }
  const auto away = job_searches(scene.job, scene.cameras, from_six_numbers({5000, 0, 0, 0, 0, 0}));
  for (const MarkSearch& search : away) EXPECT_EQ(search.half_window_px, Eigen::Vector2d(0, 0));
}

}  // namespace
}  // namespace zeropose
