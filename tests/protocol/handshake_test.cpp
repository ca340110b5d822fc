#include "protocol/handshake.h"

#include <gtest/gtest.h>

namespace zeropose {
namespace {

using std::chrono::milliseconds;

constexpr ConnectionId robot = 1, other = 2;
constexpr auto K = [](CommandKind kind) { return static_cast<std::uint16_t>(kind); };

CellState ready_cell() { return {true, true, true, false, 0x11111111, 0x22222222, 0x33333333}; }

Report ok_report(std::uint32_t id, double x_mm = 1.5) {
  Report report;
  report.request_id = id;
  report.code = Code::ok;
  report.correction.translation().x() = x_mm;
  report.effective_marks = 12;
  report.effective_cameras = 4;
  return report;
}

Report not_ok_report(std::uint32_t id, Code code) {
  Report report = ok_report(id);
  report.code = code;
  return report;
}

class HandshakeTest : public testing::Test {
 protected:
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

TEST_F(HandshakeTest, SimulatedCellsSaySo) {
  CellState cell = ready_cell();
  cell.simulated = true;
  handshake->set_cell_state(cell, now);
  EXPECT_TRUE(block().has(status_bit::simulated));
}

TEST_F(HandshakeTest, WholeSequence) {
  const auto outcome = handshake->on_command({42, 1, 5, 6, -70000}, robot, now);
  ASSERT_EQ(outcome.verdict, Verdict::accepted);
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
  EXPECT_EQ(command(CommandKind::acknowledge, 42).verdict, Verdict::accepted);
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
              Verdict::busy);
    EXPECT_EQ(handshake->on_command({1, static_cast<std::uint16_t>(kind), 5, 6, 0}, robot, now).verdict,
              Verdict::busy);
  }
  EXPECT_EQ(block(), before);
  report(ok_report(1));
  expect_valid(1);
  EXPECT_EQ(handshake->counters().refused_busy, 24u);
}

TEST_F(HandshakeTest, RequestIdZeroAndTheLastAgainAreRefused) {
  EXPECT_EQ(measure(0).verdict, Verdict::wrong_request_id);
  measure(1);
  report(ok_report(1));
  EXPECT_EQ(measure(1).verdict, Verdict::wrong_request_id);
  expect_valid(1);
  command(CommandKind::acknowledge, 1);
  EXPECT_EQ(measure(1).verdict, Verdict::wrong_request_id);
  EXPECT_EQ(command(CommandKind::halt, 1).verdict, Verdict::wrong_request_id);
  EXPECT_EQ(handshake->counters().refused_request_id, 4u);
  EXPECT_EQ(measure(2).verdict, Verdict::accepted);
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
  EXPECT_EQ(command(CommandKind::resume, 2).verdict, Verdict::accepted);
  EXPECT_EQ(measure(1).verdict, Verdict::wrong_request_id);
  report(ok_report(1));
  expect_done(2);
  EXPECT_EQ(measure(1).verdict, Verdict::accepted);
}

TEST_F(HandshakeTest, AnIdIsNotLostForEverWhenItsReportNeverComes) {
  measure(1);
  wait(500);
  command(CommandKind::resume, 2);
  expect_done(2);
  wait(59500);
  EXPECT_EQ(measure(1).verdict, Verdict::wrong_request_id);
  wait(500);
  EXPECT_EQ(measure(1).verdict, Verdict::accepted);
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
  EXPECT_EQ(command(CommandKind::acknowledge, 1).verdict, Verdict::accepted);  // nothing left to withdraw
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
  EXPECT_EQ(measure(2).verdict, Verdict::accepted);
}

TEST_F(HandshakeTest, ValueOutOfRange) {
  measure(1);
  report(ok_report(1, 1e9));
  expect_not_ok(1, 507);
}

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
    EXPECT_EQ(command(CommandKind::heartbeat, 1000).verdict, Verdict::accepted);
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
  EXPECT_EQ(command(CommandKind::heartbeat, 0).verdict, Verdict::wrong_request_id);
  EXPECT_EQ(command(CommandKind::heartbeat, 2, 1).verdict, Verdict::wrong_argument);
  command(CommandKind::heartbeat, 2, 0, other);
  EXPECT_EQ(handshake->owner(), robot);
  EXPECT_EQ(measure(1).verdict, Verdict::wrong_request_id);
  EXPECT_EQ(handshake->counters().heartbeats, 1u);
}

TEST_F(HandshakeTest, AcknowledgeNeedsOwnerAndId) {
  measure(5);
  report(ok_report(5));
  EXPECT_EQ(command(CommandKind::acknowledge, 4).verdict, Verdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 0).verdict, Verdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 5, 0, other).verdict, Verdict::wrong_acknowledge);
  EXPECT_EQ(command(CommandKind::acknowledge, 5, 1).verdict, Verdict::wrong_argument);
  expect_valid(5);
  EXPECT_EQ(command(CommandKind::acknowledge, 5).verdict, Verdict::accepted);
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
  EXPECT_EQ(measure(1, other).verdict, Verdict::wrong_request_id);
}

TEST_F(HandshakeTest, OwnerLostWhileBusy) {
  measure(1);
  handshake->on_disconnect(robot, now);
  EXPECT_EQ(block().status, status_bit::busy);  // the cycle is still at work
  EXPECT_EQ(block().request_id, 0u);
  EXPECT_EQ(measure(2, other).verdict, Verdict::busy);
  report(ok_report(1));
  expect_withdrawn();
  EXPECT_EQ(handshake->counters().orphaned_reports, 1u);
  EXPECT_EQ(measure(2, other).verdict, Verdict::accepted);
}

TEST_F(HandshakeTest, OwnerLostAndNoReport) {
  measure(1);
  handshake->on_disconnect(robot, now);
  wait(500);
  expect_withdrawn();
  EXPECT_EQ(measure(2, other).verdict, Verdict::accepted);
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
    EXPECT_EQ(outcome.verdict, Verdict::accepted);
    EXPECT_FALSE(outcome.request);
    EXPECT_TRUE(block().has(status_bit::not_ok));
    return block().code;
  };
  EXPECT_EQ(code_with([](CellState& c) { c.config_valid = false; }), 103);
  EXPECT_EQ(code_with([](CellState& c) { c.cameras_alive = false; }), 201);
  EXPECT_EQ(code_with([](CellState& c) { c.zero_valid = false; }), 701);
}

TEST_F(HandshakeTest, ResultIsWithdrawnWhenTheCellChanges) {
  const auto changes = {+[](CellState& c) { c.config_valid = false; },
                        +[](CellState& c) { c.cameras_alive = false; },
                        +[](CellState& c) { c.zero_valid = false; },
                        +[](CellState& c) { c.simulated = true; },
                        +[](CellState& c) { ++c.config_hash; },
                        +[](CellState& c) { ++c.calibration_hash; },
                        +[](CellState& c) { ++c.zero_id; }};
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
  EXPECT_EQ(measure(7).verdict, Verdict::accepted);
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
  for (const int kind : {0, 7, 10, 65535}) {
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

}  // namespace
}  // namespace zeropose
