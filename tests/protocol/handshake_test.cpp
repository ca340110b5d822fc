// From the command to its result.
#include "tests/protocol/handshake_fixture.h"

namespace zeropose {
namespace {

TEST_F(HandshakeTest, StartsWithoutAnyResult) {
  Handshake fresh(options);
  const ResultBlock b = fresh.block(now);
  EXPECT_EQ(b.state, LinkState::preoperational);
  EXPECT_EQ(b.status, status_bit::zero_missing);
  EXPECT_EQ(b.request_id, 0u);
  EXPECT_EQ(b.epoch, 100u);
  EXPECT_EQ(b.values, no_values);
  EXPECT_FALSE(fresh.next_event());
}

TEST_F(HandshakeTest, CellStateDecidesTheState) {
  const auto state_of = [&](bool config, bool cameras, bool zero) {
    CellState cell = ready_cell();
    cell.config_valid = config;
    cell.cameras_alive = cameras;
    cell.zero_valid = zero;
    handshake->set_cell_state(cell, now);
    return block().state;
  };
  EXPECT_EQ(state_of(false, true, true), LinkState::preoperational);
  EXPECT_EQ(state_of(true, false, true), LinkState::initialized);
  EXPECT_EQ(state_of(true, true, false), LinkState::initialized);
  EXPECT_TRUE(block().has(status_bit::zero_missing));
  EXPECT_EQ(state_of(true, true, true), LinkState::ready);
  EXPECT_EQ(block().status, status_bit::ready);
}

// A camera that was moved does not stop the robot from asking again: each Measure looks at the references
// anew.
TEST_F(HandshakeTest, AMovedCameraIsShownAndLooksAgain) {
  CellState cell = ready_cell();
  cell.camera_moved = true;
  handshake->set_cell_state(cell, now);
  EXPECT_EQ(block().status, status_bit::ready | status_bit::camera_moved);
  EXPECT_TRUE(measure(1).request);
  cell.camera_moved = false;
  handshake->set_cell_state(cell, now);
  report(ok_report(1));
  expect_valid(1);
}

TEST_F(HandshakeTest, SimulatedCellsSaySo) {
  CellState cell = ready_cell();
  cell.simulated = true;
  handshake->set_cell_state(cell, now);
  EXPECT_TRUE(block().has(status_bit::simulated));
}

TEST_F(HandshakeTest, WholeSequence) {
  const auto outcome = handshake->on_command({42, 1, 5, 6, -70000}, robot, now);
  ASSERT_EQ(outcome.verdict, CommandVerdict::accepted);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->robot, 7u);
  EXPECT_EQ(outcome.request->kind, CommandKind::measure);
  EXPECT_EQ(outcome.request->id, 42u);
  EXPECT_EQ(outcome.request->job, 5);
  EXPECT_EQ(outcome.request->part, 6u);
  EXPECT_EQ(outcome.request->argument, -70000);
  EXPECT_EQ(outcome.request->received, now);
  EXPECT_EQ(outcome.request->deadline, now + options.measure_deadline);
  EXPECT_EQ(block().status, status_bit::busy);
  EXPECT_EQ(block().state, LinkState::single_execution);
  EXPECT_EQ(block().request_id, 42u);
  wait(80);
  handshake->on_exposure_done(42, now);
  EXPECT_EQ(block().status, status_bit::busy | status_bit::exposure_done);
  wait(20);
  report(ok_report(42));
  expect_valid(42);
  wait(3);
  const ResultBlock b = block();
  EXPECT_EQ(b.values[0], 1500);
  EXPECT_EQ(b.age_ms, 3);
  EXPECT_EQ(b.validity_ms, 2000);
  EXPECT_EQ(b.job, 5);
  EXPECT_EQ(b.part, 6u);
  EXPECT_EQ(b.robot_index, 8);
  EXPECT_EQ(b.convention, 2);
  EXPECT_EQ(b.frame, 3);
  EXPECT_EQ(b.effective_marks, 12);
  EXPECT_EQ(b.config_hash, 0x11111111u);
  EXPECT_EQ(b.calibration_hash, 0x22222222u);
  EXPECT_EQ(b.zero_id, 0x33333333u);
  EXPECT_EQ(command(CommandKind::acknowledge, 42).verdict, CommandVerdict::accepted);
  expect_withdrawn();
  EXPECT_EQ(block().state, LinkState::ready);
}

TEST_F(HandshakeTest, SequenceChangesWithEveryPublishedChangeAndOnlyThen) {
  const auto first = block().sequence;
  wait(50);
  EXPECT_EQ(block().sequence, first);
  measure(1);
  EXPECT_EQ(block().sequence, first + 1);
  handshake->on_exposure_done(1, now);
  report(ok_report(1));
  EXPECT_EQ(block().sequence, first + 3);
  wait(50);
  EXPECT_EQ(block().sequence, first + 3);
  wait(2000);
  EXPECT_EQ(block().sequence, first + 4);
}

TEST_F(HandshakeTest, SecondCommandWhileBusyDisturbsNothing) {
  measure(1);
  const ResultBlock before = block();
  for (int kind = 0; kind < 12; ++kind) {
    EXPECT_EQ(handshake->on_command({9, static_cast<std::uint16_t>(kind), 5, 6, 0}, other, now).verdict,
              CommandVerdict::busy);
    EXPECT_EQ(handshake->on_command({1, static_cast<std::uint16_t>(kind), 5, 6, 0}, robot, now).verdict,
              CommandVerdict::busy);
  }
  EXPECT_EQ(block(), before);
  report(ok_report(1));
  expect_valid(1);
  EXPECT_EQ(handshake->counters().refused_busy, 24u);
}

TEST_F(HandshakeTest, RequestIdZeroAndTheLastAgainAreRefused) {
  EXPECT_EQ(measure(0).verdict, CommandVerdict::wrong_request_id);
  measure(1);
  report(ok_report(1));
  EXPECT_EQ(measure(1).verdict, CommandVerdict::wrong_request_id);
  expect_valid(1);
  command(CommandKind::acknowledge, 1);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::wrong_request_id);
  EXPECT_EQ(command(CommandKind::halt, 1).verdict, CommandVerdict::wrong_request_id);
  EXPECT_EQ(handshake->counters().refused_request_id, 4u);
  EXPECT_EQ(measure(2).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, ForeignReportsAreIgnored) {
  measure(1);
  report(ok_report(2));
  report(ok_report(0));
  EXPECT_TRUE(block().has(status_bit::busy));
  Report stale = ok_report(1);
  stale.ticket = 999;
  report(stale);
  EXPECT_TRUE(block().has(status_bit::busy));
  EXPECT_EQ(handshake->counters().late_reports, 3u);
  report(ok_report(1));
  expect_valid(1);
  report(ok_report(1, 99));  // a second report for the same request
  EXPECT_EQ(block().values[0], 1500);
}

TEST_F(HandshakeTest, ForeignExposureDoneIsIgnored) {
  measure(1);
  handshake->on_exposure_done(2, now);
  EXPECT_FALSE(block().has(status_bit::exposure_done));
}

TEST_F(HandshakeTest, DeadmanAnswersAtTheDeadline) {
  measure(1);
  EXPECT_EQ(handshake->next_event(), now + milliseconds(500));
  wait(499);
  EXPECT_TRUE(block().has(status_bit::busy));
  wait(1);
  expect_not_ok(1, 205);
  report(ok_report(1));
  expect_not_ok(1, 205);
  EXPECT_EQ(handshake->counters().timeouts, 1u);
  EXPECT_EQ(handshake->counters().late_reports, 1u);
}

TEST_F(HandshakeTest, AReportAtTheVeryDeadlineIsTooLate) {
  measure(1);
  wait(500);
  report(ok_report(1));
  expect_not_ok(1, 205);
}

// Else the late answer to the first request 1 would pass for the answer to the second.
TEST_F(HandshakeTest, AnIdIsNotTakenAgainWhileItsLateReportIsToCome) {
  measure(1);
  wait(500);
  EXPECT_EQ(command(CommandKind::resume, 2).verdict, CommandVerdict::accepted);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::wrong_request_id);
  report(ok_report(1));
  expect_done(2);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, AnIdIsNotLostForEverWhenItsReportNeverComes) {
  measure(1);
  wait(500);
  command(CommandKind::resume, 2);
  expect_done(2);
  wait(59500);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::wrong_request_id);
  wait(500);
  EXPECT_EQ(measure(1).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, ZeroHasItsOwnDeadline) {
  const auto outcome = command(CommandKind::zero, 1, zero_guard);
  ASSERT_TRUE(outcome.request);
  EXPECT_EQ(outcome.request->deadline, now + options.zero_deadline);
  wait(9999);
  EXPECT_TRUE(block().has(status_bit::busy));
  wait(1);
  expect_not_ok(1, 205);
}

