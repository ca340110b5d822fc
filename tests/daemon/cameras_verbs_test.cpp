// zeropose cameras, against the simulated cell's GigE Vision cameras in a private network.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/walking_line.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

class CamerasVerbs : public testing::Test {
 protected:
  void SetUp() override { line_.start_cell(); }

  // The exit status and the one JSON object.
  std::pair<int, Json> cameras(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {program_path("zeropose"), "cameras"});
    arguments.emplace_back("--json");
    const Finished finished = run_program(arguments, std::chrono::seconds(120));
    const Json json = Json::parse(finished.out, nullptr, false);
    EXPECT_TRUE(json.is_object()) << finished.out << finished.err;
    return {finished.status, json};
  }
  // Of a finding about a camera.
  static Json finding(const Json& answer, const std::string& camera, const std::string& what) {
    for (const Json& one : answer["findings"])
      if (one["camera"] == camera && one["what"].get<std::string>().starts_with(what)) return one;
    ADD_FAILURE() << "no finding " << what << " of " << camera << " in " << answer;
    return {};
  }

  WalkingLine line_;
  const std::string cell_ = ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json";
};

TEST_F(CamerasVerbs, ListFindsTheCellsCamerasAndWhichOneIsGone) {
  const auto [status, answer] = cameras({"list", "--cell", cell_});
  EXPECT_EQ(status, 0);
  EXPECT_EQ(answer["cameras"].size(), 4U);
  EXPECT_EQ(answer["cameras"][0]["cell"]["driver"], "gige");
  line_.fault("camera-dead", {{"camera", "camera3"}});
  const auto [less_status, less] = cameras({"list", "--cell", cell_});
  EXPECT_EQ(less_status, 1);
  EXPECT_EQ(less["cameras"].size(), 3U);
  EXPECT_THAT(less["reason"].get<std::string>(), HasSubstr("camera3"));
  for (const Json& camera : less["cell"]) EXPECT_EQ(camera["found"], camera["camera"] != "camera3");
}

TEST_F(CamerasVerbs, StreamSavesWhatAFolderReplays) {
  const TemporaryFolder folder;
  const auto [status, answer] = cameras(
      {"stream", "--cell", cell_, "--camera", "camera2", "--frames", "10", "--save", folder.path().string()});
  EXPECT_EQ(status, 0);
  EXPECT_EQ(answer["frames"]["answered"], 10);
  const auto [replay_status, replay] =
      cameras({"stream", "--folder", folder.path().string(), "--size", "768x572", "--frames", "10"});
  EXPECT_EQ(replay_status, 0);
  EXPECT_EQ(replay["frames"]["answered"], 10);
}

TEST_F(CamerasVerbs, TestPraisesHealthyCamerasAndNamesTheFault) {
  // Without the rate and the latency of a busy machine.
  const auto [status, answer] = cameras({"test", "--cell", cell_, "--seconds", "4", "--rate", "2"});
  for (const std::string camera : {"camera1", "camera2", "camera3", "camera4"}) {
    EXPECT_EQ(finding(answer, camera, "share of requests answered")["found"], 1);
    EXPECT_TRUE(finding(answer, camera, "noise")["good"]);
    EXPECT_NEAR(finding(answer, camera, "noise")["found"].get<double>(), 2, 0.4);  // as the cell draws it
    EXPECT_TRUE(finding(answer, camera, "saturated")["good"]);
    EXPECT_TRUE(finding(answer, camera, "dark")["good"]);
    EXPECT_TRUE(finding(answer, camera, "blur")["good"]);
  }
  EXPECT_EQ(status, answer["status"] == "ok" ? 0 : 1);
  line_.fault("camera-dead", {{"camera", "camera4"}});
  const auto [worse_status, worse] = cameras({"test", "--cell", cell_, "--seconds", "2", "--rate", "2",
                                              "--camera", "camera4", "--camera", "camera1"});
  EXPECT_EQ(worse_status, 1);
  EXPECT_EQ(finding(worse, "camera4", "share of requests answered")["found"], 0);
  EXPECT_THAT(finding(worse, "camera4", "share of requests answered")["remedy"].get<std::string>(),
              HasSubstr("127.0.0.14"));
  EXPECT_EQ(finding(worse, "camera1", "share of requests answered")["found"], 1);
}

TEST_F(CamerasVerbs, SnapshotOfACameraThatTheDaemonHoldsSaysSo) {
  const TemporaryFolder folder;
  const std::vector<std::string> snapshot = {
      "snapshot", "--cell", cell_, "--camera", "camera1", "--out", (folder / "camera1.png").string()};
  const auto [status, answer] = cameras(snapshot);
  EXPECT_EQ(status, 0) << answer;
  EXPECT_EQ(answer["width_px"], 768);
  EXPECT_TRUE(std::filesystem::exists(folder / "camera1.png"));
  line_.start_daemon();
  line_.wait_until_alive();
  const auto [held_status, held] = cameras(snapshot);
  EXPECT_EQ(held_status, 1);
  EXPECT_THAT(held["reason"].get<std::string>(), HasSubstr("zeropose snapshot"));
}

}  // namespace
}  // namespace zeropose
