// The node without a bus: frames and the time in, frames out, with a real handshake behind it.
#include <gtest/gtest.h>

#include "protocol/can_node.h"
#include "tests/protocol/can_fixture.h"

namespace zeropose {
namespace {

constexpr std::uint32_t not_ok_and_error = can_status::not_ok | can_status::error;

TEST_F(CanNodeTest, BootsUpAndShowsThatThereIsNoAnswer) {
  EXPECT_EQ(all_sent[0].id, 0x705u);
  EXPECT_EQ(all_sent[0].data[0], 0);
  EXPECT_EQ(ids_sent(), (std::vector<std::uint32_t>{0x705, 0x185, 0x285, 0x385, 0x705}));
  EXPECT_EQ(all_sent.back().data[0], 5);
}

TEST_F(CanNodeTest, CleanCycle) { expect_clean_cycle(0x1234); }

TEST_F(CanNodeTest, BusyThenResultThenWithdrawn) {
  measure(7);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::busy, 0}));
  report(7, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::valid, 0}));
  send_command(CommandKind::acknowledge, 7);
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, NotOkIsTellingItsCodeAndAnEmergency) {
  measure(7);
  report(7, Code::too_few_marks);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::not_ok, 301}));
  EXPECT_EQ(last_emergency(), (Emergency{0xFF01, 0, 301, 7, 0}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, OutOfRangeIsACode) {
  measure(7);
  correction_x_mm = 327.68;
  report(7, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::not_ok, 507}));
  EXPECT_EQ(last_emergency(), (Emergency{0xFF01, 0, 507, 7, 0}));
  correction_x_mm = 327.67;
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, AResultIsWithdrawnAtTheEndOfItsValidity) {
  measure(7);
  report(7, Code::ok);
  wait(1999);
  EXPECT_EQ(last_commit().status, can_status::valid);
  wait(1);
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, TimeOutAtTheDeadline) {
  measure(7);
  wait(500);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::not_ok, 205}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, ARefusedCommandIsAnEmergencyAndDisturbsNothing) {
  measure(7);
  const auto before = handshake->block(now);
  measure(8);
  EXPECT_EQ(last_emergency(), (Emergency{0xFF03, 0, 0, 8, 1}));
  send_command(CommandKind::acknowledge, 7);
  EXPECT_EQ(last_emergency(), (Emergency{0xFF03, 0, 0, 7, 1}));
  EXPECT_EQ(handshake->block(now), before);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::busy, 0}));
  report(7, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::valid, 0}));
  measure(7);  // the last one again
  EXPECT_EQ(last_emergency(), (Emergency{0xFF03, 0, 0, 7, 2}));
  measure(0);
  EXPECT_EQ(last_emergency(), (Emergency{0xFF03, 0, 0, 0, 2}));
  send_command(CommandKind::acknowledge, 6);
  EXPECT_EQ(last_emergency(), (Emergency{0xFF03, 0, 0, 6, 3}));
  EXPECT_EQ(last_commit(), (Commit{7, can_status::valid, 0}));
  EXPECT_EQ(node->counters().refused, 5u);
  EXPECT_EQ(node->counters().commands, 1u);
}

TEST_F(CanNodeTest, ZeroNeedsItsGuard) {
  CanFrame frame = encode_can_command({7, K(CommandKind::zero), 1, 0, zero_guard}, 5);
  --frame.data[4];
  take(frame);
  EXPECT_EQ(last_commit(), (Commit{7, can_status::not_ok, 104}));
  frame = encode_can_command({8, K(CommandKind::zero), 1, 0, zero_guard}, 5);
  take(frame);
  report(8, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{8, 0, 0}));
  expect_clean_cycle(9);
}

