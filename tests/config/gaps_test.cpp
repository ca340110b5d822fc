// A job that evens gaps in a cell file: what it says, and what may be wrong with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "example_cell.h"

namespace zeropose {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Gaps : public testing::Test, protected ExampleFiles {
 protected:
  Gaps() : ExampleFiles("pane-gaps") {}
  Json& gaps() { return job()["gaps"]; }
  Json& place(std::size_t i) { return gaps()["places"][i]; }
};

TEST_F(Gaps, AreReadWithTheirUnits) {
  place(1)["wanted_mm"] = 0.5;
  place(1)["max_wedge_deg"] = 2;
  place(2)["plane"] = parsed(R"({"point_mm": [-500, 0, 250], "normal": [0, 0.6, 0.8]})");
  ASSERT_THAT(mistakes(), IsEmpty());
  const Cell cell = parse_cell({json.dump(), "", calibration.dump(), ""});
  const GapTask& task = cell.jobs.front().gaps.value();
  ASSERT_EQ(task.gaps.size(), 6u);
  EXPECT_EQ(task.gaps[3].camera, 3u);
  EXPECT_EQ(task.gaps[1].wanted_mm, 0.5);
  EXPECT_NEAR(task.gaps[1].search.max_wedge_rad, 2 / degrees_per_radian, 1e-12);
  EXPECT_EQ(task.gaps[0].search.frame, EdgeSense::bright_to_dark);
  EXPECT_NEAR(task.max_rz_rad, 0.8 / degrees_per_radian, 1e-12);
  // The pane's own plane, but for the one that has another.
  EXPECT_TRUE(task.gaps[0].plane.p_H_mm.isApprox(Eigen::Vector3d(15, -10, 260), 1e-12));
  EXPECT_TRUE(task.gaps[0].plane.n_H.isApprox(Eigen::Vector3d(0, 0, -1), 1e-12));
  EXPECT_TRUE(task.gaps[2].plane.n_H.isApprox(Eigen::Vector3d(0, 0.6, 0.8), 1e-12));
  EXPECT_TRUE(cell.jobs.front().marks.empty());
}

TEST_F(Gaps, StandInPlaceOfMarks) {
  job()["marks"] = Json::array();
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].marks: found a key of another kind of job beside gaps")));
  Json other = example();
  other["jobs"][0].erase("marks");
  EXPECT_THAT(mistakes_in(other),
              Contains(HasSubstr("jobs[0].marks: found no such key, expected the job's marks, or gaps")));
}

TEST_F(Gaps, AreSeenByCamerasOnTheHandOfOneRobot) {
  place(0)["camera"] = "camera9";
  EXPECT_THAT(mistakes(), Contains(HasSubstr("jobs[0].gaps.places[0].camera: found \"camera9\", expected the "
                                             "name of a camera with on_hand_of")));
  place(0)["camera"] = "camera1";
  Json robot = json["robots"][0];
  robot["name"] = "robot2";
  robot["link"]["port"] = 1599;
  json["robots"].push_back(robot);
  json["cameras"][2]["on_hand_of"] = "robot2";
  EXPECT_THAT(mistakes(), Contains(HasSubstr("jobs[0].gaps.places: found cameras on the hands of several "
                                             "robots")));
}

TEST_F(Gaps, TellTheirMotionInThePanesFrame) {
  json["robots"][0]["frame"] = "world_shift";
  EXPECT_THAT(mistakes(), ElementsAre(HasSubstr("robots[0].frame: found another frame than object_zero")));
}

TEST_F(Gaps, AreEnough) {
  gaps()["min_gaps"] = 7;
  EXPECT_THAT(mistakes(), ElementsAre(HasSubstr("jobs[0].gaps.min_gaps: found 7, expected from 4 to the 6")));
  gaps()["min_gaps"] = 3;
  EXPECT_THAT(mistakes(), ElementsAre(HasSubstr("jobs[0].gaps.min_gaps: found 3, expected from 4")));
  gaps()["even"] = false;
  EXPECT_THAT(mistakes(), IsEmpty());
  gaps()["even"] = true;
  for (const std::size_t i : {0, 1, 2}) place(i)["weight"] = 0;
  EXPECT_THAT(mistakes(), ElementsAre(HasSubstr("jobs[0].gaps.places: found 3 gaps with a weight above 0")));
}

TEST_F(Gaps, HaveANameEachAWindowInTheImageAndARange) {
  place(1)["name"] = place(0)["name"];
  place(2)["window"]["centre_px"] = {620, 240};
  place(3)["gap_mm"] = {0, 5};
  const auto all = mistakes();
  EXPECT_THAT(all, Contains(HasSubstr("jobs[0].gaps.places[1].name: found \"upper left\" twice")));
  EXPECT_THAT(all, Contains(HasSubstr("jobs[0].gaps.places[2].window: found a window that reaches beyond the "
                                      "image, expected one within the 640 x 480 px of \"camera3\"")));
  EXPECT_THAT(all,
              Contains(HasSubstr("jobs[0].gaps.places[3].gap_mm: found a range that begins at or below 0")));
  EXPECT_EQ(all.size(), 3u);
}

TEST_F(Gaps, LieInAPlaneThatTheCameraSees) {
  // Behind the camera, and along its line of sight.
  place(4)["plane"] = parsed(R"({"point_mm": [0, 0, -800], "normal": [0, 0, 1]})");
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].gaps.places[4]: found a gap that cannot be measured: "
                                    "the line of sight through the window's centre does not meet "
                                    "the plane")));
}

}  // namespace
}  // namespace zeropose
