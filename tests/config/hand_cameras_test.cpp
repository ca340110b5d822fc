// Cameras on the hand of a robot in a cell file: what may be said of them, and where they then are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "example_cell.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string& calibration_text() {
  static const std::string text = read_file(ZEROPOSE_SOURCE_DIR "/config/cells/hand-camera.calibration.json");
  return text;
}

class HandCameras : public testing::Test {
 protected:
  Json& job() { return json["jobs"][0]; }
  std::vector<std::string> mistakes() const { return mistakes_in(json.dump(), calibration.dump()); }

  Json json = parsed(read_file(ZEROPOSE_SOURCE_DIR "/config/cells/hand-camera.json"));
  Json calibration = parsed(calibration_text());
};

TEST_F(HandCameras, AreWhereTheRobotCarriesThem) {
  const Cell cell = parse_cell({json.dump(), "", calibration_text(), ""});
  const Job& job = cell.jobs.front();
  ASSERT_EQ(job.positions.size(), 8u);
  const auto taught = cameras_for(cell, job);
  ASSERT_EQ(taught.size(), 9u);
  EXPECT_EQ(taught[2].name, "hand at front left across");
  EXPECT_EQ(camera_name(cell, job, 0), "hand");
  std::vector<Pose> X_RH;
  for (const HandPosition& position : job.positions)
    X_RH.push_back(moved(position.X_RH, (Vector6() << 1, -2, 3, 0.01, 0, -0.02).finished()));
  const auto now = cameras_for(cell, job, X_RH);
  const Pose &X_WR = cell.robots[0].X_WR, &X_HC = cell.calibration[0].X_WC;
  for (std::size_t i = 0; i < X_RH.size(); ++i) {
    EXPECT_TRUE((X_WR * job.positions[i].X_RH * X_HC).isApprox(taught[i + 1].X_WC, 1e-12));
    EXPECT_TRUE((X_WR * X_RH[i] * X_HC).isApprox(now[i + 1].X_WC, 1e-12));
    EXPECT_FALSE(now[i + 1].on_hand);
  }
  // The second mark is the first one seen from the second position.
  EXPECT_EQ(job.views[1].camera, 2u);
  EXPECT_EQ(device_of(job, job.views[1].camera, 1), 0u);
}

TEST_F(HandCameras, HaveTheirPoseInTheHand) {
  calibration["hand"]["X_WC"] = calibration["hand"]["X_HC"];
  calibration["hand"].erase("X_HC");
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr(
                  "calibration.json: hand: found X_WC, expected X_HC, since the camera is on the hand")));
  json["cameras"][0].erase("on_hand_of");
  EXPECT_THAT(mistakes(), testing::Contains(HasSubstr("expected the name of a camera with on_hand_of")));
}

TEST_F(HandCameras, AreSeenFromPositionsOnly) {
  job()["marks"][0]["cameras"] = {"hand"};
  EXPECT_THAT(mistakes(), ElementsAre(HasSubstr(
                              "jobs[0].marks[0].cameras[0]: found \"hand\", expected the name of a fixed "
                              "camera of this cell, or of a position of this job")));
}

TEST_F(HandCameras, PositionsAreToldApartAndUsed) {
  job()["positions"][1]["name"] = "front left along";
  EXPECT_THAT(mistakes(),
              testing::Contains(HasSubstr(
                  "jobs[0].positions[1].name: found \"front left along\", as in jobs[0].positions[0]")));
  job()["positions"][1]["name"] = "nowhere";
  for (Json& mark : job()["marks"])
    if (mark["cameras"][0] == "front left across") mark["cameras"] = {"front left along"};
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("jobs[0].positions[1].name: found \"nowhere\", expected a position "
                                    "that at least one mark names")));
  job()["positions"][1]["name"] = "hand";
  EXPECT_THAT(mistakes(), testing::Contains(HasSubstr("found \"hand\", expected a name that no camera has")));
}

TEST_F(HandCameras, NeedARobotThatCanTellWhereItsHandIs) {
  json["cameras"][0]["on_hand_of"] = "robot7";
  EXPECT_THAT(mistakes(),
              testing::Contains(HasSubstr("cameras[0].on_hand_of: found \"robot7\", expected the name "
                                          "of a robot of this cell")));
  json["cameras"][0]["on_hand_of"] = "robot1";
  json["robots"][0]["axis"] = {{"direction", {1, 0, 0}}, {"zero_mm", 0}};
  EXPECT_THAT(mistakes(),
              ElementsAre(HasSubstr("cameras[0].on_hand_of: found \"robot1\", expected a robot without "
                                    "a linear axis, on a link of type modbus-tcp or modbus-rtu")));
}

// Both cameras of a stereo sensor look from every position; a mark that names the position is seen by both.
class StereoOnAHand : public testing::Test {
 protected:
  Json json = parsed(read_file(ZEROPOSE_SOURCE_DIR "/config/cells/window-pane.json"));
  const std::string calibration = read_file(ZEROPOSE_SOURCE_DIR "/config/cells/window-pane.calibration.json");
};

TEST_F(StereoOnAHand, LooksFromEveryPositionWithBothCameras) {
  const Cell cell = parse_cell({json.dump(), "", calibration, ""});
  const Job& job = cell.jobs.front();
  ASSERT_EQ(job.positions.size(), 6u);
  EXPECT_EQ(hand_eyes(job).size(), 12u);
  ASSERT_EQ(job.views.size(), 12u);
  EXPECT_EQ(job.views[2].mark, 1u);
  EXPECT_EQ(job.views[3].mark, 1u);
  std::vector<Pose> X_RH;
  for (const HandPosition& position : job.positions)
    X_RH.push_back(moved(position.X_RH, (Vector6() << 1, -2, 3, 0.01, 0, -0.02).finished()));
  const auto now = cameras_for(cell, job, X_RH);
  ASSERT_EQ(now.size(), 14u);
  EXPECT_EQ(now[5].name, "right at top");
  EXPECT_TRUE((cell.robots[0].X_WR * X_RH[1] * cell.calibration[1].X_WC).isApprox(now[5].X_WC, 1e-12));
  EXPECT_EQ(device_of(job, job.views[2].camera, 2), 0u);
  EXPECT_EQ(device_of(job, job.views[3].camera, 2), 1u);
}

TEST_F(StereoOnAHand, NamesEachCameraOnceAndAllOfOneHand) {
  Json& position = json["jobs"][0]["positions"][2];
  position["cameras"] = {"left", "left"};
  EXPECT_THAT(
      mistakes_in(json.dump(), calibration),
      ElementsAre(HasSubstr("positions[2].cameras[1]: found \"left\" twice, expected each camera once")));
  position["cameras"] = Json::array();
  EXPECT_THAT(
      mistakes_in(json.dump(), calibration),
      testing::Contains(HasSubstr("positions[2].cameras: found no camera, expected the names of cameras "
                                  "with on_hand_of, all of one robot")));
  position["cameras"] = {"left", "right"};
  json["robots"].push_back(json["robots"][0]);
  json["robots"][1]["name"] = "robot2";
  json["robots"][1]["link"]["unit"] = 2;
  json["cameras"][1]["on_hand_of"] = "robot2";
  EXPECT_THAT(
      mistakes_in(json.dump(), calibration),
      testing::Contains(HasSubstr("positions[2].cameras[1]: found \"right\", expected a camera on the "
                                  "same hand as the first one")));
}

}  // namespace
}  // namespace zeropose
