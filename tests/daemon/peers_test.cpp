// Modbus clients by others against the whole daemon. They make their own request ids, of which the recorder
// knows nothing: so this is no test of the fixture Line.
#include <gtest/gtest.h>

#include "tests/support/walking_line.h"

namespace zeropose {
namespace {

constexpr int skipped = 77;  // the peer is not installed

std::string peer(const std::string& name) {
  return std::string(ZEROPOSE_SOURCE_DIR) + "/tests/integration/peers/" + name + ".py";
}

class Peers : public testing::Test {
 protected:
  void SetUp() override {
    line.start_cell();
    line.start_daemon();
    line.take_zero();
  }

  void run(const std::vector<std::string>& command) {
    const Finished finished = run_program(command, std::chrono::seconds(120));
    if (finished.status == skipped) GTEST_SKIP() << finished.out;
    EXPECT_EQ(finished.status, 0) << finished.out << finished.err << line.daemon_log();
  }

  WalkingLine line;
};

// As a KUKA takes it: lengths in um, then the angles about z, y, x in 0.0001 degrees.
std::vector<std::string> on_the_wire(const Pose& D_R) {
  const SixNumbers s = to_six_numbers(D_R);
  std::vector<std::string> values;
  for (const double length_mm : {s.x_mm, s.y_mm, s.z_mm})
    values.push_back(std::to_string(std::lround(length_mm * 1000)));
  for (const double angle_deg : {s.rz_deg, s.ry_deg, s.rx_deg})
    values.push_back(std::to_string(std::lround(angle_deg * 10000)));
  return values;
}

TEST_F(Peers, PymodbusUnpacksTheTrueShift) {
  const Pose X_WO = from_six_numbers({12, -7, 4, 0.15, -0.1, 0.12});
  line.shift(X_WO);
  std::vector<std::string> command = {PEER_PYTHON, peer("modbus_peer"), "--correction"};
  for (const std::string& value : on_the_wire(line.correction_of(X_WO))) command.push_back(value);
  command.insert(command.end(), {"--within", std::to_string(std::lround(line.correction_error_mm() * 1000)),
                                 std::to_string(std::lround(2 * line_error_deg * 10000))});
  run(command);
}

TEST_F(Peers, MbpollReadsTheBlock) { run({PEER_PYTHON, peer("mbpoll_peer")}); }

}  // namespace
}  // namespace zeropose
