// What a survey takes of what a robot tells, and why not.
#include "daemon/survey.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/board_picture.h"
#include "tests/support/body_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double noise = 2;

// Of a survey with one camera.
SurveyVerdict look_once(Survey& survey, int position, const Pose& X_RH, const ImageView& first,
                        const ImageView& second) {
  return survey.look(position, X_RH, {&first, 1}, {&second, 1});
}

class BallSurvey : public testing::Test {
 protected:
  static SurveyOptions options() {
    RoundTarget ball;
    ball.search.kind = MarkKind::ball;
    ball.search.min_diameter_px = 20;
    ball.search.max_diameter_px = 60;
    return {{{2, "camera3"}}, ball, 3};
  }
  test::Pixels picture(const std::vector<Vector2d>& balls_px) {
    test::Drawing drawing;
    drawing.width_px = 300, drawing.height_px = 200;
    for (const Vector2d& ball : balls_px) drawing.figures.push_back(test::ellipse(ball, 36, 1, 0, 60));
    return test::expose(test::paint(drawing), noise, random_);
  }
  using Balls = std::vector<Vector2d>;
  SurveyVerdict look_at(int position, const Balls& first, const Balls& second,
                        const Pose& X_RH = Pose::Identity()) {
    const test::Pixels a = picture(first), b = picture(second);
    return look_once(survey, position, X_RH, a.view(), b.view());
  }
  SurveyVerdict look(int position, const Vector2d& ball, const Pose& X_RH = Pose::Identity()) {
    return look_at(position, {ball}, {ball}, X_RH);
  }

  Survey survey{options()};

 private:
  std::mt19937_64 random_{5};
};

TEST_F(BallSurvey, KeepsWhereTheBallIsWithWhereTheHandWas) {
  const Pose X_RH = from_six_numbers({100, 200, 300, 10, 20, 30});
  const SurveyVerdict verdict = look(2, {120.3, 80.6}, X_RH);
  EXPECT_EQ(verdict.code, Code::ok) << verdict.reason;
  ASSERT_TRUE(survey.views().contains(2));
  const SurveyView& view = survey.views().at(2);
  EXPECT_TRUE(view.X_RH.isApprox(X_RH));
  ASSERT_EQ(view.points.size(), 1u);
  EXPECT_LT((view.points[0].u_px - Vector2d(120.3, 80.6)).norm(), 0.1);
  EXPECT_THAT(survey.missing(), ElementsAre(1, 3));
}

TEST_F(BallSurvey, GoesOnWithTheNextThatIsMissingAndThenFromTheStart) {
  EXPECT_EQ(survey.next_after(0), 1);
  look(1, {100, 100});
  EXPECT_EQ(survey.next_after(1), 2);
  look_at(2, {}, {});
  EXPECT_EQ(survey.next_after(2), 3);
  look(3, {100, 100});
  EXPECT_EQ(survey.next_after(3), 2);
  look(2, {100, 100});
  EXPECT_EQ(survey.next_after(2), 0);
}

TEST_F(BallSurvey, OfAStereoSensorNeedsTheBallInBothPictures) {
  SurveyOptions both = options();
  both.cameras.push_back({3, "camera4"});
  Survey stereo(both);
  const test::Pixels here = picture({{100, 100}}), there = picture({{180, 90}}), nowhere = picture({});
  const ImageView good[] = {here.view(), there.view()}, half[] = {here.view(), nowhere.view()};
  const SurveyVerdict verdict = stereo.look(1, Pose::Identity(), good, half);
  EXPECT_EQ(verdict.code, Code::too_few_marks);
  EXPECT_THAT(verdict.reason, HasSubstr("camera4: no ball is in sight"));
  EXPECT_TRUE(stereo.views().empty());
  ASSERT_EQ(stereo.look(1, Pose::Identity(), good, good).code, Code::ok);
  const std::vector<SurveyPoint>& points = stereo.views().at(1).points;
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].camera, "camera3");
  EXPECT_EQ(points[1].camera, "camera4");
  EXPECT_LT((points[1].u_px - Vector2d(180, 90)).norm(), 0.1);
  both.cameras.back() = both.cameras.front();
  EXPECT_THROW(Survey{both}, std::invalid_argument);
}

TEST_F(BallSurvey, HasATargetForEveryPositionOrNone) {
  SurveyOptions few = options();
  few.targets = {Pose::Identity(), Pose::Identity()};
  EXPECT_THROW(Survey{few}, std::invalid_argument);
  few.targets.push_back(Pose::Identity());
  EXPECT_NO_THROW(Survey{few});
}

TEST_F(BallSurvey, TheLastWordCounts) {
  look(1, {100, 100});
  look(1, {150, 90});
  EXPECT_NEAR(survey.views().at(1).points[0].u_px.x(), 150, 0.1);
}

TEST_F(BallSurvey, ABallOutOfSightIsNotTaken) {
  const SurveyVerdict verdict = look_at(1, {}, {});
  EXPECT_EQ(verdict.code, Code::too_few_marks);
  EXPECT_THAT(verdict.reason, HasSubstr("no ball is in sight"));
  EXPECT_EQ(look(1, {295, 100}).code, Code::too_few_marks) << "half of it is beyond the picture";
  EXPECT_THAT(survey.missing(), ElementsAre(1, 2, 3));
}

