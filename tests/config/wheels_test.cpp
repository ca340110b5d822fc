// A job of a wheel in a cell file: what it says, and what may be wrong with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "example_cell.h"

namespace zeropose {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Wheels : public testing::Test, protected ExampleFiles {
 protected:
  Wheels() : ExampleFiles("wheel-alignment") {}
  Json& wheel() { return job()["wheel"]; }
  Json& sensor(std::size_t i) { return wheel()["sensors"][i]; }
};

TEST_F(Wheels, AreReadWithTheirUnits) {
  wheel()["lines"]["control"] = 3;
  wheel()["lines"]["sigma_px"] = 2.1;
  wheel()["unevenness_mm"] = 0.2;
  ASSERT_THAT(mistakes(), IsEmpty());
  const Cell cell = parse_cell({json.dump(), "", calibration.dump(), ""});
  const Job& read = cell.jobs.front();
  const WheelTask& task = read.wheel.value();
  ASSERT_EQ(task.sensors.size(), 3u);
  EXPECT_EQ(task.sensors[1].name, "rear");
  EXPECT_NEAR(task.sensors[1].angle_rad, 210 / degrees_per_radian, 1e-12);
  EXPECT_EQ(task.sensors[2].left, 4u);
  EXPECT_EQ(task.sensors[2].right, 5u);
  EXPECT_EQ(task.layout.across, 3u);
  EXPECT_EQ(task.layout.control, 2u);  // counted from 0
  EXPECT_EQ(task.search.sigma_px, 2.1);
  EXPECT_EQ(task.tyre.min_radius_mm, 201);
  EXPECT_EQ(task.tyre.unevenness_mm, 0.2);
  EXPECT_NEAR(task.max_sigma_rad, 0.02 / degrees_per_radian, 1e-15);
  EXPECT_EQ(read.requirements.limits[3].min, -3.5);  // camber
  EXPECT_EQ(read.requirements.limits[5].max, 0);     // nothing turns about the axis
  EXPECT_NEAR(read.X_WO_nominal.translation().y(), -774.8, 1e-12);
  EXPECT_TRUE(read.marks.empty());
}

TEST_F(Wheels, StandInPlaceOfMarksAndGaps) {
  job()["limits"] = Json::object();
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].limits: found a key of another kind of job beside wheel")));
}

TEST_F(Wheels, HaveThreeSensorsRoundThemWithSixFixedCameras) {
  sensor(0)["left"] = "camera9";
  EXPECT_THAT(mistakes(), Contains(HasSubstr("jobs[0].wheel.sensors[0].left: found \"camera9\", expected the "
                                             "name of a fixed camera of this cell")));
  sensor(0)["left"] = "camera3";
  sensor(1)["name"] = "top";
  sensor(2)["angle_deg"] = 210 - 360 + 20;
  const auto all = mistakes();
  EXPECT_THAT(all, ElementsAre(HasSubstr("jobs[0].wheel.sensors[1].name: found \"top\" twice"),
                               HasSubstr("sensors[1].left: found a camera that another place has"),
                               HasSubstr("sensors[2].angle_deg: found less than 30 degrees from that of "
                                         "jobs[0].wheel.sensors[1]")));
  wheel()["sensors"].erase(2);
  EXPECT_THAT(mistakes(), Contains(HasSubstr("jobs[0].wheel.sensors: found an array of 2")));
}

TEST_F(Wheels, HaveAControlLineAndRadii) {
  wheel()["lines"]["control"] = 4;
  wheel()["side_wall_mm"] = {0, 300};
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].wheel.lines.control: found 4, expected at most the number"),
                          HasSubstr("jobs[0].wheel.side_wall_mm: found a radius at or below 0")));
}

TEST_F(Wheels, AreSeenByTheirCameras) {
  sensor(0)["angle_deg"] = 270;  // there is none
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].wheel: found camera \"camera1\", which does not see the middle"),
                          HasSubstr("camera \"camera2\"")));
}

}  // namespace
}  // namespace zeropose
