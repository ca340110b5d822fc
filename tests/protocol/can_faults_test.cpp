// What must not count on a CAN bus, and what a node does when the bus fails.
#include <gtest/gtest.h>

#include <random>

#include "protocol/can_collector.h"
#include "protocol/can_node.h"
#include "tests/protocol/amount.h"
#include "tests/protocol/can_fixture.h"

namespace zeropose {
namespace {

constexpr std::uint32_t not_ok_and_error = can_status::not_ok | can_status::error;

TEST_F(CanNodeTest, WhatHasTheWrongFormIsCountedAndChangesNothing) {
  const auto before = handshake->block(now);
  const std::size_t sent_before = all_sent.size();
  CanFrame frame = encode_can_command({7, 1, 1, 0, 0}, 5);
  for (const std::uint8_t size : std::initializer_list<std::uint8_t>{0, 1, 7, 12, 64}) {
    CanFrame bad = frame;
    bad.size = size;
    bad.fd = size > 8;
    take(bad);
  }
  CanFrame fd = frame;
  fd.fd = true;  // eight bytes, but this is a classic bus
  take(fd);
  EXPECT_EQ(node->counters().wrong_size, 6u);
  frame.remote = true;
  take(frame);
  frame.remote = false;
  frame.extended = true;
  take(frame);
  EXPECT_EQ(node->counters().remote, 1u);
  EXPECT_EQ(node->counters().extended, 1u);
  frame.extended = false;
  frame.id = 0x206;
  take(frame);
  EXPECT_EQ(handshake->block(now), before);
  EXPECT_EQ(all_sent.size(), sent_before);
  EXPECT_EQ(node->counters().commands, 0u);
  expect_clean_cycle(7);
}

TEST_F(CanNodeTest, AForeignSenderLatchesAFault) {
  measure(7);
  report(7, Code::ok);
  const CanFrame replayed = of_id(0x185);
  take(replayed);
  EXPECT_EQ(node->fault(), CanFault::foreign_sender);
  EXPECT_EQ(last_commit(), (Commit{7, not_ok_and_error, 103}));
  EXPECT_TRUE(was_sent(Emergency{0x8150, 0x11, 103, 0, 1}));
  // Until somebody has looked, no correction leaves.
  send_command(CommandKind::acknowledge, 7);
  measure(8);
  report(8, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{8, not_ok_and_error, 103}));
  EXPECT_EQ(read_by_sdo(0x2002, 1), 0x80000000u);
  EXPECT_EQ(read_by_sdo(0x2004, 1), 1u);
  send_command(CommandKind::reset, 9);
  EXPECT_EQ(node->fault(), CanFault::none);
  EXPECT_EQ(last_commit(), (Commit{9, 0, 0}));
  EXPECT_EQ(last_emergency(), (Emergency{0, 0, 0, 0, 0}));
  expect_clean_cycle(10);
}

TEST_F(CanNodeTest, EachOfOurIdentifiersIsOurs) {
  for (const std::uint32_t base : {0x080u, 0x180u, 0x280u, 0x380u, 0x480u, 0x580u, 0x700u}) {
    CanFrame frame;
    frame.id = base + 5;
    CanFrame other = frame, asked = frame, extended = frame;
    other.id = base + 6;
    asked.remote = true;
    extended.extended = true;
    take(other);
    take(asked);
    take(extended);
    EXPECT_EQ(node->fault(), CanFault::none) << base;
    take(frame);
    EXPECT_EQ(node->fault(), CanFault::foreign_sender) << base;
    send_nmt(0x81);
    EXPECT_EQ(node->fault(), CanFault::none);
  }
  EXPECT_EQ(node->counters().foreign, 7u);
  expect_clean_cycle(7);
}

TEST_F(CanNodeTest, BusOffEndsTheConnectionAndReplaysNothing) {
  measure(7);
  const std::uint32_t epoch = handshake->block(now).epoch;
  bus_takes = false;
  report(7, Code::ok);  // its first frame is under way
  take(error_frame(0x40));
  EXPECT_EQ(node->fault(), CanFault::bus_off);
  EXPECT_NE(handshake->block(now).epoch, epoch);
  const std::size_t sent_before = all_sent.size();
  wait(100);
  bus_takes = true;
  take(error_frame(0x100));
  wait(1);
  for (std::size_t i = sent_before; i < all_sent.size(); ++i) {
    if (all_sent[i].id != 0x385 && all_sent[i].id != 0x185) continue;
    EXPECT_EQ(get_le(all_sent[i].data, 0, 2), 0u) << "an old result was sent";
  }
  EXPECT_EQ(last_commit(), (Commit{0, can_status::error, 0}));
  EXPECT_TRUE(was_sent(Emergency{0x8140, 0x11, 103, 0, 2}));
  measure(8);
  report(8, Code::ok);
  EXPECT_EQ(last_commit(), (Commit{8, not_ok_and_error, 103}));
  send_command(CommandKind::reset, 9);
  expect_clean_cycle(10);
}

TEST_F(CanNodeTest, AResultThatNobodyTakesIsMadeAnewWhenTheBusIsBack) {
  measure(7);
  bus_takes = false;
  report(7, Code::ok);
  const std::size_t sent_before = all_sent.size();
  wait(50);
  EXPECT_EQ(node->counters().unconfirmed, 1u);
  const auto confirmed = node->counters().results_confirmed;
  wait(3000);  // beyond its validity: it must not be seen any more
  for (std::size_t i = sent_before + 1; i < all_sent.size(); ++i) EXPECT_EQ(all_sent[i].id, 0x705u);
  bus_takes = true;
  wait(500);
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  EXPECT_EQ(node->counters().results_confirmed, confirmed + 1);
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, OneFrameIsUnderWayAtATime) {
  measure(7);
  bus_takes = false;
  const std::size_t sent_before = all_sent.size();
  report(7, Code::ok);
  ASSERT_EQ(all_sent.size(), sent_before + 1);
  EXPECT_EQ(all_sent.back().id, 0x185u);
  node->take(all_sent.back(), true, now);
  step();
  ASSERT_EQ(all_sent.size(), sent_before + 2);
  EXPECT_EQ(all_sent.back().id, 0x285u);
  EXPECT_EQ(node->counters().foreign, 0u);
}

TEST_F(CanNodeTest, TheNewestAnswerOvertakesTheOnesThatWait) {
  measure(7);
  bus_takes = false;
  report(7, Code::ok);
  send_command(CommandKind::acknowledge, 7);
  bus_takes = true;
  const std::size_t sent_before = all_sent.size();
  node->take(all_sent.back(), true, now);
  step();
  for (std::size_t i = sent_before; i < all_sent.size(); ++i)
    EXPECT_EQ(get_le(all_sent[i].data, 0, 2), 0u) << i;
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
}

TEST_F(CanNodeTest, InterfaceDownWithdraws) {
  measure(7);
  report(7, Code::ok);
  node->link_down();
  handshake->on_disconnect(connection, now);
  step();
  const std::size_t sent_before = all_sent.size();
  wait(1000);
  EXPECT_EQ(all_sent.size(), sent_before);
  node->link_up(now);
  step();
  EXPECT_EQ(last_commit(), (Commit{0, 0, 0}));
  EXPECT_EQ(node->fault(), CanFault::none);
  expect_clean_cycle(8);
}

TEST_F(CanNodeTest, RandomFramesChangeNothing) {
  std::mt19937 random(20);
  const auto before = handshake->block(now);
  const auto refused_before = node->counters().commands;
  for (std::size_t i = 0; i < amount(100000); ++i) {
    CanFrame frame = random_frame(random);
    // A plain frame of eight bytes on RPDO1 is a command, and NMT is meant for everybody: made harmless here.
    if (frame.id == 0x205 && frame.size == 8 && !frame.extended && !frame.remote && !frame.fd) frame.size = 7;
    if (frame.id == 0x000 && frame.size == 2 && !frame.extended && !frame.remote) frame.data[1] = 6;
    take(frame);
    // A foreign sender is a fault that hides results, not a change of the robot's state.
    ASSERT_EQ(handshake->block(now), before) << i;
    if (i % 1000 == 0) wait(1);
  }
  EXPECT_EQ(node->counters().commands, refused_before);
  EXPECT_GT(node->counters().foreign, 0u);
  EXPECT_EQ(node->fault(), CanFault::foreign_sender);
  send_command(CommandKind::reset, 6);
  expect_clean_cycle(7);
}

TEST_F(CanNodeTest, ReplayedTrafficIsNeverAResult) {
  CanResultCollector collector(coding());
  std::vector<CanFrame> recorded;
  for (std::uint16_t id = 1; id <= 50; ++id) {
    expect_clean_cycle(id);
    recorded = all_sent;
  }
  collector.expect(51, handshake->block(now).epoch);
  for (const CanFrame& frame : recorded) EXPECT_FALSE(collector.take(frame, now));
  for (const CanFrame& frame : recorded) take(frame);
  EXPECT_EQ(node->fault(), CanFault::foreign_sender);
  EXPECT_FALSE(handshake->block(now).has(status_bit::result_valid));
  send_command(CommandKind::reset, 60);
  expect_clean_cycle(61);
}

TEST_F(CanNodeTest, NoFaultMakesAResultWrong) {
  std::mt19937 random(80);
  std::size_t valid = 0;
  std::uint16_t id = 0;
  CanResultCollector collector(coding());
  for (std::size_t i = 0; i < amount(20000); ++i) {
    const std::uint32_t what = static_cast<std::uint32_t>(random()) % 10;  // 0..3: no fault
    id = static_cast<std::uint16_t>(id % 65000 + 1);
    correction_x_mm = 0.01 * static_cast<double>(1 + i % 30000);
    collector.expect(id, handshake_epoch());
    const std::size_t begin = all_sent.size();
    measure(id);
    disturb(what, id);
    report(id, Code::ok);
    bus_takes = true;
    if (what == 8) wait(600);
    step();
    std::optional<CanResult> result;
    for (std::size_t k = begin; k < all_sent.size(); ++k)
      if (const auto taken = collector.take(all_sent[k], now)) result = taken;
    const bool is_valid = result && result->has(can_status::valid);
    if (is_valid) {
      ++valid;
      ASSERT_EQ(result->request_id, id);
      ASSERT_EQ(result->values[0], std::lround(100 * correction_x_mm));
    }
    if (what < 4) {
      ASSERT_TRUE(is_valid) << i;
    } else if (what < 8) {
      ASSERT_FALSE(is_valid) << i << " fault " << what;
    }
    send_command(CommandKind::reset, ++id);
    ASSERT_EQ(node->fault(), CanFault::none);
    all_sent.clear();
  }
  EXPECT_GT(valid, amount(20000) / 3);
}
}  // namespace
}  // namespace zeropose