TEST_F(BallSurvey, TwoBallsAreOneTooMany) {
  const SurveyVerdict verdict = look_at(1, {{100, 100}, {200, 60}}, {{100, 100}, {200, 60}});
  EXPECT_EQ(verdict.code, Code::too_few_marks);
  EXPECT_THAT(verdict.reason, HasSubstr("2 things in the picture pass for the ball"));
}

TEST_F(BallSurvey, ARobotThatStillMovesIsNamed) {
  const SurveyVerdict verdict = look_at(1, {{100, 100}}, {{100.9, 100}});
  EXPECT_EQ(verdict.code, Code::not_standing_still);
  EXPECT_THAT(verdict.reason, HasSubstr("the target moved by"));
  EXPECT_EQ(look_at(1, {{100, 100}}, {{100.05, 100}}).code, Code::ok) << "less than the noise tells";
}

TEST_F(BallSurvey, PositionsCountFromOne) {
  for (const int position : {0, -1, 4})
    EXPECT_EQ(look(position, {100, 100}).code, Code::argument_out_of_range);
  SurveyOptions none = options();
  none.positions = 0;
  EXPECT_THROW(Survey{none}, std::invalid_argument);
}

test::BoardScene board(BoardKind kind, int rows) {
  test::BoardScene scene;
  scene.kind = kind;
  scene.rows = rows, scene.cols = 6;
  scene.pitch_mm = 12, scene.diameter_mm = 10;
  scene.X_CB = test::board_pose(scene, 500, 0.3, 0.4, 0.2);
  return scene;
}

SurveyVerdict look_at(const test::BoardScene& scene, Survey& survey) {
  std::mt19937_64 random(3);
  const test::Pixels picture = test::expose(test::paint(scene), noise, random);
  return look_once(survey, 1, Pose::Identity(), picture.view(), picture.view());
}

TEST(BoardSurvey, TakesABoardThatLooksDifferentFromEverySide) {
  const test::BoardScene scene = board(BoardKind::asymmetric_circles, 7);
  Survey survey({{{0, "camera1"}}, BoardTarget{scene.problem()}, 1});
  const SurveyVerdict verdict = look_at(scene, survey);
  ASSERT_EQ(verdict.code, Code::ok) << verdict.reason;
  EXPECT_EQ(survey.views().at(1).points.size(), 42u);
}

TEST(BoardSurvey, ABoardThatTurnsAboutItsMiddleMoves) {
  const test::BoardScene scene = board(BoardKind::asymmetric_circles, 7);
  test::BoardScene turned = scene;
  turned.X_CB = test::board_pose(scene, 500, 0.3, 0.4, 0.212);
  Survey survey({{{0, "camera1"}}, BoardTarget{scene.problem()}, 1});
  std::mt19937_64 random(3);
  const test::Pixels first = test::expose(test::paint(scene), noise, random),
                     second = test::expose(test::paint(turned), noise, random);
  EXPECT_EQ(look_once(survey, 1, Pose::Identity(), first.view(), second.view()).code,
            Code::not_standing_still);
}

TEST(BoardSurvey, RefusesABoardWhoseFrameMayTurn) {
  const test::BoardScene scene = board(BoardKind::circles, 7);
  Survey survey({{{0, "camera1"}}, BoardTarget{scene.problem()}, 1});
  const SurveyVerdict verdict = look_at(scene, survey);
  EXPECT_EQ(verdict.code, Code::too_few_marks);
  EXPECT_THAT(verdict.reason, HasSubstr("the board looks the same from 2 sides"));
}

TEST(BodySurvey, KeepsEveryMarkWithItsPlaceAndItsPlane) {
  test::BodyScene scene;
  scene.X_CB = test::looking_at_body({1, 1, 1}, 2900, 10);
  BodyTarget body;
  body.marks = test::published_body(scene.radius_mm, true);
  body.problem.camera = scene.camera;
  Survey survey({{{0, "camera1"}}, body, 1});
  const test::Pixels first = test::photograph(scene);
  scene.seed = 2;
  const test::Pixels second = test::photograph(scene);
  const SurveyVerdict verdict = look_once(survey, 1, Pose::Identity(), first.view(), second.view());
  ASSERT_EQ(verdict.code, Code::ok) << verdict.reason;
  const std::vector<SurveyPoint>& points = survey.views().at(1).points;
  EXPECT_GE(points.size(), 40u);
  for (const SurveyPoint& point : points) {
    const auto mark = std::ranges::find(body.marks, point.p_B_mm, &BodyMark::p_B_mm);
    ASSERT_NE(mark, body.marks.end());
    EXPECT_EQ(point.radius_mm, 8);
    EXPECT_GT(point.normal_B.dot(test::body_normal(*mark)), 0.999);
    EXPECT_LT((point.u_px - scene.centre_px(*mark)).norm(), 0.1);
  }
}

TEST(BodySurvey, WithoutABodyInSightSaysSo) {
  BodyTarget body;
  body.marks = test::published_body(8, true);
  Survey survey({{{0, "camera1"}}, body, 1});
  const std::vector<std::uint8_t> grey(768 * 572, 120);
  const ImageView empty{grey.data(), 768, 572, 768};
  const SurveyVerdict verdict = look_once(survey, 1, Pose::Identity(), empty, empty);
  EXPECT_EQ(verdict.code, Code::too_few_marks);
  EXPECT_THAT(verdict.reason, HasSubstr("the body is not found"));
}

}  // namespace
}  // namespace zeropose
