// A job that evens gaps, from pictures to a checked motion of the pane, and every way to refuse it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "measure/measurement.h"
#include "tests/measure/pane_cameras.h"

namespace zeropose {
namespace {

using test::degree;
using test::GapScene;
using test::in_plane;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double noise_grey = 2;

// Upper and lower places do not face each other, so that a wrong one is told from the others.
std::vector<PaneGap> places() {
  std::vector<PaneGap> gaps = test::pane_gaps(test::even_gap_mm);
  gaps[0].p_T_mm.x() = 250, gaps[1].p_T_mm.x() = 750;
  gaps[4].p_T_mm.x() = 450, gaps[5].p_T_mm.x() = 1050;
  return gaps;
}

class GapJob : public testing::Test {
 protected:
  GapJob() {
    job.name = "pane";
    job.gaps.emplace();
    GapTask& task = *job.gaps;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const GapProblem problem = test::wide_problem_of(cameras[i].scene);
      task.gaps.push_back({cameras[i].place.name, i, problem.search, problem.plane});
      calibration.push_back(problem.camera);
    }
    task.min_gaps = 5;
    task.shape_sigma_mm = 0.01;
    task.max_x_mm = task.max_y_mm = 2;
    task.max_rz_rad = degree;
    for (const test::PaneCamera& camera : cameras) scenes.push_back(test::seen(camera, X_HF));
  }

  Measurement measured() {
    pixels.clear();
    std::vector<CameraImage> images;
    for (const GapScene& scene : scenes) pixels.push_back(test::expose(painted(scene), noise_grey, random));
    for (std::size_t i = 0; i < pixels.size(); ++i) images.push_back({i, pixels[i].view()});
    return of(images);
  }
  Measurement of(std::span<const CameraImage> images) const {
    return zeropose::measure({images, job, calibration, Zero{}});
  }
  void stand(const Pose& X) {
    X_HF = X;
    for (std::size_t i = 0; i < cameras.size(); ++i) scenes[i] = test::seen(cameras[i], X_HF);
  }
  // Painting takes its time; the noise of every exposure is new.
  static const test::Picture& painted(const GapScene& scene) {
    static std::map<std::string, test::Picture> known;
    const auto [picture, is_new] = known.try_emplace(key_of(scene));
    if (is_new) picture->second = test::paint(scene);
    return picture->second;
  }
  static std::string key_of(const GapScene& scene) {
    std::ostringstream key;
    key << std::hexfloat << scene.frame_off_mm << ' ' << scene.frame_turn_rad << ' ' << scene.centre_px.x()
        << ' ' << scene.turn_rad << ' ' << scene.frame_grey << ' ' << scene.gap_grey << ' ' << scene.blur_px;
    return key.str();
  }
  // A picture without any edge.
  static void hide(GapScene& scene) { scene.frame_grey = scene.pane_grey = scene.gap_grey = 100; }

