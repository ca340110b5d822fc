// From an uncalibrated press shop to corrections, with nothing but the commands of the guide: a robot carries
// a ball before each camera, the cameras are calibrated from that and activated, then sheets come.
#include "tests/daemon/site.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

TEST(WholeChain, ARobotCalibratesTheCamerasThatGuideItAfterwards) {
  const Site site("press-shop");
  const std::vector<std::string> ball{"--target",          "ball", "--bright", "--min-diameter-px", "15",
                                      "--max-diameter-px", "90"};
  std::vector<std::string> own_grid = ball, told = ball;
  own_grid.insert(own_grid.end(), {"--positions", "27"});
  told.insert(told.end(), {"--drive", "loader", "--first", "1950,850,780,180,0,0", "--step", "650,500,500"});
  for (const std::string camera : {"left", "right"}) {
    site.survey(camera, camera, camera == "left" ? own_grid : told);
    const Json answer =
        site.calibrated({"ball", "--setup", "eye-to-hand", "--robot", site.file(camera + "-robot.csv"),
                         "--pixels", site.file(camera + "-points.csv"), "--tool", "0,0,180", "--radius-mm",
                         "30", "--width", "1280", "--height", "1024", "--X-WR", "0,2600,-400,0,0,-90"},
                        camera + ".json");
    expect_near(answer["X_WC"], site.truth_of(camera).X_WC, sigmas_of_pose(answer["sigma"]));
    site.activate(camera, camera + ".json");
  }
  const Finished history = site.zeropose({"calibration", "history", "--cell", site.cell(), "--json"});
  EXPECT_EQ(Json::parse(history.out)["entries"].size(), 3u);
  const auto sheets = site.simulated({"--drive", "--cars", "6"});
  const auto running = site.daemon();
  site.ask({"status", "--wait", "30"});
  site.ask({"zero"});
  EXPECT_EQ(sheets->wait(60s), 0)
      << "a sheet was not corrected within 2 mm at its ends, or its verdict was wrong";
}

// No camera looks; the simulated pointer misses the tip by 0.1 mm on each axis.
TEST(WholeChain, ARobotThatTouchesATipTellsWhereItsToolEnds) {
  const Site site("press-shop");
  const auto robot = site.simulated({"--survey", "pointer"});
  const auto running = site.daemon();
  site.ask({"status", "--wait", "30"});
  site.ask(
      {"calibrate", "survey", "--target", "touch", "--positions", "8", "--robot", site.file("touches.csv")});
  EXPECT_EQ(robot->wait(20s), 0) << text_of_file(site.folder / "cell.log");
  const Finished tool = site.zeropose({"calibrate", "tool", "--touches", site.file("touches.csv"), "--json"});
  ASSERT_EQ(tool.status, 0) << tool.out << tool.err;
  const Json answer = Json::parse(tool.out);
  const std::array<double, 3> truth{12.5, -8, 215};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_LT(answer["sigma"][axis].get<double>(), 0.2);
    EXPECT_NEAR(answer["p_HT"][axis].get<double>(), truth[axis], 4.5 * answer["sigma"][axis].get<double>());
  }
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--target", "touch", "--camera", "left"},
        {"--target", "ball", "--camera", "left"}}) {
    std::vector<std::string> wrong{"calibrate",   "survey",
                                   "--positions", "8",
                                   "--robot",     site.file("new.csv"),
                                   "--socket",    site.file("zeropose.sock")};
    wrong.insert(wrong.end(), more.begin(), more.end());
    EXPECT_EQ(site.zeropose(wrong).status, 2);
  }
}

TEST(WholeChain, UndoBringsTheCalibrationBack) {
  const Site site("press-shop");
  std::ofstream(site.folder / "new.json") << camera_text(site.truth_of("left"), true);
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "calibration");
    more.insert(more.end(), {"--cell", site.cell(), "--json"});
    return site.zeropose(more);
  };
  EXPECT_EQ(run({"undo"}).status, 1);
  const std::vector<std::string> activate = {"activate", "--camera", "left", "--from", site.file("new.json"),
                                             "--why",    "w"};
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
  EXPECT_EQ(run({"activate", "--camera", "middle", "--from", site.file("new.json"), "--why", "w"}).status, 2);
}

}  // namespace
}  // namespace zeropose
