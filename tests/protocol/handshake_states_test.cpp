// When a result is withdrawn, and the states of the cell around it.
#include "tests/protocol/handshake_fixture.h"

namespace zeropose {
namespace {

TEST_F(HandshakeTest, NewCommandWithdraws) {
  measure(1);
  report(ok_report(1));
  measure(2);
  EXPECT_EQ(block().request_id, 2u);
  EXPECT_EQ(block().values, no_values);
  EXPECT_FALSE(block().has(status_bit::result_valid));
}

TEST_F(HandshakeTest, EveryOtherCommandWithdrawsExceptHeartbeat) {
  std::uint32_t id = 0;
  for (const auto kind : {CommandKind::zero, CommandKind::select_job, CommandKind::reset,
                          CommandKind::at_position, CommandKind::resume, CommandKind::halt}) {
    measure(++id);
    report(ok_report(id));
    EXPECT_EQ(command(CommandKind::heartbeat, 1000).verdict, CommandVerdict::accepted);
    expect_valid(id);
    command(kind, ++id);
    EXPECT_FALSE(block().has(status_bit::result_valid));
    EXPECT_EQ(block().request_id, id);
    report(ok_report(id));
  }
}

TEST_F(HandshakeTest, HeartbeatIsNoCommandThatCouldHideADuplicate) {
  measure(1);
  report(ok_report(1));
  EXPECT_EQ(command(CommandKind::heartbeat, 0).verdict, CommandVerdict::wrong_request_id);
  EXPECT_EQ(command(CommandKind::heartbeat, 2, 1).verdict, CommandVerdict::wrong_argument);
  command(CommandKind::heartbeat, 2, 0, other);
  EXPECT_EQ(handshake->owner(), robot);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::wrong_request_id);
  EXPECT_EQ(handshake->counters().heartbeats, 1u);
}

TEST_F(HandshakeTest, AcknowledgeNeedsOwnerAndId) {
  measure(5);
  report(ok_report(5));
  EXPECT_EQ(command(CommandKind::acknowledge, 4).verdict, CommandVerdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 0).verdict, CommandVerdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 5, 0, other).verdict, CommandVerdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 5, 1).verdict, CommandVerdict::wrong_argument);
  expect_valid(5);
  EXPECT_EQ(command(CommandKind::acknowledge, 5).verdict, CommandVerdict::accepted);
  expect_withdrawn();
}

TEST_F(HandshakeTest, OwnerLostWithdrawsAndStartsANewSession) {
  measure(1);
  report(ok_report(1));
  handshake->on_disconnect(other, now);
  expect_valid(1);
  EXPECT_EQ(block().epoch, 100u);
  handshake->on_disconnect(robot, now);
  expect_withdrawn();
  EXPECT_EQ(block().epoch, 101u);
  EXPECT_EQ(measure(1, other).verdict, CommandVerdict::wrong_request_id);
}

