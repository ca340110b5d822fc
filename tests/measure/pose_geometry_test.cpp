// What no pose can be estimated from: refused by name (spec 85 R16), and bad numbers answered with a code.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "measure/pose.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using test::car_body_points;
using test::CellScene;
using test::estimate;
using Random = test::Random;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(PoseGeometry, RefusesTooFewMarks) {
  CellScene scene = car_body_points();
  Random random(13);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  observations.resize(2);
  EXPECT_EQ(estimate(scene, observations, Pose::Identity()).code, Code::too_few_marks);
  EXPECT_EQ(estimate(scene, {}, Pose::Identity()).code, Code::too_few_marks);
  PoseProblem planar = test::problem_of(scene.cameras, scene.job, observations, Pose::Identity());
  planar.X_WP_planar = Pose::Identity();
  planar.observations = planar.observations.first(1);
  EXPECT_EQ(estimate_pose(planar).code, Code::too_few_marks);
  scene.job.marks[0].weight = scene.job.marks[1].weight = 0;
  observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  observations.resize(4);  // two of weight
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  EXPECT_EQ(result.code, Code::too_few_marks);
  EXPECT_NE(result.reason.find("2 marks"), std::string::npos) << result.reason;
}

TEST(PoseGeometry, RefusesMarksOnALine) {
  CellScene scene = car_body_points();
  Random random(14);
  for (std::size_t i = 0; i < 12; ++i)
    scene.job.marks[i].p_O_mm = Eigen::Vector3d(-400 + 280.0 * static_cast<double>(i), 0, 200);
  for (auto& view : scene.job.views) view.camera = view.mark % 4;
  for (auto& camera : scene.cameras) camera.model.distortion = Division{};
  for (const bool start : {true, false}) {
    const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
    ASSERT_EQ(observations.size(), 12u);
    const PoseResult result =
        estimate(scene, observations, start ? std::optional<Pose>(Pose::Identity()) : std::nullopt);
    EXPECT_EQ(result.code, Code::geometry_degenerate);
    EXPECT_NE(result.reason.find("on a line"), std::string::npos) << result.reason;
  }
}

TEST(PoseGeometry, RefusesOneMarkPerCameraSeenInParallel) {
  CellScene scene = car_body_points();
  Random random(15);
  // Four cameras look straight down at one mark each, on the optical axis: turning about z and moving in x
  // and y are seen, depth and tilt hardly.
  scene.job.marks.resize(4);
  scene.job.views.clear();
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = i % 2 ? 1000 : -1000, y = i < 2 ? 600 : -600;
    scene.cameras[i].X_WC = from_six_numbers({x, y, 3000, 180, 0, 0});
    scene.cameras[i].model.cx_px = 384;
    scene.cameras[i].model.cy_px = 286;
    scene.job.marks[i].p_O_mm = Eigen::Vector3d(x, y, 0);
    scene.job.views.push_back({i, i});
  }
  for (int trial = 0; trial < 50; ++trial)
    for (const bool start : {true, false}) {
      const auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
      const PoseResult result =
          estimate(scene, observations, start ? std::optional<Pose>(Pose::Identity()) : std::nullopt);
      EXPECT_EQ(result.code, Code::geometry_degenerate) << result.reason;
      EXPECT_FALSE(result.reason.empty());
    }
}

TEST(PoseGeometry, RefusesToChooseBetweenSeveralPosesOfThreeMarks) {
  CellScene scene = car_body_points();
  Random random(16);
  scene.job.marks.resize(3);
  scene.job.views = {{0, 0}, {0, 1}, {0, 2}};
  int refused = 0;
  for (int trial = 0; trial < 10; ++trial) {
    for (Mark& mark : scene.job.marks) mark.p_O_mm = test::uniform_vector(random, 200);
    Pose X_WO = scene.cameras[0].X_WC * Pose(Eigen::Translation3d(0, 0, 2000));
    X_WO.linear() = test::uniform_rotation(random);
    const auto observations = test::observe(scene.cameras, scene.job, X_WO, 0, random);
    const PoseResult result = estimate(scene, observations, std::nullopt);
    if (result.code == Code::ok)
      test::expect_near(result.X_WO, X_WO, 1, 1);  // then it was the only one
    else
      refused += result.code == Code::geometry_degenerate;
    test::expect_near(estimate(scene, observations, X_WO).X_WO, X_WO, 1e-3, 1e-3);  // a start decides
  }
  EXPECT_GE(refused, 5);
}

