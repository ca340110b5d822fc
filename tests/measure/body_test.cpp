// The calibration body in rendered pictures: every disc gets its right number, or there is no answer.
#include "measure/body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/body_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::BodyScene;

BodyProblem problem_of(const std::vector<BodyMark>& marks, double focal_px) {
  BodyProblem problem;
  problem.marks = marks;
  problem.focal_px = focal_px;
  return problem;
}

// Noise and eccentricity move a disc's image by less than this, the next disc is twenty times as far.
constexpr double own_place_px = 0.5;

void expect_right_numbers(const BodyScene& scene, const BodyResult& result) {
  const std::vector<BodyMark> marks = scene.marks();
  for (const BodyPoint& point : result.points) {
    EXPECT_FALSE(scene.hidden.contains(point.mark)) << "hidden mark " << marks[point.mark].name;
    EXPECT_LT((point.u_px - scene.centre_px(marks[point.mark])).norm(), own_place_px)
        << "mark " << marks[point.mark].name;
  }
}

std::size_t in_sight(const BodyScene& scene) {
  std::size_t count = 0;
  const std::vector<BodyMark> marks = scene.marks();
  for (std::size_t k = 0; k < marks.size(); ++k)
    count += !scene.hidden.contains(k) && scene.is_inside(marks[k]) ? 1 : 0;
  return count;
}

BodyScene scene_of(const Vector3d& from_B, double distance_mm, double roll_deg) {
  BodyScene scene;
  scene.camera = {768, 572, 4235.24, 4227.56, 396.04, 292.77, Division{0.376498}};
  scene.X_CB = test::looking_at_body(from_B, distance_mm, roll_deg);
  return scene;
}

// Some marks hidden, false discs on the walls and beside: another choice for every seed.
void spoil(BodyScene& scene, std::size_t hidden, int false_discs, std::uint64_t seed) {
  std::vector<std::size_t> all(44);
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::mt19937_64 random(seed);
  std::shuffle(all.begin(), all.end(), random);
  scene.hidden = {all.begin(), all.begin() + std::ptrdiff_t(hidden)};
  scene.false_discs = false_discs;
  scene.seed = seed;
}

struct View {
  Vector3d from_B;
  double distance_mm, roll_deg;
};

// Straight on, strongly tilted against each of the planes, near, far, upside down.
const View views[] = {{{1, 1, 1}, 3000, 0},      {{1, 1, 1}, 3000, 180},    {{1, .3, .6}, 3000, 70},
                      {{.3, .25, 1}, 3000, -50}, {{.2, 1, .3}, 3200, 10},   {{.5, 1, .8}, 6000, 110},
                      {{.9, .4, .2}, 3000, 150}, {{.18, .2, 1}, 3000, 200}, {{1, .17, .3}, 3300, 250},
                      {{1, 1, .3}, 3000, -90},   {{.4, 1, .2}, 4500, 45},   {{.7, .5, 1}, 9000, 300}};

class BodyViews : public testing::TestWithParam<int> {};

TEST_P(BodyViews, EveryMarkInSightIsNumbered) {
  const View& view = views[GetParam()];
  BodyScene scene = scene_of(view.from_B, view.distance_mm, view.roll_deg);
  scene.radius_mm = view.distance_mm > 5000 ? 14 : 9;
  const test::Pixels picture = photograph(scene);
  // The focal length is off by 20 %, one way or the other.
  const std::vector<BodyMark> marks = scene.marks();
  const BodyResult result =
      find_body(picture.view(), problem_of(marks, scene.camera.fx_px * (GetParam() % 2 == 0 ? 1.2 : 0.8)));
  ASSERT_EQ(result.status, BodyStatus::found) << result.reason;
  EXPECT_GE(result.points.size(), in_sight(scene));
  EXPECT_EQ(result.points.size() + result.missing.size(), marks.size());
  EXPECT_LT(result.next_best, result.explained);
  expect_right_numbers(scene, result);
}