TEST_F(HandshakeTest, OwnerLostWhileBusy) {
  measure(1);
  handshake->on_disconnect(robot, now);
  EXPECT_EQ(block().status, status_bit::busy);  // the cycle is still at work
  EXPECT_EQ(block().request_id, 0u);
  EXPECT_EQ(measure(2, other).verdict, CommandVerdict::busy);
  report(ok_report(1));
  expect_withdrawn();
  EXPECT_EQ(handshake->counters().orphaned_reports, 1u);
  EXPECT_EQ(measure(2, other).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, OwnerLostAndNoReport) {
  measure(1);
  handshake->on_disconnect(robot, now);
  wait(500);
  expect_withdrawn();
  EXPECT_EQ(measure(2, other).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, EpochIsNeverZero) {
  options.epoch = 0xFFFFFFFF;
  Handshake last(options);
  last.on_command({1, 1, 0, 0, 0}, robot, now);
  last.on_disconnect(robot, now);
  EXPECT_EQ(last.block(now).epoch, 1u);
}

TEST_F(HandshakeTest, MeasureWhenNotReadyGetsItsCode) {
  CellState cell = ready_cell();
  std::uint32_t id = 0;
  const auto code_with = [&](auto change) {
    cell = ready_cell();
    change(cell);
    handshake->set_cell_state(cell, now);
    const auto outcome = measure(++id);
    EXPECT_EQ(outcome.verdict, CommandVerdict::accepted);
    EXPECT_FALSE(outcome.request);
    EXPECT_TRUE(block().has(status_bit::not_ok));
    return block().code;
  };
  EXPECT_EQ(code_with([](CellState& c) { c.config_valid = false; }), 103);
  EXPECT_EQ(code_with([](CellState& c) { c.cameras_alive = false; }), 201);
  EXPECT_EQ(code_with([](CellState& c) { c.zero_valid = false; }), 701);
}

TEST_F(HandshakeTest, ResultIsWithdrawnWhenTheCellChanges) {
  const auto changes = {
      +[](CellState& c) { c.config_valid = false; }, +[](CellState& c) { c.cameras_alive = false; },
      +[](CellState& c) { c.zero_valid = false; },   +[](CellState& c) { c.camera_moved = true; },
      +[](CellState& c) { c.simulated = true; },     +[](CellState& c) { ++c.config_hash; },
      +[](CellState& c) { ++c.calibration_hash; },   +[](CellState& c) { ++c.zero_id; }};
  std::uint32_t id = 0;
  for (const auto change : changes) {
    handshake->set_cell_state(ready_cell(), now);
    measure(++id);
    report(ok_report(id));
    handshake->set_cell_state(ready_cell(), now);
    expect_valid(id);
    CellState cell = ready_cell();
    change(cell);
    handshake->set_cell_state(cell, now);
    expect_withdrawn();
  }
}

TEST_F(HandshakeTest, ResultOfAnotherCellIsNotPublished) {
  struct Change {
    void (*change)(CellState&);
    int code;
  };
  const Change changes[] = {{[](CellState& c) { c.config_valid = false; }, 103},
                            {[](CellState& c) { c.cameras_alive = false; }, 201},
                            {[](CellState& c) { c.zero_valid = false; }, 701},
                            {[](CellState& c) { c.camera_moved = true; }, 601},
                            {[](CellState& c) { ++c.zero_id; }, 702},
                            {[](CellState& c) { ++c.calibration_hash; }, 702}};
  std::uint32_t id = 0;
  for (const Change& entry : changes) {
    handshake->set_cell_state(ready_cell(), now);
    measure(++id);
    CellState cell = ready_cell();
    entry.change(cell);
    handshake->set_cell_state(cell, now);
    report(ok_report(id));
    expect_not_ok(id, entry.code);
  }
}

TEST_F(HandshakeTest, ZeroIsAnsweredWithoutACorrection) {
  CellState cell = ready_cell();
  cell.zero_valid = false;
  handshake->set_cell_state(cell, now);
  const auto outcome = command(CommandKind::zero, 1, zero_guard);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->kind, CommandKind::zero);
  cell.zero_valid = true;
  cell.zero_id = 77;
  handshake->set_cell_state(cell, now);
  report(ok_report(1));
  expect_done(1);
  EXPECT_EQ(block().zero_id, 77u);
  EXPECT_EQ(block().state, LinkState::ready);
  wait(60000);
  expect_done(1);  // nothing in it that could grow stale
  command(CommandKind::acknowledge, 1);
  expect_withdrawn();
}

TEST_F(HandshakeTest, ZeroIsGuarded) {
  command(CommandKind::zero, 1, 0);
  expect_not_ok(1, 104);
  CellState cell = ready_cell();
  cell.cameras_alive = false;
  handshake->set_cell_state(cell, now);
  command(CommandKind::zero, 2, zero_guard);
  expect_not_ok(2, 201);
  cell.config_valid = false;
  handshake->set_cell_state(cell, now);
  command(CommandKind::zero, 3, zero_guard);
  expect_not_ok(3, 103);
}

TEST_F(HandshakeTest, ZeroThatFailsIsNotOk) {
  command(CommandKind::zero, 1, zero_guard);
  report(not_ok_report(1, Code::storage_failed));
  expect_not_ok(1, 703);
  EXPECT_EQ(block().state, LinkState::ready);
}

TEST_F(HandshakeTest, SelectJobGoesToTheCycle) {
  CellState cell = ready_cell();
  cell.cameras_alive = cell.zero_valid = false;  // of the job selected so far
  handshake->set_cell_state(cell, now);
  const auto outcome = command(CommandKind::select_job, 1);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->job, 5);
  report(ok_report(1));
  expect_done(1);
  command(CommandKind::select_job, 2);
  report(not_ok_report(2, Code::unknown_job));
  expect_not_ok(2, 102);
  command(CommandKind::select_job, 3, 1);
  expect_not_ok(3, 106);
}

