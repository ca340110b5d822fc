// Boards and bodies that a robot shows to a camera, or its camera to them, with nothing but the commands of
// the guide (spec 40 P1, P3 extended).
#include <algorithm>
#include <thread>

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

// One picture of the body, its place by a laser tracker that sees four control marks to 0.02 mm.
TEST(BoardChain, OnePictureOfTheBodyAndATrackerTellWhereACameraStands) {
  const Site site("car-body");
  const Json file = Json::parse(std::ifstream(site.file("car-body.sim.json")), nullptr, true, true);
  const auto survey = std::ranges::find(file["surveys"], "camera1-body",
                                        [](const Json& one) { return one.value("name", ""); });
  ASSERT_NE(survey, file["surveys"].end());
  const auto pose = [](const Json& six) {
    const auto s = six.get<std::array<double, 6>>();
    return from_six_numbers({s[0], s[1], s[2], s[3], s[4], s[5]});
  };
  // The robot holds it where it says to 0.5 mm and 0.02 degrees; the tracker is believed, so the test must
  // not know better than that.
  const Pose X_WR = from_six_numbers({1200, -2400, -150, 0, 0, 90});
  const Pose X_WB = X_WR * pose((*survey)["hand_poses"][0]["X_RH"]) * pose((*survey)["in_hand"]);
  const auto robot = site.simulated({"--survey", "camera1-body"});
  const auto running = site.daemon();
  site.ask({"status", "--wait", "30"});
  // Until the robot shows the body; it then waits for a survey.
  Finished found;
  for (int attempt = 0; attempt < 20 && (attempt == 0 || found.status != 0); ++attempt) {
    std::this_thread::sleep_for(1s);
    site.ask({"snapshot", "--camera", "camera1", "--plain", "--out", site.file("body.png")});
    found = site.zeropose({"find-body", "--image", site.file("body.png"), "--body",
                           site.file("calibration-body.csv"), "--focal-px", "4200"});
  }
  ASSERT_EQ(found.status, 0) << found.out << found.err;
  std::ofstream control(site.file("control.csv"));
  control << "mark,xa,ya,za,xb,yb,zb\n";
  int mark = 0;
  for (const Eigen::Vector3d& p_B : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(300, 0, 0),
                                     Eigen::Vector3d(0, 300, 0), Eigen::Vector3d(0, 0, 300)}) {
    const Eigen::Vector3d p_W = X_WB * p_B;
    control << ++mark << ',' << p_W.x() << ',' << p_W.y() << ',' << p_W.z() << ',' << p_B.x() << ','
            << p_B.y() << ',' << p_B.z() << '\n';
  }
  control.close();
  const Json answer = site.calibrated(
      {"body", "--image", site.file("body.png"), "--body", site.file("calibration-body.csv"), "--focal-px",
       "4200", "--control", site.file("control.csv"), "--control-sigma-mm", "0.5"},
      "camera1.json");
  const CalibratedCamera truth = site.truth_of("camera1");
  const SixNumbers six = to_six_numbers(truth.X_WC);
  const std::array<double, 6> wanted{six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(std::remainder(answer["X_WC"][i].get<double>() - wanted[i], i < 3 ? 1e9 : 360)),
              4.5 * answer["sigma_X_WC"][i].get<double>())
        << i;
}

}  // namespace
}  // namespace zeropose