TEST_P(BodyViews, HiddenMarksAndFalseDiscsChangeNoNumber) {
  const View& view = views[GetParam()];
  BodyScene scene = scene_of(view.from_B, view.distance_mm, view.roll_deg);
  scene.radius_mm = view.distance_mm > 5000 ? 14 : 9;
  spoil(scene, 8, 15, 100 + std::uint64_t(GetParam()));
  const test::Pixels picture = photograph(scene);
  // Radii are not told.
  const std::vector<BodyMark> marks = test::published_body(0, false);
  const BodyResult result = find_body(picture.view(), problem_of(marks, scene.camera.fx_px));
  ASSERT_EQ(result.status, BodyStatus::found) << result.reason;
  EXPECT_GE(result.points.size() + 1, in_sight(scene));
  expect_right_numbers(scene, result);
}

INSTANTIATE_TEST_SUITE_P(Body, BodyViews, testing::Range(0, int(std::size(views))));

// A wide lens with a strong bend at close range, nothing known of it.
TEST(Body, IsFoundWithoutAnyInternals) {
  for (const double K : {-0.25, 0.2}) {
    BodyScene scene = scene_of({.8, 1, .7}, 750, 40);
    scene.camera = {768, 572, 1105, 1100, 390, 270, Division{K}};
    const test::Pixels picture = photograph(scene);
    const std::vector<BodyMark> marks = test::published_body(0, false);
    const BodyResult result = find_body(picture.view(), problem_of(marks, 0));
    ASSERT_EQ(result.status, BodyStatus::found) << result.reason;
    EXPECT_EQ(result.points.size(), in_sight(scene));
    expect_right_numbers(scene, result);
  }
}

TEST(Body, BrightMarksAndTheWholeCameraGiven) {
  BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  std::swap(scene.surface, scene.print);
  const test::Pixels picture = photograph(scene);
  const std::vector<BodyMark> marks = scene.marks();
  BodyProblem problem = problem_of(marks, 0);
  problem.camera = scene.camera;
  const BodyResult result = find_body(picture.view(), problem);
  ASSERT_EQ(result.status, BodyStatus::found) << result.reason;
  EXPECT_FALSE(result.dark_on_light);
  EXPECT_EQ(result.points.size(), in_sight(scene));
  expect_right_numbers(scene, result);
}

TEST(Body, NormalsLookTowardsTheCamera) {
  BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  const test::Pixels picture = photograph(scene);
  const std::vector<BodyMark> marks = scene.marks();
  const BodyResult result = find_body(picture.view(), problem_of(marks, 4200));
  ASSERT_EQ(result.status, BodyStatus::found) << result.reason;
  // The table's planes lean by up to 2.4 mm over 130.
  for (const BodyPoint& point : result.points)
    EXPECT_GT(point.normal_B.dot(test::body_normal(marks[point.mark])), std::cos(2.4 / 130));
}

TEST(Body, OnePlaneAloneIsAmbiguous) {
  BodyScene scene = scene_of({.7, .8, 1}, 3000, 20);
  for (std::size_t mark = 20; mark < 44; ++mark) scene.hidden.insert(mark);
  const test::Pixels picture = photograph(scene);
  const std::vector<BodyMark> marks = scene.marks();
  const BodyResult result = find_body(picture.view(), problem_of(marks, 4200));
  EXPECT_EQ(result.status, BodyStatus::ambiguous) << result.reason;
  EXPECT_NE(result.reason.find("explains 20 of 20 round things, one with other numbers "), std::string::npos)
      << result.reason;
  EXPECT_TRUE(result.points.empty());
}

// However much is hidden: never a wrong number.
TEST(Body, RefusesWhereTooLittleIsSeen) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    BodyScene scene = scene_of({.7, .8, 1}, 3000, 45 * double(seed));
    spoil(scene, 20 + 2 * seed, 10, seed);
    const test::Pixels picture = photograph(scene);
    const std::vector<BodyMark> marks = scene.marks();
    const BodyResult result = find_body(picture.view(), problem_of(marks, 4600));
    expect_right_numbers(scene, result);
    if (result.status == BodyStatus::found) ++found;
    EXPECT_EQ(result.points.empty(), result.status != BodyStatus::found);
    EXPECT_TRUE(result.status == BodyStatus::found || !result.reason.empty());
  }
  EXPECT_GT(found, 0);
}

