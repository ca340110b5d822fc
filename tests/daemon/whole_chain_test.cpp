// From an uncalibrated press shop to corrections, with nothing but the commands of the guide: a robot carries
// a ball before each camera, the cameras are calibrated from that and activated, then sheets come.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "config/cameras.h"
#include "tests/support/walking_line.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
namespace fs = std::filesystem;

class WholeChain : public testing::Test {
 protected:
  WholeChain() {
    for (const char* name : {"press-shop.json", "press-shop.calibration.json", "press-shop.sim.json"})
      fs::copy(fs::path(ZEROPOSE_SOURCE_DIR) / "config/cells" / name, folder / name);
  }

  std::string cell() const { return folder / "press-shop.json"; }
  std::string file(const std::string& name) const { return folder / name; }

  std::unique_ptr<Process> simulated(const std::vector<std::string>& more) const {
    std::vector<std::string> command = {program_path("zeropose-cell"), "--cell", cell()};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Process>(command, folder / "cell.log");
  }
  std::unique_ptr<Process> daemon() const {
    return std::make_unique<Process>(
        std::vector<std::string>{program_path("zeroposed"), "--cell", cell(), "--state", file("state"),
                                 "--socket", file("zeropose.sock")},
        folder / "daemon.log");
  }
  Finished zeropose(std::vector<std::string> arguments, std::chrono::seconds patience = 60s) const {
    arguments.insert(arguments.begin(), program_path("zeropose"));
    return run_program(arguments, patience);
  }
  void ask(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--socket", file("zeropose.sock")});
    const Finished answer = zeropose(arguments, 120s);
    ASSERT_EQ(answer.status, 0) << answer.out << answer.err;
  }

  // The robot goes through its grid while the daemon gathers.
  void survey(const std::string& camera) const {
    const auto robot = simulated({"--survey", camera});
    const auto running = daemon();
    ask({"status", "--wait", "30"});
    ask({"calibrate", "survey", "--camera", camera, "--positions", "27", "--target", "ball", "--bright",
         "--min-diameter-px", "15", "--max-diameter-px", "90", "--robot", file(camera + "-robot.csv"),
         "--points", file(camera + "-ball.csv")});
    EXPECT_EQ(robot->wait(20s), 0) << text_of_file(folder / "cell.log")
                                   << text_of_file(folder / "daemon.log");
    running->signal(SIGTERM);
    EXPECT_EQ(running->wait(20s), 0);
  }

  Json calibrated(const std::string& camera) const {
    const Finished answer = zeropose({"calibrate",   "ball",
                                      "--setup",     "eye-to-hand",
                                      "--robot",     file(camera + "-robot.csv"),
                                      "--pixels",    file(camera + "-ball.csv"),
                                      "--tool",      "0,0,180",
                                      "--radius-mm", "30",
                                      "--width",     "1280",
                                      "--height",    "1024",
                                      "--X-WR",      "0,2600,-400,0,0,-90",
                                      "--output",    file(camera + ".json"),
                                      "--json"});
    EXPECT_EQ(answer.status, 0) << answer.out << answer.err;
    return Json::parse(answer.out);
  }

  CalibratedCamera truth_of(const std::string& camera) const {
    const Json truth = Json::parse(std::ifstream(folder / "press-shop.sim.json"), nullptr, true, true);
    return parse_cameras(Json{{camera, truth["cameras"][camera]}}.dump(), "truth").front();
  }

  const TemporaryFolder folder;
};

// Each number of the pose within 4.5 of its sigmas: seven numbers of two cameras would miss that once in
// 10000 times.
void expect_near_truth(const Json& answer, const CalibratedCamera& truth) {
  const std::array<double, 6> found = answer["X_WC"];
  const SixNumbers six = to_six_numbers(truth.X_WC);
  const std::array<double, 6> wanted{six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
  const std::array names{"x", "y", "z", "rx", "ry", "rz"};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(std::remainder(found[i] - wanted[i], 360.0 * (i < 3 ? 1e6 : 1))),
              4.5 * answer["sigma"][names[i]].get<double>())
        << truth.name << " " << names[i];
}

TEST_F(WholeChain, ARobotCalibratesTheCamerasThatGuideItAfterwards) {
  for (const std::string camera : {"left", "right"}) {
    survey(camera);
    expect_near_truth(calibrated(camera), truth_of(camera));
    const Finished activated = zeropose({"calibration", "activate", "--cell", cell(), "--camera", camera,
                                         "--from", file(camera + ".json"), "--why", "ball grid"});
    ASSERT_EQ(activated.status, 0) << activated.out << activated.err;
  }
  const Finished history = zeropose({"calibration", "history", "--cell", cell(), "--json"});
  EXPECT_EQ(Json::parse(history.out)["entries"].size(), 3u);
  const auto sheets = simulated({"--drive", "--cars", "6"});
  const auto running = daemon();
  ask({"status", "--wait", "30"});
  ask({"zero"});
  EXPECT_EQ(sheets->wait(60s), 0)
      << "a sheet was not corrected within 2 mm at its ends, or its verdict was wrong";
}

TEST_F(WholeChain, UndoBringsTheCalibrationBack) {
  std::ofstream(folder / "new.json") << camera_text(truth_of("left"), true);
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "calibration");
    more.insert(more.end(), {"--cell", cell(), "--json"});
    return zeropose(more);
  };
  EXPECT_EQ(run({"undo"}).status, 1);
  const std::vector<std::string> activate = {"activate",       "--camera", "left", "--from",
                                             file("new.json"), "--why",    "w"};
  std::vector<std::string> dry = activate;
  dry.push_back("--dry-run");
  const Json change = Json::parse(run(dry).out);
  EXPECT_GT(change["change"]["moved_mm"], 0.1);
  EXPECT_TRUE(Json::parse(run({"history"}).out)["entries"].empty());
  EXPECT_EQ(run(activate).status, 0);
  const Json after = Json::parse(run({"history"}).out);
  ASSERT_EQ(after["entries"].size(), 2u);
  EXPECT_EQ(after["hash"], after["entries"][1]["hash"]);
  EXPECT_EQ(run({"undo"}).status, 0);
  EXPECT_EQ(Json::parse(run({"history"}).out)["hash"], after["entries"][0]["hash"]);
  EXPECT_EQ(run({"activate", "--camera", "middle", "--from", file("new.json"), "--why", "w"}).status, 2);
}

}  // namespace
}  // namespace zeropose
