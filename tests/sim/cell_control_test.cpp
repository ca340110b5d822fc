// What may be asked of the simulated cell, and what it says to nonsense.
#include "sim/cell_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/sim/example_cells.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

class CellControl : public testing::Test {
 protected:
  Json ask(const Json& question) { return Json::parse(answer_cell_control(cell, question.dump())); }
  Json fault(const std::string& kind, const Json& more = Json::object()) {
    Json question{{"cmd", "fault"}, {"kind", kind}};
    question.update(more);
    return ask(question);
  }

  SimulatedCell cell{load_cell(test::cells + "car-body.json"), {test::flat_car_body()}};
};

TEST_F(CellControl, ShiftMovesTheObject) {
  EXPECT_EQ(ask({{"cmd", "shift"}, {"pose", {10, -20, 5, 0.1, 0, -0.1}}})["status"], "ok");
  const Json truth = ask({{"cmd", "truth"}});
  const std::vector<double> expected = {10, -20, 5, 0.1, 0, -0.1};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(truth["X_O0O"][i].get<double>(), expected[i], 1e-9);
  EXPECT_LT(difference(cell.pose(), cell.scene().X_WO_nominal * from_six_numbers({10, -20, 5, 0.1, 0, -0.1}))
                .norm(),
            1e-9);
}

TEST_F(CellControl, FaultsComeAndGo) {
  EXPECT_EQ(fault("cover-mark", {{"mark", "camera1/1"}})["status"], "ok");
  EXPECT_EQ(fault("wrong-mark", {{"mark", "camera2/2"}, {"px", 12}})["status"], "ok");
  EXPECT_EQ(fault("camera-dead", {{"camera", "camera3"}})["status"], "ok");
  Json truth = ask({{"cmd", "truth"}});
  EXPECT_EQ(truth["covered"], Json::array({"camera1/1"}));
  EXPECT_EQ(truth["displaced_px"], Json({{"camera2/2", 12}}));
  EXPECT_EQ(truth["cameras"]["camera3"], "dead");
  EXPECT_EQ(truth["cameras"]["camera1"], "running");
  EXPECT_EQ(fault("clear")["status"], "ok");
  truth = ask({{"cmd", "truth"}});
  EXPECT_TRUE(truth["covered"].empty() && truth["displaced_px"].empty());
  EXPECT_EQ(truth["cameras"]["camera3"], "running");
}

TEST_F(CellControl, ShortFormOfTheCommandLine) {
  set_fault(cell, "cover-mark:camera1/2");
  EXPECT_TRUE(cell.faults().covered.contains("camera1/2"));
  set_fault(cell, "clear");
  EXPECT_TRUE(cell.faults().covered.empty());
  EXPECT_THROW(set_fault(cell, "cover-mark"), std::invalid_argument);
  EXPECT_THROW(set_fault(cell, "thunder:camera1"), std::invalid_argument);
}

TEST_F(CellControl, NonsenseIsNamedAndChangesNothing) {
  const Json before = ask({{"cmd", "truth"}});
  for (const auto& [line, reason] : std::vector<std::pair<std::string, std::string>>{
           {"", "parse error"},
           {"{\"cmd\":", "parse error"},
           {"\xff\xfe", "parse error"},
           {"[1, 2]", "not a JSON object"},
           {"{}", "'cmd' is missing"},
           {R"({"cmd": 5})", "'cmd' is missing or no text"},
           {R"({"cmd": "jump"})", "no command 'jump'; there are: shift, hand, truth, fault"},
           {R"({"cmd": "shift"})", "'pose' must be"},
           {R"({"cmd": "shift", "pose": [1, 2, 3]})", "'pose' must be"},
           {R"({"cmd": "shift", "pose": [1, 2, 3, 4, 5, "6"]})", "no number"},
           {R"({"cmd": "fault"})", "'kind' is missing"},
           {R"({"cmd": "fault", "kind": "rust"})", "no fault 'rust'; there are: camera-back"},
           {R"({"cmd": "fault", "kind": "camera-dead", "camera": "camera9"})", "camera9"},
           {R"({"cmd": "fault", "kind": "cover-mark", "mark": "nowhere"})", "nowhere"},
           {R"({"cmd": "fault", "kind": "wrong-mark", "mark": "camera1/1", "px": "far"})",
            "'px' is no number"}}) {
    const Json answer = Json::parse(answer_cell_control(cell, line));
    EXPECT_EQ(answer["status"], "failed") << line;
    EXPECT_THAT(answer["reason"].get<std::string>(), HasSubstr(reason)) << line;
  }
  EXPECT_EQ(ask({{"cmd", "truth"}}), before);
}

TEST(PoseFromText, SixNumbers) {
  const Pose wanted = from_six_numbers({1, 2, 3, 4, 5, 6});
  EXPECT_LT(difference(pose_from_text("1,2,3,4,5,6"), wanted).norm(), 1e-12);
  EXPECT_LT(difference(pose_from_text(" 1 2  3, 4 5 6 "), wanted).norm(), 1e-12);
  for (const char* wrong : {"", "1,2,3", "1,2,3,4,5,6,7", "1,2,3,4,5,x", "1,2,3,4,5,inf", "nan,2,3,4,5,6"})
    EXPECT_THROW(pose_from_text(wrong), std::invalid_argument) << wrong;
}

}  // namespace
}  // namespace zeropose