TEST(Body, LeftHandedTableIsExplained) {
  for (const View& view : {views[0], views[2], views[5]}) {
    BodyScene scene = scene_of(view.from_B, view.distance_mm, view.roll_deg);
    scene.radius_mm = view.distance_mm > 5000 ? 14 : 9;
    const test::Pixels picture = photograph(scene);
    std::vector<BodyMark> marks = scene.marks();
    for (BodyMark& mark : marks) std::swap(mark.p_B_mm.y(), mark.p_B_mm.z());
    const BodyResult result = find_body(picture.view(), problem_of(marks, 4200));
    EXPECT_EQ(result.status, BodyStatus::mirrored) << view.distance_mm << " mm: " << result.reason;
    EXPECT_NE(result.reason.find("left-handed"), std::string::npos) << result.reason;
    EXPECT_TRUE(result.points.empty());
  }
}

TEST(Body, NormalsOfTheWrongSignAreExplained) {
  const BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  const test::Pixels picture = photograph(scene);
  std::vector<BodyMark> marks = test::published_body(scene.radius_mm, true);
  EXPECT_EQ(find_body(picture.view(), problem_of(marks, 4200)).status, BodyStatus::found);
  for (BodyMark& mark : marks) mark.normal_B = -mark.normal_B;
  const BodyResult result = find_body(picture.view(), problem_of(marks, 4200));
  EXPECT_EQ(result.status, BodyStatus::from_behind) << result.reason;
}

// The right places under shuffled numbers would be a wrong table; another body's places are none.
TEST(Body, AnotherBodyIsNotFound) {
  const BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  const test::Pixels picture = photograph(scene);
  std::vector<BodyMark> marks = scene.marks();
  // The three planes meet at other angles.
  for (BodyMark& mark : marks) mark.p_B_mm.z() += 0.6 * mark.p_B_mm.x() - 0.4 * mark.p_B_mm.y();
  const BodyResult result = find_body(picture.view(), problem_of(marks, 4200));
  EXPECT_NE(result.status, BodyStatus::found);
  EXPECT_FALSE(result.reason.empty());
}

TEST(Body, RefusesWhatCannotBe) {
  const BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  const test::Pixels blank{768, 572, 768, std::vector<std::uint8_t>(768 * 572, 128)};
  std::vector<BodyMark> marks = scene.marks();
  EXPECT_EQ(find_body({}, problem_of(marks, 4200)).status, BodyStatus::empty_image);
  const BodyResult nothing = find_body(blank.view(), problem_of(marks, 4200));
  EXPECT_EQ(nothing.status, BodyStatus::no_numbering);
  EXPECT_NE(nothing.reason.find("0 of 0 round things"), std::string::npos) << nothing.reason;
  EXPECT_EQ(find_body(blank.view(), problem_of(marks, -1)).status, BodyStatus::wrong_problem);
  const std::vector<BodyMark> few(marks.begin(), marks.begin() + 7);
  EXPECT_EQ(find_body(blank.view(), problem_of(few, 4200)).status, BodyStatus::wrong_problem);
  // On a helix: no four in a plane that form rows and columns.
  for (std::size_t k = 0; k < marks.size(); ++k)
    marks[k].p_B_mm = {100 * std::cos(double(k)), 100 * std::sin(double(k)), 40 * double(k)};
  EXPECT_EQ(find_body(blank.view(), problem_of(marks, 4200)).status, BodyStatus::no_layout);
  marks[3].p_B_mm.x() = std::nan("");
  EXPECT_EQ(find_body(blank.view(), problem_of(marks, 4200)).status, BodyStatus::wrong_problem);
}

TEST(Body, SameAnswerBitByBit) {
  BodyScene scene = scene_of({1, .6, .8}, 3000, 20);
  spoil(scene, 5, 8, 7);
  const test::Pixels picture = photograph(scene);
  const std::vector<BodyMark> marks = scene.marks();
  const BodyResult first = find_body(picture.view(), problem_of(marks, 4000)),
                   second = find_body(picture.view(), problem_of(marks, 4000));
  ASSERT_EQ(first.points.size(), second.points.size());
  EXPECT_EQ(first.X_CB.matrix(), second.X_CB.matrix());
  for (std::size_t k = 0; k < first.points.size(); ++k) {
    EXPECT_EQ(first.points[k].mark, second.points[k].mark);
    EXPECT_EQ(first.points[k].u_px, second.points[k].u_px);
  }
}

}  // namespace
}  // namespace zeropose