TEST_F(HandshakeTest, HaltAndResume) {
  command(CommandKind::halt, 1);
  expect_done(1);
  EXPECT_EQ(block().state, LinkState::halted);
  measure(2);
  expect_not_ok(2, 105);
  command(CommandKind::zero, 3, zero_guard);
  expect_not_ok(3, 105);
  command(CommandKind::reset, 4);
  EXPECT_EQ(block().state, LinkState::halted);
  command(CommandKind::resume, 5, 1);
  expect_not_ok(5, 106);
  EXPECT_EQ(block().state, LinkState::halted);
  command(CommandKind::resume, 6);
  EXPECT_EQ(block().state, LinkState::ready);
  EXPECT_EQ(measure(7).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, InternalErrorIsLatchedUntilAcknowledged) {
  measure(1);
  report(not_ok_report(1, Code::internal));
  expect_not_ok(1, 901);
  EXPECT_EQ(block().state, LinkState::error);
  EXPECT_TRUE(block().has(status_bit::error));
  measure(2);
  expect_not_ok(2, 103);
  EXPECT_EQ(block().state, LinkState::error);
  const auto outcome = command(CommandKind::acknowledge, 2);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->kind, CommandKind::reset);  // validate again
  EXPECT_EQ(block().state, LinkState::ready);
  EXPECT_FALSE(command(CommandKind::acknowledge, 2).request);
}

TEST_F(HandshakeTest, ResetClearsTheErrorFromAnotherSession) {
  measure(1);
  handshake->on_disconnect(robot, now);
  report(not_ok_report(1, Code::internal));
  EXPECT_EQ(block().state, LinkState::error);
  const auto outcome = command(CommandKind::reset, 2, 0, other);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->kind, CommandKind::reset);
  expect_done(2);
  EXPECT_EQ(block().state, LinkState::ready);
}

TEST_F(HandshakeTest, UnknownCommandsAreAnswered) {
  std::uint32_t id = 0;
  for (const int kind : {0, 10, 65535}) {
    EXPECT_FALSE(
        handshake->on_command({++id, static_cast<std::uint16_t>(kind), 0, 0, 0}, robot, now).request);
    expect_not_ok(id, 101);
  }
}

TEST_F(HandshakeTest, BadOptionsAreRefused) {
  const auto refused = [&](auto change) {
    HandshakeOptions bad = options;
    change(bad);
    EXPECT_THROW(Handshake{bad}, std::invalid_argument);
  };
  refused([](auto& o) { o.validity = milliseconds(0); });
  refused([](auto& o) { o.validity = milliseconds(65536); });
  refused([](auto& o) { o.measure_deadline = milliseconds(0); });
  refused([](auto& o) { o.zero_deadline = milliseconds(-1); });
  refused([](auto& o) { o.epoch = 0; });
  refused([](auto& o) { o.convention = Convention::matrix; });
}

class AtPositionTest : public HandshakeTest {
 protected:
  PositionBlock position(std::uint32_t index) const {
    return {index, *to_wire(Convention::kuka, from_six_numbers({700, -20, 900, 10, 20, 30}))};
  }
};

TEST_F(AtPositionTest, CarriesThePoseThatWasWrittenBefore) {
  EXPECT_EQ(handshake->on_position(position(4), robot, now), CommandVerdict::accepted);
  const auto outcome = command(CommandKind::at_position, 1, 4);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->kind, CommandKind::at_position);
  EXPECT_EQ(outcome.request->argument, 4);
  EXPECT_EQ(outcome.request->deadline, now + options.zero_deadline);
  EXPECT_LT((outcome.request->X_RH.translation() - Eigen::Vector3d(700, -20, 900)).norm(), 1e-9);
  EXPECT_TRUE(block().has(status_bit::busy));
  report(ok_report(1));
  expect_done(1);
  // Each position counts once.
  EXPECT_FALSE(command(CommandKind::at_position, 2, 4).request);
  expect_not_ok(2, 106);
}

TEST_F(AtPositionTest, TheWrongIndexOrConnectionIsRefused) {
  handshake->on_position(position(4), robot, now);
  command(CommandKind::at_position, 1, 5);
  expect_not_ok(1, 106);
  handshake->on_position(position(4), other, now);
  command(CommandKind::at_position, 2, 4);
  expect_not_ok(2, 106);
}

TEST_F(AtPositionTest, WhatIsNoPoseIsRefused) {
  PositionBlock wrong = position(4);
  wrong.values[2] = invalid_value;
  EXPECT_EQ(handshake->on_position(wrong, robot, now), CommandVerdict::wrong_argument);
  wrong = position(4);
  wrong.values[6] = 0;
  EXPECT_EQ(handshake->on_position(wrong, robot, now), CommandVerdict::wrong_argument);
  command(CommandKind::at_position, 1, 4);
  expect_not_ok(1, 106);
}

TEST_F(AtPositionTest, NothingIsTakenWhileBusyOrHalted) {
  measure(1);
  EXPECT_EQ(handshake->on_position(position(4), robot, now), CommandVerdict::busy);
  report(ok_report(1));
  expect_valid(1);
  command(CommandKind::halt, 2);
  EXPECT_EQ(handshake->on_position(position(4), robot, now), CommandVerdict::accepted);
  command(CommandKind::at_position, 3, 4);
  expect_not_ok(3, 105);
}

}  // namespace
}  // namespace zeropose
