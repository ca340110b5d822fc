// The hand-camera cell as a whole: a robot carries the camera from position to position, tells each, and
// measures.
#include <gtest/gtest.h>

#include "config/cell.h"
#include "tests/support/walking_line.h"

namespace zeropose {
namespace {

const std::filesystem::path cell_file = ZEROPOSE_SOURCE_DIR "/config/cells/hand-camera.json";

LineRobot robot_of(const Cell& cell) {
  const RobotOptions& robot = cell.robots.front();
  return {std::get<ModbusTcpOptions>(robot.link).port, robot.convention, robot.X_WR,
          cell.jobs.front().X_WO_nominal};
}

class HandCamera : public testing::Test {
 protected:
  void SetUp() override {
    line.start_cell();
    line.start_daemon();
    line.wait_until_alive();
    for (int round = 0; round < 2; ++round) ASSERT_EQ(tour(0), 0) << line.daemon_log();
    ASSERT_TRUE(line.robot().zero(1).ok()) << line.daemon_log();
  }

  // The hand stands where it was taught, and the robot says so. Returns the code.
  std::uint16_t look(std::size_t position, std::uint32_t part) {
    const Pose& X_RH = cell.jobs[0].positions[position].X_RH;
    put_hand(X_RH);
    return told(position, part, X_RH);
  }
  void put_hand(const Pose& X_RH) {
    const SixNumbers s = to_six_numbers(X_RH);
    line.ask_cell({{"cmd", "hand"}, {"pose", {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg}}});
  }
  std::uint16_t told(std::size_t position, std::uint32_t part, const Pose& X_RH) {
    const RobotAnswer answer =
        line.robot().at_position(1, part, static_cast<std::int32_t>(position + 1), X_RH);
    EXPECT_EQ(answer.ok(), answer.code == 0) << answer.refusal;
    return answer.code;
  }
  std::uint16_t tour(std::uint32_t part) {
    for (std::size_t position = 0; position < positions; ++position)
      if (const std::uint16_t code = look(position, part); code != 0) return code;
    return 0;
  }
  std::uint16_t measured(std::uint32_t part) {
    const RobotAnswer answer = line.measure(part);
    if (answer.ok()) {
      EXPECT_TRUE(answer.correction);
      EXPECT_TRUE(line.acknowledge().ok());
    }
    return answer.code;
  }

  const Cell cell = load_cell(cell_file);
  const std::size_t positions = cell.jobs[0].positions.size();
  WalkingLine line{cell_file, robot_of(cell)};
};

constexpr auto code_of_missing = static_cast<std::uint16_t>(Code::position_missing);

// The recorder compares every valid correction with the truth.
TEST_F(HandCamera, MeasuresAPartThatItSawFromAllPositions) {
  line.shift(from_six_numbers({9, -7, 6, 0.2, -0.1, 0.25}));
  ASSERT_EQ(tour(41), 0);
  EXPECT_EQ(measured(41), 0) << line.daemon_log();
  EXPECT_EQ(measured(41), code_of_missing) << "every picture counts once";
  for (std::size_t position = 1; position < positions; ++position) ASSERT_EQ(look(position, 42), 0);
  EXPECT_EQ(measured(42), code_of_missing);
  ASSERT_EQ(look(0, 43), 0) << "a picture of another part";
  EXPECT_EQ(measured(42), code_of_missing);
  ASSERT_EQ(tour(44), 0);
  EXPECT_EQ(told(0, 44, cell.jobs[0].positions[1].X_RH), static_cast<std::uint16_t>(Code::wrong_position));
  EXPECT_EQ(measured(44), code_of_missing) << "a refused position leaves no picture of before behind";
  line.shift(from_six_numbers({-9, 3, -12, -0.2, 0.2, -0.1}));
  ASSERT_EQ(tour(45), 0);
  EXPECT_EQ(measured(45), 0) << line.daemon_log();
  EXPECT_EQ(line.recorder().violations(), std::vector<std::string>{});
}

// The hand stands 3 mm beside what the robot says: its marks contradict those of the other positions.
// Whatever comes of it, the recorder sees that it is not wrong.
TEST_F(HandCamera, AHandThatIsNotWhereTheRobotSaysDoesNoHarm) {
  for (std::size_t wrong = 0; wrong < positions; wrong += 3) {
    const auto part = static_cast<std::uint32_t>(51 + wrong);
    for (std::size_t position = 0; position < positions; ++position) {
      const Pose& X_RH = cell.jobs[0].positions[position].X_RH;
      Pose X_RH_true = X_RH;
      if (position == wrong) X_RH_true.translation() += Eigen::Vector3d(3, 0, 0);
      put_hand(X_RH_true);
      ASSERT_EQ(told(position, part, X_RH), 0);
    }
    const RobotAnswer answer = line.measure(part);
    if (answer.ok()) {
      EXPECT_LE(answer.block.effective_marks, 21);
      EXPECT_TRUE(line.acknowledge().ok());
    }
  }
  EXPECT_EQ(line.recorder().violations(), std::vector<std::string>{});
}

}  // namespace
}  // namespace zeropose
