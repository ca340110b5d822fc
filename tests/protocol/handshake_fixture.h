// A handshake with a ready cell, a clock in the test's hand, and what the robot may see.
#pragma once

#include <gtest/gtest.h>

#include "protocol/handshake.h"

namespace zeropose {

inline constexpr ConnectionId robot = 1, other = 2;
inline constexpr auto K = [](CommandKind kind) { return static_cast<std::uint16_t>(kind); };

inline CellState ready_cell() { return {true, true, true, false, 0x11111111, 0x22222222, 0x33333333}; }

inline Report ok_report(std::uint32_t id, double x_mm = 1.5) {
  Report report;
  report.request_id = id;
  report.code = Code::ok;
  report.correction.translation().x() = x_mm;
  report.effective_marks = 12;
  report.effective_cameras = 4;
  return report;
}

inline Report not_ok_report(std::uint32_t id, Code code) {
  Report report = ok_report(id);
  report.code = code;
  return report;
}

class HandshakeTest : public testing::Test {
 protected:
  using milliseconds = std::chrono::milliseconds;

  HandshakeTest() {
    options.convention = Convention::kuka;
    options.frame = 3;
    options.epoch = 100;
    options.robot = 7;
    options.robot_index = 8;
    handshake.emplace(options);
    handshake->set_cell_state(ready_cell(), now);
  }

  CommandOutcome command(CommandKind kind, std::uint32_t id, std::int32_t argument = 0,
                         ConnectionId from = robot) {
    return handshake->on_command({id, K(kind), 5, 6, argument}, from, now);
  }
  CommandOutcome measure(std::uint32_t id, ConnectionId from = robot) {
    return command(CommandKind::measure, id, 0, from);
  }
  void report(const Report& report) { handshake->on_report(report, now); }
  ResultBlock block() { return handshake->block(now); }
  void wait(int ms) { now += milliseconds(ms); }

  void expect_valid(std::uint32_t id) {
    const ResultBlock b = block();
    EXPECT_EQ(b.request_id, id);
    EXPECT_EQ(b.status, status_bit::ready | status_bit::exposure_done | status_bit::result_valid);
    EXPECT_EQ(b.code, 0);
    EXPECT_NE(b.values, no_values);
  }
  void expect_not_ok(std::uint32_t id, int code) {
    const ResultBlock b = block();
    EXPECT_EQ(b.request_id, id);
    EXPECT_EQ(b.code, code);
    EXPECT_TRUE(b.has(status_bit::not_ok));
    EXPECT_FALSE(b.has(status_bit::result_valid));
    EXPECT_FALSE(b.has(status_bit::busy));
    EXPECT_EQ(b.values, no_values);
  }
  void expect_withdrawn() {
    const ResultBlock b = block();
    EXPECT_EQ(b.request_id, 0u);
    EXPECT_FALSE(b.has(status_bit::result_valid));
    EXPECT_FALSE(b.has(status_bit::not_ok));
    EXPECT_EQ(b.values, no_values);
    EXPECT_EQ(b.age_ms, not_representable);
  }
  void expect_done(std::uint32_t id) {
    const ResultBlock b = block();
    EXPECT_EQ(b.request_id, id);
    EXPECT_EQ(b.code, 0);
    EXPECT_EQ(b.values, no_values);
    EXPECT_FALSE(b.has(status_bit::result_valid));
    EXPECT_FALSE(b.has(status_bit::not_ok));
    EXPECT_FALSE(b.has(status_bit::busy));
  }

  HandshakeOptions options;
  TimePoint now = TimePoint() + std::chrono::hours(1);
  std::optional<Handshake> handshake;
};

}  // namespace zeropose