TEST_F(CanNodeTest, StateErrorIsInTheErrorRegister) {
  measure(7);
  report(7, Code::internal);
  EXPECT_EQ(last_commit(), (Commit{7, not_ok_and_error, 901}));
  EXPECT_EQ(last_emergency(), (Emergency{0xFF02, 0x81, 901, 7, 0}));
  send_command(CommandKind::acknowledge, 7);
  EXPECT_EQ(last_emergency(), (Emergency{0, 0, 0, 0, 0}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, NmtStopsAndStarts) {
  measure(7);
  report(7, Code::ok);
  const std::uint32_t epoch = handshake->block(now).epoch;
  send_nmt(0x02);
  EXPECT_NE(handshake->block(now).epoch, epoch) << "the owner has lost its link";
  EXPECT_FALSE(handshake->block(now).has(status_bit::result_valid));
  std::size_t sent_before = all_sent.size();
  measure(8);
  send_sdo_read(0x1000, 0);
  EXPECT_EQ(all_sent.size(), sent_before);
  EXPECT_EQ(node->counters().not_operational, 2u);
  wait(500);
  EXPECT_EQ(all_sent.back().id, 0x705u);
  EXPECT_EQ(all_sent.back().data[0], 4);
  send_nmt(0x80);
  EXPECT_EQ(read_by_sdo(0x1000, 0), 0u);
  measure(8);
  EXPECT_EQ(node->counters().commands, 1u);
  send_nmt(0x01);
  expect_clean_cycle(9);
}

TEST_F(CanNodeTest, NmtToOthersOrOfWrongFormIsIgnored) {
  const auto before = handshake->block(now);
  send_nmt(0x02, 6);
  CanFrame frame;
  frame.size = 3;
  frame.data = {0x02, 5};
  take(frame);
  send_nmt(0x33);
  EXPECT_EQ(node->nmt_state(), NmtState::operational);
  EXPECT_EQ(handshake->block(now), before);
  send_nmt(0x02, 0);
  EXPECT_EQ(node->nmt_state(), NmtState::stopped);
  send_nmt(0x01, 5);
  expect_clean_cycle(7);
}

TEST_F(CanNodeTest, NmtResetIsANewSession) {
  measure(7);
  report(7, Code::ok);
  const std::uint32_t epoch = handshake->block(now).epoch;
  const std::size_t sent_before = all_sent.size();
  send_nmt(0x81);
  EXPECT_NE(handshake->block(now).epoch, epoch);
  EXPECT_EQ(all_sent[sent_before].id, 0x705u);
  EXPECT_EQ(all_sent[sent_before].data[0], 0);
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, WaitsForTheMasterWhereItIsToldTo) {
  options.start_at_once = false;
  start();
  EXPECT_EQ(ids_sent(), (std::vector<std::uint32_t>{0x705, 0x705}));
  EXPECT_EQ(all_sent.back().data[0], 127);
  send_nmt(0x01);
  expect_clean_cycle(7);
}

TEST_F(CanNodeTest, HeartbeatTimeIsTheRobotsChoice) {
  const auto heartbeats_in = [&](int ms) {
    const std::size_t before = all_sent.size();
    for (int i = 0; i < ms; ++i) wait(1);
    return std::count_if(all_sent.begin() + static_cast<std::ptrdiff_t>(before), all_sent.end(),
                         [](const CanFrame& frame) { return frame.id == 0x705; });
  };
  EXPECT_EQ(heartbeats_in(5000), 10);
  write_heartbeat(100);
  EXPECT_EQ(heartbeats_in(5000), 50);
  write_heartbeat(0);
  EXPECT_EQ(heartbeats_in(5000), 0);
  write_heartbeat(1000);
  EXPECT_EQ(heartbeats_in(5000), 5);
  EXPECT_EQ(read_by_sdo(0x1017, 0), 1000u);
}

TEST_F(CanNodeTest, FdSendsOneFrame) {
  options.fd = true;
  start();
  EXPECT_EQ(ids_sent(), (std::vector<std::uint32_t>{0x705, 0x485, 0x705}));
  measure(7);
  correction_x_mm = 1234.567;  // more than an int16 has
  report(7, Code::ok);
  const auto result = decode_can_fd_result(of_id(0x485), coding());
  ASSERT_TRUE(result);
  EXPECT_EQ(result->request_id, 7u);
  EXPECT_EQ(result->epoch, handshake->block(now).epoch);
  EXPECT_EQ(result->values[0], 1234567);
  EXPECT_TRUE(result->status & status_bit::result_valid);
  send_command(CommandKind::acknowledge, 7);
  EXPECT_EQ(decode_can_fd_result(of_id(0x485), coding())->values[0], invalid_value);
}

TEST_F(CanNodeTest, FdTakesCommandsInFdFramesToo) {
  options.fd = true;
  start();
  CanFrame frame = encode_can_command({7, 1, 1, 0, 0}, 5);
  frame.fd = true;
  take(frame);
  EXPECT_EQ(node->counters().commands, 1u);
}

// Replays of the bus's own traffic, and 100 000 random frames: none may do anything.
// A robot that takes its results by the rules, on a bus where anything fails at any moment: it never gets a
// wrong one, and a cycle without a fault always ends valid.
TEST(CanOptionsCheck, SaysWhatIsOutOfRange) {
  const auto message = [](auto change, Convention convention = Convention::kuka) {
    CanOptions options;
    change(options);
    try {
      CanNode node(options, convention);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([](CanOptions&) {}), "");
  EXPECT_EQ(message([](CanOptions& o) { o.node = 0; }), "CAN can0: the node must be 1..127");
  EXPECT_EQ(message([](CanOptions& o) { o.node = 127; }), "");
  EXPECT_EQ(message([](CanOptions& o) { o.node = 128; }), "CAN can0: the node must be 1..127");
  EXPECT_NE(message([](CanOptions& o) { o.interface = ""; }), "");
  EXPECT_NE(message([](CanOptions& o) { o.interface = "sixteen-letters-"; }), "");
  EXPECT_NE(message([](CanOptions& o) { o.length_scale_um = 0.5; }), "");
  EXPECT_NE(message([](CanOptions& o) { o.length_scale_um = std::nan(""); }), "");
  EXPECT_NE(message([](CanOptions& o) { o.angle_scale_deg = 2; }), "");
  EXPECT_NE(message([](CanOptions& o) { o.rotation_vector_scale_rad = 0; }), "");
  EXPECT_NE(message([](CanOptions& o) { o.heartbeat = std::chrono::milliseconds(65536); }), "");
  EXPECT_NE(message([](CanOptions&) {}, Convention::abb).find("convention abb"), std::string::npos);
  EXPECT_NE(message([](CanOptions&) {}, Convention::matrix), "");
  EXPECT_EQ(message([](CanOptions&) {}, Convention::universal_robots), "");
}

TEST(CanOptionsCheck, UniversalRobotsHasItsOwnScale) {
  EXPECT_EQ(can_coding({}, Convention::universal_robots).angle_scale, 100);
  EXPECT_EQ(can_coding({}, Convention::kuka).angle_scale, 10);
  // A whole turn's rotation vector fits.
  const auto values =
      to_can_values({0, 0, 0, 3141593, 0, -3141593, 0, 0}, can_coding({}, Convention::universal_robots));
  ASSERT_TRUE(values);
  EXPECT_EQ((*values)[3], 31416);
}

}  // namespace
}  // namespace zeropose
