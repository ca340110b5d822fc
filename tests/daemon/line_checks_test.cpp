// What the daemon remembers between requests, with cell files of their own: the last valid result, the
// position of a robot's axis, and which zero belongs to which files (spec 50 M6.6, M7; spec 85 R20).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "tests/support/walking_line.h"

namespace zeropose {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

// A copy of the example cell that may be changed while no daemon runs.
class CopiedCell {
 public:
  CopiedCell() {
    for (const char* name : {"car-body.json", "car-body.calibration.json", "car-body.sim.json"})
      std::filesystem::copy(std::filesystem::path(ZEROPOSE_SOURCE_DIR) / "config/cells" / name,
                            folder_ / name);
  }

  std::filesystem::path path() const { return folder_ / "car-body.json"; }
  void change(const char* name, const std::function<void(Json&)>& edit) const {
    Json json = Json::parse(std::ifstream(folder_ / name), nullptr, true, true);
    edit(json);
    std::ofstream(folder_ / name) << json.dump(1);
  }
  void change(const std::function<void(Json&)>& edit) const { change("car-body.json", edit); }

 private:
  TemporaryFolder folder_;
};

class LineChecks : public testing::Test {
 protected:
  void start(const std::function<void(Json&)>& edit) {
    cell.change(edit);
    line.start_cell();
    line.start_daemon();
    line.take_zero();
  }
  void stand_at(double x_mm) { line.shift(from_six_numbers({x_mm, 0, 0, 0, 0, 0})); }
  std::uint16_t code_at(double x_mm) {
    stand_at(x_mm);
    const RobotAnswer answer = line.robot().measure(1, 7);
    EXPECT_EQ(answer.ok(), answer.code == 0) << answer.refusal << line.daemon_log();
    EXPECT_TRUE(line.robot().acknowledge().ok());
    return answer.code;
  }
  Json daemon_says(const char* question) { return line.ask_daemon({{"cmd", question}}); }

  const CopiedCell cell;
  WalkingLine line{cell.path()};
};

constexpr std::uint16_t step_code = static_cast<std::uint16_t>(Code::step_too_large);

TEST_F(LineChecks, StepIsComparedWithTheLastValidResultUntilReset) {
  start([](Json& json) { json["jobs"][0]["requirements"]["max_step_mm"] = 20; });
  EXPECT_EQ(code_at(-30), 0);  // the first one is compared with nothing
  EXPECT_EQ(code_at(-15), 0);
  EXPECT_EQ(code_at(15), step_code);
  EXPECT_EQ(code_at(15), step_code);  // what was refused is no last result, and Acknowledge forgets nothing
  EXPECT_EQ(code_at(0), 0);
  EXPECT_EQ(code_at(15), 0);
  EXPECT_EQ(code_at(-15), step_code);
  const Json asked = daemon_says("measure");
  EXPECT_EQ(asked["code"], step_code);  // the command line sees what a robot would
  EXPECT_THAT(asked["reason"].get<std::string>(), HasSubstr("from where the last valid result put it"));
  EXPECT_TRUE(line.robot().reset().ok());
  EXPECT_EQ(code_at(-15), 0);
  stand_at(0);
  EXPECT_EQ(line.zeropose({"zero"}).status, 0);
  EXPECT_EQ(code_at(30), 0);  // the new zero has no last result
}

TEST_F(LineChecks, DisplacementHasItsCodeAndNamesThePoint) {
  start([](Json& json) { json["jobs"][0]["requirements"]["max_displacement_mm"] = 25; });
  EXPECT_EQ(code_at(24), 0);
  EXPECT_EQ(code_at(26), static_cast<std::uint16_t>(Code::limit_displacement));
  EXPECT_THAT(daemon_says("measure")["reason"].get<std::string>(), HasSubstr("is displaced by 2"));
}

TEST_F(LineChecks, AxisOfTheRobotMovesItsBase) {
  start([](Json& json) { json["robots"][0]["axis"] = {{"direction", {0, 1, 0}}, {"zero_mm", 500}}; });
  const Pose X_WO = from_six_numbers({5, -8, 3, 0.1, -0.1, 0.2});
  line.shift(X_WO);
  for (const std::int32_t position_um : {500'000, -1'250'000}) {
    const RobotAnswer answer = line.robot().measure(1, 7, position_um);
    ASSERT_TRUE(answer.ok()) << answer.refusal << line.daemon_log();
    const Pose X_WR = from_six_numbers({1200, -2400 + (1e-3 * position_um - 500), -150, 0, 0, 90});
    const Vector6 error = difference(X_WR.inverse() * X_WO * X_WR, *answer.correction);
    EXPECT_LT(error.tail<3>().norm() * degrees_per_radian, 2 * line_error_deg);
    EXPECT_LT(error.head<3>().norm(),
              2 * line_error_mm + X_WR.translation().norm() * line_error_deg / degrees_per_radian);
    EXPECT_TRUE(line.robot().acknowledge().ok());
  }
}

TEST_F(LineChecks, ZeroOfOtherFilesIsOutdated) {
  start([](Json&) {});
  EXPECT_EQ(code_at(5), 0);
  const auto restarted = [&] {
    line.robot().disconnect();
    line.start_daemon();
    line.wait_until_alive();
    return daemon_says("status")["zero_state"];
  };
  EXPECT_EQ(line.stop_daemon(), 0);
  cell.change("car-body.calibration.json", [](Json& json) {
    json["camera1"]["X_WC"][0] = json["camera1"]["X_WC"][0].get<double>() + 0.5;
  });
  Json zero = restarted();
  EXPECT_EQ(zero["code"], static_cast<int>(Code::zero_outdated));
  EXPECT_THAT(zero["reason"].get<std::string>(), HasSubstr("was made with another calibration"));
  EXPECT_EQ(daemon_says("measure")["code"], static_cast<int>(Code::zero_outdated));
  EXPECT_EQ(line.robot().measure(1, 7).code, static_cast<std::uint16_t>(Code::zero_missing));
  EXPECT_EQ(line.stop_daemon(), 0);
  cell.change([](Json& json) { json["jobs"][0]["search_mm"] = 64; });
  zero = restarted();
  EXPECT_EQ(zero["code"], static_cast<int>(Code::zero_outdated));
  EXPECT_THAT(zero["reason"].get<std::string>(), HasSubstr("another cell file and another calibration"));
  EXPECT_EQ(line.stop_daemon(), 0);
  std::ofstream(line.state() / "zero-body.json") << "{";
  zero = restarted();
  EXPECT_EQ(zero["code"], static_cast<int>(Code::storage_failed));
  EXPECT_THAT(zero["reason"].get<std::string>(), HasSubstr("zero-body.json"));
}

}  // namespace
}  // namespace zeropose
