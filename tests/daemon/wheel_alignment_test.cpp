// The wheel-alignment cell as a whole: six cameras on loopback, the daemon, the command line, and a robot
// that asks how every wheel stands.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "example_line.h"
#include "protocol/line_socket.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;
using testing::HasSubstr;

class WheelAlignmentLine : public ExampleLine {
 protected:
  void start(const std::vector<std::string>& options) {
    simulated = start_cell("wheel-alignment", options);
    daemon = start_daemon(file_of("wheel-alignment"));
    const Finished status = zeropose({"status", "--wait", "30"});
    ASSERT_EQ(status.out.find("MISSING"), std::string::npos) << status.out << logs();
    const Finished zero = zeropose({"zero"});
    ASSERT_EQ(zero.status, 0) << zero.out << zero.err << logs();
  }
  Json measure() const { return Json::parse(zeropose({"measure", "--json"}).out); }
  void ask_cell(const Json& question) const {
    const Json answer = Json::parse(ask(folder / "cell.sock", question.dump(), 20s));
    EXPECT_EQ(answer["status"], "ok") << answer;
  }

  std::unique_ptr<Process> simulated, daemon;
};

TEST_F(WheelAlignmentLine, EveryWheelIsMeasuredOrRefusedAsItStands) {
  // The fourth stands beyond a limit.
  ASSERT_NO_FATAL_FAILURE(start({"--drive", "--cars", "4"}));
  EXPECT_EQ(simulated->wait(120s), 0) << logs();
  EXPECT_THAT(text_of_file(folder / "cell.log"), HasSubstr("4 | beyond its limit and refused: code 501"));
}

TEST_F(WheelAlignmentLine, TheCommandLineShowsTheAnglesOrWhatIsMissing) {
  ASSERT_NO_FATAL_FAILURE(start({"--control", (folder / "cell.sock").string()}));
  ask_cell({{"cmd", "shift"}, {"pose", {1, -2, 0.5, -1.5, 0.75, 0}}});
  const Json good = measure();
  ASSERT_EQ(good["code"], 0) << good << logs();
  EXPECT_NEAR(good["wheel"]["camber_deg"].get<double>(), -1.5, 0.05);
  EXPECT_NEAR(good["wheel"]["toe_deg"].get<double>(), 0.75, 0.05);
  EXPECT_NEAR(good["wheel"]["profile_radius_mm"].get<double>(), 235.2, 0.5);
  EXPECT_LT(good["wheel"]["sigma_toe_deg"].get<double>(), 0.02);
  EXPECT_THAT(zeropose({"measure"}).out, HasSubstr("9 profile points in 6 cameras"));

  ask_cell({{"cmd", "fault"}, {"kind", "cover-mark"}, {"mark", "rear line 3"}});
  const Json missing = measure();
  EXPECT_EQ(missing["code"], 305) << missing;
  EXPECT_EQ(missing["wheel"]["lines"], "radial_missing");
  EXPECT_THAT(missing["reason"].get<std::string>(),
              HasSubstr("camera camera3: 2 of 3 radial lines are found: the right one"));
  EXPECT_FALSE(missing["wheel"].contains("camber_deg"));
  const std::filesystem::path picture = folder / "rear.png";
  EXPECT_EQ(zeropose({"snapshot", "--camera", "camera3", "--out", picture.string()}).status, 0);
  EXPECT_GT(std::filesystem::file_size(picture), 10000u);

  // A camera that was knocked.
  ask_cell({{"cmd", "fault"}, {"kind", "clear"}});
  ask_cell(
      {{"cmd", "fault"}, {"kind", "camera-moved"}, {"camera", "camera5"}, {"pose", {0.5, 0, 0, 0, 0, 0}}});
  const Json moved = measure();
  EXPECT_EQ(moved["code"], 601) << moved;
  EXPECT_THAT(moved["reason"].get<std::string>(), HasSubstr("camera5"));

  const std::string cell = file_of("wheel-alignment");
  EXPECT_THAT(run_program({bin("zeropose"), "plan", "--cell", cell}).err,
              HasSubstr("job 205/55 R16 measures a wheel: it has no marks to plan with"));
  EXPECT_THAT(run_program({bin("zeropose"), "verify", "--cell", cell, "--points", cell, "--state",
                           (folder / "state").string()})
                  .err,
              HasSubstr("measures a wheel: it has no points of an object to verify"));
}

}  // namespace
}  // namespace zeropose
