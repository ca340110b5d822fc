// The pane-gaps cell as a whole: six cameras on a hand, the daemon, the command line, and a robot that evens
// gaps.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "calib/rigid.h"
#include "config/cell.h"
#include "example_line.h"
#include "measure/code.h"
#include "protocol/line_socket.h"
#include "sim/gap_object.h"
#include "sim/robot.h"
#include "sim/scene.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
using testing::HasSubstr;

class PaneGaps : public ExampleLine {
 protected:
  void start(const std::vector<std::string>& options,
             const std::filesystem::path& cell = file_of("pane-gaps")) {
    simulated = start_cell("pane-gaps", options);
    daemon = start_daemon(cell);
    const Finished status = zeropose({"status", "--wait", "30"});
    ASSERT_EQ(status.out.find("MISSING"), std::string::npos) << status.out << logs();
    ASSERT_THAT(status.out, HasSubstr("job pane: ready")) << status.out;
    ASSERT_THAT(status.out, HasSubstr("needs no zero measurement"));
  }
  Json json_of(std::vector<std::string> verb) const {
    verb.push_back("--json");
    return Json::parse(zeropose(std::move(verb)).out);
  }
  void ask_cell(const Json& question) const {
    const Json answer = Json::parse(ask(folder / "cell.sock", question.dump(), 20s));
    EXPECT_EQ(answer["status"], "ok") << answer;
  }
  void shift(std::array<double, 6> X_O0O) const { ask_cell({{"cmd", "shift"}, {"pose", X_O0O}}); }
  void fault(const Json& question) const {
    Json all = question;
    all["cmd"] = "fault";
    ask_cell(all);
  }

  std::unique_ptr<Process> simulated, daemon;
};

TEST_F(PaneGaps, TheRobotEvensTheGapsOfEveryCar) {
  // The third car has something over an edge.
  ASSERT_NO_FATAL_FAILURE(start({"--drive", "--cars", "3"}));
  EXPECT_EQ(simulated->wait(120s), 0) << logs();
  EXPECT_THAT(text_of_file(folder / "cell.log"), HasSubstr("3 cars:")) << logs();
}

TEST_F(PaneGaps, TheCommandLineShowsEveryGap) {
  ASSERT_NO_FATAL_FAILURE(start({"--control", (folder / "cell.sock").string()}));
  shift({1, -0.5, 0, 0, 0, 0.2});
  Json answer = json_of({"measure"});
  ASSERT_EQ(answer["code"], 0) << answer << logs();
  ASSERT_EQ(answer["gaps"]["places"].size(), 6u);
  // The truth, by the simulator's geometry.
  const Cell cell = load_cell(file_of("pane-gaps"));
  const Scene scene = load_scene(cell, ZEROPOSE_SOURCE_DIR "/config/cells/pane-gaps.sim.json");
  const auto& object = std::get<GapsObject>(scene.object);
  const Pose X_OT = from_six_numbers({1, -0.5, 0, 0, 0, 0.2}).inverse();
  for (std::size_t i = 0; i < 6; ++i) {
    const Json& gap = answer["gaps"]["places"][i];
    EXPECT_EQ(gap["gap"], object.places[i].name);
    // Half a percent of the distance, and the place beside the centre where the gap has a wedge.
    EXPECT_NEAR(gap["gap_mm"].get<double>(), true_gap_mm(object, object.places[i], X_OT), 0.06) << gap;
    EXPECT_LT(gap["sigma_mm"].get<double>(), 0.005);
    EXPECT_TRUE(gap["used"]);
  }
  // The motion takes the car's shift away.
  const Json motion = answer["gaps"]["motion"];
  EXPECT_NEAR(motion[0].get<double>(), 1, 0.05);
  EXPECT_NEAR(motion[1].get<double>(), -0.5, 0.05);
  EXPECT_NEAR(motion[5].get<double>(), 0.2, 0.01);
  EXPECT_LT(answer["gaps"]["predicted_worst_mm"].get<double>(), 0.05);
  EXPECT_THAT(zeropose({"measure"}).out, HasSubstr("camera3: gap left "));
  EXPECT_EQ(json_of({"status"})["gaps"]["places"].size(), 6u);
  shift({0, 0, 0, 0, 0, 0});
  answer = json_of({"measure"});
  EXPECT_TRUE(answer["gaps"]["even_already"]) << answer;
  EXPECT_EQ(answer["X_O0O"], Json({0, 0, 0, 0, 0, 0}));
}