  std::mt19937_64 random{31};
  std::vector<test::PaneCamera> cameras = test::pane_cameras(random, places());
  Pose X_HF = in_plane(0.5, -0.4, 0.06 * degree);
  std::vector<GapScene> scenes;
  std::vector<test::Pixels> pixels;
  std::vector<CalibratedCamera> calibration;
  Job job;
};

TEST_F(GapJob, TheMotionEvensTheGaps) {
  const Measurement m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_EQ(m.pose.effective_marks, 6);
  EXPECT_EQ(m.pose.effective_cameras, 6);
  EXPECT_EQ(m.health.size(), 6u);
  ASSERT_TRUE(m.gaps);
  EXPECT_THAT(m.gaps->used, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_NEAR(m.largest_deviation_mm, test::unevenness_mm(cameras, X_HF), 0.01);
  // Noise of 0.001 mm; half of the wedge of 0.001 rad times the shift of 1 mm.
  EXPECT_LT(test::unevenness_mm(cameras, m.X_O0O.inverse() * X_HF), 0.005);
  EXPECT_GT(m.sigma_mm, 0);
  EXPECT_LT(m.sigma_mm, 0.005);
}

TEST_F(GapJob, ThePaneMaySitAnyhowInTheHand) {
  const Measurement plain = measured();
  // The same pictures with another T: the same motion, told in that frame.
  const Pose X_HT = in_plane(300, -200, 70 * degree);
  job.gaps->X_HT = X_HT;
  job.gaps->max_x_mm = job.gaps->max_y_mm = 20;
  std::vector<CameraImage> images;
  for (std::size_t i = 0; i < pixels.size(); ++i) images.push_back({i, pixels[i].view()});
  const Measurement turned = of(images);
  ASSERT_EQ(turned.code, Code::ok) << turned.reason;
  EXPECT_LT(difference(X_HT * turned.X_O0O * X_HT.inverse(), plain.X_O0O).norm(), 1e-6);
}

TEST_F(GapJob, GoesToTheGapsThatAreWanted) {
  job.gaps->even = false;
  for (GapView& gap : job.gaps->gaps) gap.wanted_mm = test::even_gap_mm;
  Measurement m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_LT(test::unevenness_mm(cameras, m.X_O0O.inverse() * X_HF), 0.005);
  for (const double gap_mm : m.gaps->evening.predicted_mm) EXPECT_NEAR(gap_mm, test::even_gap_mm, 0.01);
  // All gaps miss it alike: the frame is too wide, and no motion helps.
  stand(Pose::Identity());
  for (GapView& gap : job.gaps->gaps) gap.wanted_mm = test::even_gap_mm - 0.3;
  job.gaps->shape_sigma_mm = 0.3;
  m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;  // to where they are missed least
  stand(m.X_O0O.inverse());
  m = measured();
  EXPECT_EQ(m.code, Code::gaps_not_even) << m.reason;
}

TEST_F(GapJob, EvenGapsNeedNoMotion) {
  stand(in_plane(0.02, 0.01, 0));
  const Measurement m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_TRUE(m.gaps->evening.even_already);
  EXPECT_TRUE(m.X_O0O.isApprox(Pose::Identity(), 0));
}

TEST_F(GapJob, GoesOnWithoutOneGapAndNamesItWhereAllAreNeeded) {
  hide(scenes[0]);
  Measurement m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_THAT(m.gaps->used, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_EQ(m.pose.effective_marks, 5);
  job.gaps->min_gaps = 6;
  m = measured();
  EXPECT_EQ(m.code, Code::too_few_marks);
  EXPECT_THAT(m.reason, HasSubstr("5 gaps were measured, 6 are required (top1 "));
  EXPECT_TRUE(m.X_O0O.isApprox(Pose::Identity(), 0));
}

// Left and right alone tell a shift along x: a wrong one of them would not be noticed without the other.
TEST_F(GapJob, RefusesWhatNothingChecks) {
  hide(scenes[2]);
  scenes[3].frame_off_mm += 0.4;
  Measurement m = measured();
  EXPECT_EQ(m.code, Code::hidden_error_too_large) << m.reason;
  EXPECT_THAT(m.reason, HasSubstr("nothing checks gap right"));
  EXPECT_THAT(m.reason, HasSubstr("(left edge_not_found"));
  EXPECT_TRUE(m.X_O0O.isApprox(Pose::Identity(), 0));
  // Whoever asks for no check gets none.
  job.gaps->min_gaps = 4;
  m = measured();
  EXPECT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_GT(test::unevenness_mm(cameras, m.X_O0O.inverse() * X_HF), 0.1);
}

TEST_F(GapJob, RemovesAGapThatContradictsTheOthers) {
  scenes[4].frame_off_mm += 0.4;
  Measurement m = measured();
  ASSERT_EQ(m.code, Code::ok) << m.reason;
  EXPECT_THAT(m.gaps->used, ElementsAre(0, 1, 2, 3, 5));
  EXPECT_LT(test::unevenness_mm(cameras, m.X_O0O.inverse() * X_HF), 0.01);
  job.gaps->min_gaps = 6;
  m = measured();
  EXPECT_EQ(m.code, Code::too_few_marks);
  EXPECT_THAT(m.reason, HasSubstr("wrong is low1"));
}

TEST_F(GapJob, TwoWrongGapsAreRefused) {
  scenes[4].frame_off_mm += 0.4;
  scenes[1].frame_off_mm += 0.3;
  EXPECT_EQ(measured().code, Code::deviation_not_attributable);
}

TEST_F(GapJob, SaysWhenThePicturesAreToBlame) {
  for (std::size_t i : {0, 3}) scenes[i].blur_px = 7;
  const Measurement blurred = measured();
  EXPECT_EQ(blurred.code, Code::image_blurred) << blurred.reason;
  for (std::size_t i : {0, 3}) scenes[i].blur_px = 0.8, scenes[i].frame_grey = 300;
  const Measurement m = measured();
  EXPECT_EQ(m.code, Code::image_saturated) << m.reason;
  EXPECT_THAT(m.reason, HasSubstr("top1"));
}

TEST_F(GapJob, NamesACameraWithoutAPictureOrWithAnother) {
  measured();
  std::vector<CameraImage> images;
  for (std::size_t i = 0; i + 1 < pixels.size(); ++i) images.push_back({i, pixels[i].view()});
  EXPECT_EQ(of(images).code, Code::camera_missing);
  ImageView small = pixels[5].view();
  small.height_px -= 10;
  images.push_back({5, small});
  EXPECT_EQ(of(images).code, Code::frame_wrong_size);
  const std::vector<std::uint8_t> white(240 * 200, 255), black(240 * 200, 0);
  images[5].image = {white.data(), 240, 200, 240};
  EXPECT_EQ(of(images).code, Code::image_saturated);
  images[5].image = {black.data(), 240, 200, 240};
  EXPECT_EQ(of(images).code, Code::image_dark);
  job.gaps->gaps[0].camera = 9;
  EXPECT_EQ(of(images).code, Code::marks_invalid);
}

TEST_F(GapJob, RefusesAProblemThatMakesNoSenseByTheGapsName) {
  job.gaps->gaps[3].plane.n_H.setZero();
  const Measurement m = measured();
  EXPECT_EQ(m.code, Code::marks_invalid);
  EXPECT_THAT(m.reason, HasSubstr("gap right"));
}

TEST_F(GapJob, RefusesAMotionBeyondItsLimit) {
  job.gaps->max_x_mm = 0.3;
  EXPECT_EQ(measured().code, Code::limit_x);
  job.gaps->max_x_mm = 2;
  job.gaps->max_sigma_mm = 1e-5;
  const Measurement m = measured();
  EXPECT_EQ(m.code, Code::sigma_too_large);
  EXPECT_THAT(m.reason, HasSubstr("at gap "));
}

// The shapes differ by 0.15 mm in a way that no motion takes away: the robot goes to the best place first.
TEST_F(GapJob, SaysWhenNoMotionEvensThem) {
  job.gaps->shape_sigma_mm = 0.2;
  const auto bend = [this] {
    for (const std::size_t i : {0, 4}) scenes[i].frame_off_mm += 0.15;
    for (const std::size_t i : {1, 5}) scenes[i].frame_off_mm -= 0.15;
  };
  bend();
  const Measurement far = measured();
  ASSERT_EQ(far.code, Code::ok) << far.reason;
  stand(far.X_O0O.inverse() * X_HF);
  bend();
  const Measurement near = measured();
  EXPECT_EQ(near.code, Code::gaps_not_even) << near.reason;
  EXPECT_TRUE(near.X_O0O.isApprox(Pose::Identity(), 0));
}

TEST_F(GapJob, ADefaultOneIsRefused) {
  job.gaps.emplace();
  const Measurement m = measured();
  EXPECT_NE(m.code, Code::ok);
}

}  // namespace
}  // namespace zeropose