// Numbers that cannot be used are answered, not asserted: production must go on.

TEST(PoseInput, AnswersWithACodeToNumbersThatCannotBeUsed) {
  const CellScene scene = car_body_points();
  Random random(17);
  const auto good = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  const auto refuses = [&](const char* what, auto spoil) {
    CellScene spoilt = scene;
    auto observations = good;
    spoil(spoilt, observations);
    const PoseResult result = estimate(spoilt, observations, Pose::Identity());
    EXPECT_EQ(result.code, Code::marks_invalid) << what;
    EXPECT_FALSE(result.reason.empty()) << what;
  };
  using Observations = std::vector<Observation>;
  refuses("camera", [](CellScene&, Observations& o) { o[3].camera = 4; });
  refuses("mark", [](CellScene&, Observations& o) { o[3].mark = 12; });
  refuses("pixel", [](CellScene&, Observations& o) { o[3].u_px.x() = nan; });
  refuses("infinite pixel", [](CellScene&, Observations& o) { o[3].u_px.y() = -no_tolerance; });
  refuses("covariance nan", [](CellScene&, Observations& o) { o[3].covariance_px2(0, 1) = nan; });
  refuses("covariance zero", [](CellScene&, Observations& o) { o[3].covariance_px2.setZero(); });
  refuses("covariance indefinite", [](CellScene&, Observations& o) { o[3].covariance_px2 << 1, 2, 2, 1; });
  refuses("covariance not symmetric",
          [](CellScene&, Observations& o) { o[3].covariance_px2 << 1, 0.5, 0, 1; });
  refuses("radius", [](CellScene&, Observations& o) { o[3].radius_share = nan; });
  refuses("twice", [](CellScene&, Observations& o) { o.push_back(o[3]); });
  refuses("twice with another pixel", [](CellScene&, Observations& o) {
    o.insert(o.begin(), o[3]);
    o.front().u_px.x() += 1;
  });
  refuses("weight", [](CellScene& s, Observations&) { s.job.marks[3].weight = -0.1; });
  refuses("weight above one", [](CellScene& s, Observations&) { s.job.marks[3].weight = 1.1; });
  refuses("weight nan", [](CellScene& s, Observations&) { s.job.marks[3].weight = nan; });
  refuses("position", [](CellScene& s, Observations&) { s.job.marks[3].p_O_mm.z() = nan; });
  refuses("tolerance", [](CellScene& s, Observations&) { s.job.marks[3].tolerance_mm = nan; });
  refuses("focal length", [](CellScene& s, Observations&) { s.cameras[1].model.fx_px = 0; });
  refuses("camera pose", [](CellScene& s, Observations&) { s.cameras[1].X_WC.translation().x() = nan; });
  refuses("system sigma", [](CellScene& s, Observations&) { s.job.system_sigma_px = -1; });
}

TEST(PoseInput, TakesAMarkFromEveryCameraOnceInAnyOrder) {
  CellScene scene = car_body_points();
  Random random(19);
  for (CalibratedCamera& camera : scene.cameras) camera.X_WC = scene.cameras[0].X_WC;
  scene.job.views.clear();
  for (std::size_t camera = 0; camera < 4; ++camera)
    for (std::size_t mark = 0; mark < 3; ++mark) scene.job.views.push_back({camera, mark});
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  std::shuffle(observations.begin(), observations.end(), random);
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  ASSERT_EQ(result.code, Code::ok) << result.reason;
  EXPECT_EQ(result.effective_marks, 3);
  EXPECT_EQ(result.effective_cameras, 4);
  EXPECT_EQ(result.redundancy, 18);
}

TEST(PoseInput, SurvivesPixelsWithoutARay) {
  CellScene scene = car_body_points();
  Random random(18);
  auto observations = test::observe(scene.cameras, scene.job, Pose::Identity(), 0.1, random);
  for (auto& observation : observations) observation.u_px.array() += 1e7;
  const PoseResult result = estimate(scene, observations, Pose::Identity());
  EXPECT_NE(result.code, Code::ok);
  EXPECT_FALSE(result.reason.empty());
}

}  // namespace
}  // namespace zeropose