TEST_F(HandshakeTest, ValidityEnds) {
  measure(1);
  report(ok_report(1));
  EXPECT_EQ(handshake->next_event(), now + milliseconds(2000));
  wait(1999);
  expect_valid(1);
  EXPECT_EQ(block().age_ms, 1999);
  wait(1);
  expect_withdrawn();
  EXPECT_EQ(handshake->counters().expired, 1u);
  EXPECT_EQ(command(CommandKind::acknowledge, 1).verdict,
            CommandVerdict::accepted);  // nothing left to withdraw
}

TEST_F(HandshakeTest, AgeIsRoundedUpAndSaturates) {
  measure(1);
  report(not_ok_report(1, Code::frame_timeout));
  now += std::chrono::microseconds(1);
  EXPECT_EQ(block().age_ms, 1);
  wait(100000);
  EXPECT_EQ(block().age_ms, 65535);
  expect_not_ok(1, 202);
}

TEST_F(HandshakeTest, NotOkCarriesTheCodeAndNoValues) {
  measure(1);
  report(not_ok_report(1, Code::limit_rz));
  expect_not_ok(1, 506);
  EXPECT_EQ(block().state, LinkState::ready);
  EXPECT_EQ(measure(2).verdict, CommandVerdict::accepted);
}

TEST_F(HandshakeTest, ValueOutOfRange) {
  measure(1);
  report(ok_report(1, 1e9));
  expect_not_ok(1, 507);
}

}  // namespace
}  // namespace zeropose
