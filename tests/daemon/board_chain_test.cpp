// Boards and bodies that a robot shows to a camera, or its camera to them, with nothing but the commands of
// the guide (spec 40 P1, P3 extended).
#include "tests/daemon/site.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

// Its internals and its place in the hand, both from one survey of a board that hangs in the cell.
TEST(BoardChain, ACameraOnTheHandIsCalibratedByABoardAndMeasuresAfterwards) {
  const Site site("hand-camera");
  site.survey("hand", "hand",
              {"--target", "asymmetric-circles", "--rows", "9", "--cols", "4", "--pitch-mm", "22",
               "--diameter-mm", "18", "--positions", "12"});
  const CalibratedCamera truth = site.truth_of("hand");
  const std::string robot = site.file("hand-robot.csv"), points = site.file("hand-points.csv");
  const Json views =
      site.calibrated({"views", "--points", points, "--width", "768", "--height", "572"}, "lens.json");
  expect_near(views["camera"], views["sigma"], truth.model);
  const Json answer = site.calibrated({"hand-eye", "--setup", "eye-in-hand", "--robot", robot, "--points",
                                       points, "--camera", site.file("lens.json")},
                                      "hand.json");
  expect_near(answer["X_HC"], truth.X_WC, answer["sigma"]["X_HC"]);
  site.activate("hand", "hand.json");
  const auto parts = site.simulated({"--drive", "--cars", "4"});
  const auto running = site.daemon();
  site.ask({"status", "--wait", "30"});
  EXPECT_EQ(parts->wait(100s), 0) << "a part was not corrected within the figures of the cell";
}

// The extended form of the calibration body, without a laser tracker; and its single picture with control
// marks.
TEST(BoardChain, ABodyOnTheHandTellsWhereACameraStands) {
  const Site site("car-body");
  site.survey("camera1-body", "camera1",
              {"--target", "body", "--body", site.file("calibration-body.csv"), "--positions", "12"});
  const CalibratedCamera truth = site.truth_of("camera1");
  const std::string robot = site.file("camera1-robot.csv"), points = site.file("camera1-points.csv");
  const Json views =
      site.calibrated({"views", "--points", points, "--width", "768", "--height", "572"}, "lens.json");
  expect_near(views["camera"], views["sigma"], truth.model);
  const Json answer =
      site.calibrated({"hand-eye", "--setup", "eye-to-hand", "--robot", robot, "--points", points, "--camera",
                       site.file("lens.json"), "--X-WR", "1200,-2400,-150,0,0,90"},
                      "camera1.json");
  const Pose X_WR = from_six_numbers({1200, -2400, -150, 0, 0, 90});
  expect_near(answer["X_RC"], X_WR.inverse() * truth.X_WC, answer["sigma"]["X_RC"]);
}

}  // namespace
}  // namespace zeropose