TEST_F(PaneGaps, RefusesByNameWhatItCannotAnswer) {
  ASSERT_NO_FATAL_FAILURE(start({"--control", (folder / "cell.sock").string()}));
  EXPECT_EQ(json_of({"zero"})["code"], static_cast<int>(Code::no_procedure));
  shift({1, -0.5, 0, 0, 0, 0.2});
  for (const char* edge : {"left hidden", "upper left hidden"})
    fault({{"kind", "cover-mark"}, {"mark", edge}});
  Json answer = json_of({"measure"});
  EXPECT_EQ(answer["code"], static_cast<int>(Code::too_few_marks)) << answer;
  EXPECT_THAT(answer["reason"].get<std::string>(), HasSubstr("left "));
  EXPECT_FALSE(answer.contains("X_O0O"));
  fault({{"kind", "clear"}});
  shift({5, 0, 0, 0, 0, 0});
  EXPECT_EQ(json_of({"measure"})["code"], static_cast<int>(Code::limit_x));
  const Finished picture =
      zeropose({"snapshot", "--camera", "camera3", "--out", (folder / "gap.png").string()});
  EXPECT_EQ(picture.status, 0) << picture.err;
  EXPECT_GT(std::filesystem::file_size(folder / "gap.png"), 10000u);
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"plan"}, {"verify", "--points", "/dev/null", "--pose", "0,0,0,0,0,0"}}) {
    std::vector<std::string> arguments{bin("zeropose")};
    arguments.insert(arguments.end(), verb.begin(), verb.end());
    arguments.insert(arguments.end(), {"--cell", file_of("pane-gaps"), "--json"});
    const Finished answered = run_program(arguments);
    EXPECT_EQ(answered.status, 1) << answered.out << answered.err;
    EXPECT_THAT(answered.out, HasSubstr("evens gaps"));
  }
}

// A second robot of the cell asks for the same job.
TEST_F(PaneGaps, AnswersTheRobotAloneThatCarriesThePane) {
  Json cell = Json::parse(text_of_file(file_of("pane-gaps")), nullptr, true, true);
  Json robot = cell["robots"][0];
  robot["name"] = "robot2";
  robot["link"]["unit"] = 2;
  robot["frame"] = "world_shift";
  cell["robots"].push_back(robot);
  std::ofstream(folder / "two.json") << cell;
  std::filesystem::copy_file(ZEROPOSE_SOURCE_DIR "/config/cells/pane-gaps.calibration.json",
                             folder / "pane-gaps.calibration.json");
  ASSERT_NO_FATAL_FAILURE(start({"--control", (folder / "cell.sock").string()}, folder / "two.json"));
  shift({1, -0.5, 0, 0, 0, 0.2});
  SimulatedRobotOptions options;
  options.port = 1506;
  options.convention = Convention::abb;
  options.patience = 3s;
  SimulatedRobot carries(options);
  const RobotAnswer answer = carries.measure(1, 41);
  ASSERT_TRUE(answer.ok()) << answer.refusal << logs();
  EXPECT_NEAR(answer.correction.value().translation().x(), 1, 0.05);
  EXPECT_EQ(answer.block.effective_marks, 6);
  EXPECT_TRUE(carries.acknowledge().ok());
  EXPECT_EQ(carries.zero(1).code, static_cast<std::uint16_t>(Code::no_procedure));
  options.unit = 2;
  options.frame = 2;
  options.robot_index = 2;
  SimulatedRobot other(options);
  EXPECT_EQ(other.measure(1, 42).code, static_cast<std::uint16_t>(Code::wrong_position)) << logs();
}

}  // namespace
}  // namespace zeropose
