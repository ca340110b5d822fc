#include "sim/robot.h"

#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

SimulatedRobotOptions kuka_options() {
  SimulatedRobotOptions options;
  options.convention = Convention::kuka;
  options.frame = 3;
  options.robot_index = 3;
  return options;
}

RobotExpectation expectation() {
  RobotExpectation expected;
  expected.request_id = 42;
  expected.epoch = 1000;
  expected.job = 5;
  expected.part = 6;
  expected.last_used_id = 41;
  return expected;
}

ResultBlock good_block() {
  ResultBlock block;
  block.sequence = 17;
  block.epoch = 1000;
  block.request_id = 42;
  block.job = 5;
  block.robot_index = 3;
  block.part = 6;
  block.state = LinkState::ready;
  block.status = status_bit::ready | status_bit::exposure_done | status_bit::result_valid;
  block.values = *to_wire(Convention::kuka, from_six_numbers({1, 2, 3, 0.1, 0.2, 0.3}));
  block.convention = 2;
  block.frame = 3;
  block.age_ms = 10;
  block.validity_ms = 2000;
  return block;
}

std::string refusal(const ResultBlock& block, const RobotExpectation& expected = expectation(),
                    const SimulatedRobotOptions& options = kuka_options()) {
  const CheckedBlock checked = check_result(encode(block), expected, options);
  EXPECT_EQ(checked.refusal.empty(), checked.correction.has_value());
  return checked.refusal;
}

TEST(RobotChecks, AGoodBlockIsTaken) {
  const CheckedBlock checked = check_result(encode(good_block()), expectation(), kuka_options());
  ASSERT_TRUE(checked.correction) << checked.refusal;
  const Vector6 d = difference(from_six_numbers({1, 2, 3, 0.1, 0.2, 0.3}), *checked.correction);
  EXPECT_LT(d.head<3>().norm(), 1e-9);
  EXPECT_LT(d.tail<3>().norm(), 1e-9);
}

TEST(RobotChecks, EveryDamagedBitIsRefused) {
  const ResultRegisters good = encode(good_block());
  for (std::size_t i = 0; i < good.size(); ++i)
    for (int bit = 0; bit < 16; ++bit) {
      ResultRegisters damaged = good;
      damaged[i] ^= static_cast<std::uint16_t>(1 << bit);
      EXPECT_FALSE(check_result(damaged, expectation(), kuka_options()).correction) << i << " bit " << bit;
    }
  EXPECT_FALSE(check_result(std::span(good).first(60), expectation(), kuka_options()).correction);
  EXPECT_FALSE(check_result({}, expectation(), kuka_options()).correction);
  SimulatedRobotOptions other_device = kuka_options();
  other_device.result_data_id = 0x5A52;
  EXPECT_EQ(check_result(good, expectation(), other_device).refusal, "wrong CRC");
}

struct Wrong {
  std::string refusal;
  void (*change)(ResultBlock&);
};

TEST(RobotChecks, EveryWrongFieldIsNamed) {
  using namespace status_bit;
  const Wrong cases[] = {
      {"session epoch changed", [](ResultBlock& b) { b.epoch = 1001; }},
      {"foreign request id", [](ResultBlock& b) { b.request_id = 43; }},
      {"foreign request id", [](ResultBlock& b) { b.request_id = 0; }},
      {"result for another robot", [](ResultBlock& b) { b.robot_index = 1; }},
      {"result for another job", [](ResultBlock& b) { b.job = 1; }},
      {"result for another part", [](ResultBlock& b) { b.part = 7; }},
      {"another convention", [](ResultBlock& b) { b.convention = 3; }},
      {"another frame of the values", [](ResultBlock& b) { b.frame = 1; }},
      {"unknown status bits", [](ResultBlock& b) { b.status |= 512; }},
      {"still busy", [](ResultBlock& b) { b.status |= busy; }},
      {"status contradicts itself", [](ResultBlock& b) { b.status |= not_ok; }},
      {"status contradicts itself", [](ResultBlock& b) { b.status |= error; }},
      {"status contradicts itself", [](ResultBlock& b) { b.status |= zero_missing; }},
      {"status contradicts itself", [](ResultBlock& b) { b.status &= static_cast<std::uint16_t>(~ready); }},
      {"status contradicts itself",
       [](ResultBlock& b) { b.status &= static_cast<std::uint16_t>(~exposure_done); }},
      {"a camera has moved", [](ResultBlock& b) { b.status |= camera_moved; }},
      {"no valid result", [](ResultBlock& b) { b.status = ready; }},
      {"not ok", [](ResultBlock& b) { b.status = ready | exposure_done | not_ok; }},
      {"valid result with a code", [](ResultBlock& b) { b.code = 1; }},
      {"state contradicts status", [](ResultBlock& b) { b.state = LinkState::error; }},
      {"no validity", [](ResultBlock& b) { b.validity_ms = 0; }},
      {"result too old", [](ResultBlock& b) { b.age_ms = 2000; }},
      {"values are no correction", [](ResultBlock& b) { b.values[5] = invalid_value; }},
      {"values are no correction", [](ResultBlock& b) { b.values[6] = 0; }},
      {"beyond the robot's own limit: translation", [](ResultBlock& b) { b.values[0] = 100001; }},
      {"beyond the robot's own limit: rotation", [](ResultBlock& b) { b.values[3] = 110000; }}};
  for (const Wrong& wrong : cases) {
    ResultBlock block = good_block();
    wrong.change(block);
    EXPECT_EQ(refusal(block), wrong.refusal);
  }
}

TEST(RobotChecks, TheRobotsOwnKnowledge) {
  RobotExpectation used = expectation();
  used.last_used_id = 42;
  EXPECT_EQ(refusal(good_block(), used), "result used already");
  RobotExpectation no_session = expectation();
  no_session.epoch = 0;
  EXPECT_EQ(refusal(good_block(), no_session), "session epoch changed");
  RobotExpectation slow = expectation();
  slow.since_read = milliseconds(1989);
  EXPECT_EQ(refusal(good_block(), slow), "");
  slow.since_read = milliseconds(1990);  // 10 ms old when it was sent
  EXPECT_EQ(refusal(good_block(), slow), "result too old");
  RobotExpectation late = expectation();
  late.since_command = milliseconds(2001);
  EXPECT_EQ(refusal(good_block(), late), "answer too late");
}

class RobotTest : public LinkTest {
 protected:
  // A cycle that answers at once as `answer` says.
  void start_with(std::function<std::optional<Report>(const Request&)> answer) {
    start_with_handler([this, answer](const Request& request) {
      last = request;
      if (request.kind == CommandKind::measure) recorder.requested(request.id);
      endpoint->exposure_done(request.id);
      if (const auto report = answer(request)) publish(*report);
    });
    SimulatedRobotOptions robot_options = kuka_options();
    robot_options.port = server->port();
    robot_options.patience = milliseconds(1000);
    robot.emplace(robot_options);
  }
  std::optional<SimulatedRobot> robot;
  Request last;
};

TEST_F(RobotTest, TakesWhatTheCycleReported) {
  start_with([](const Request& request) { return ok_report(request); });
  for (std::uint32_t i = 1; i <= 20; ++i) {
    const RobotAnswer answer = robot->measure(1, 500 + i, -12345);
    ASSERT_TRUE(answer.ok()) << answer.refusal;
    EXPECT_EQ(answer.request_id, i);
    EXPECT_EQ(last.argument, -12345);
    EXPECT_EQ(last.part, 500 + i);
    const Vector6 d = difference(ok_report(last).correction, *answer.correction);
    EXPECT_LT(d.head<3>().norm(), 0.001);
    EXPECT_LT(d.tail<3>().norm() * degrees_per_radian, 1.5e-4);
    EXPECT_TRUE(answer.to_exposure_done);
    const RobotAnswer acknowledged = robot->acknowledge();
    EXPECT_TRUE(acknowledged.ok()) << acknowledged.refusal;
  }
}

TEST_F(RobotTest, RefusesANotOkWithItsCode) {
  start_with([](const Request& request) {
    Report report = ok_report(request);
    report.code = Code::too_few_marks;
    return report;
  });
  const RobotAnswer answer = robot->measure(1, 1);
  EXPECT_EQ(answer.refusal, "not ok");
  EXPECT_EQ(answer.code, 301);
  EXPECT_FALSE(answer.correction);
  EXPECT_TRUE(robot->acknowledge().ok());
}

TEST_F(RobotTest, RefusesBeyondItsOwnLimits) {
  start_with([](const Request& request) {
    Report report = ok_report(request);
    report.correction.translation().y() = 101;
    return report;
  });
  EXPECT_EQ(robot->measure(1, 1).refusal, "beyond the robot's own limit: translation");
}

TEST_F(RobotTest, ASilentCycleIsATimeOut) {
  handshake.measure_deadline = milliseconds(50);
  start_with([](const Request&) { return std::nullopt; });
  const RobotAnswer answer = robot->measure(1, 1);
  EXPECT_EQ(answer.refusal, "not ok");
  EXPECT_EQ(answer.code, 205);
}

TEST_F(RobotTest, ARobotLosesPatienceBeforeALateAnswer) {
  handshake.measure_deadline = milliseconds(10000);
  start_with([](const Request&) { return std::nullopt; });
  EXPECT_EQ(robot->measure(1, 1).refusal, "still busy");
  EXPECT_EQ(robot->measure(1, 1).exception, 6);
}

TEST_F(RobotTest, EveryConventionArrives) {
  const Pose truth = from_six_numbers({1.5, -2.25, 3, 4, -5, 6});
  for (const Convention convention : all_conventions()) {
    if (convention == Convention::matrix) continue;
    endpoint_options.tap = nullptr;  // the recorder knows one convention
    handshake.convention = convention;
    start_with_handler([&](const Request& request) {
      Report report = ok_report(request);
      report.correction = truth;
      endpoint->publish(report);
    });
    SimulatedRobotOptions robot_options = kuka_options();
    robot_options.convention = convention;
    robot_options.port = server->port();
    const RobotAnswer answer = SimulatedRobot(robot_options).measure(1, 1);
    ASSERT_TRUE(answer.ok()) << name_of(convention) << ": " << answer.refusal;
    const Vector6 d = difference(truth, *answer.correction);
    EXPECT_LT(d.head<3>().norm(), 0.001) << name_of(convention);
    EXPECT_LT(d.tail<3>().norm() * degrees_per_radian, 1.5e-4) << name_of(convention);
    // A robot that is set up for another maker's convention does not move.
    robot_options.convention = convention == Convention::kuka ? Convention::fanuc : Convention::kuka;
    robot_options.first_request_id = 10;
    EXPECT_EQ(SimulatedRobot(robot_options).measure(1, 1).refusal, "another convention");
  }
}

TEST_F(RobotTest, TheOtherCommands) {
  start_with([](const Request& request) {
    Report report;
    report.request_id = request.id;
    report.code = Code::ok;
    return report;
  });
  EXPECT_TRUE(robot->zero(1).ok());
  EXPECT_EQ(last.kind, CommandKind::zero);
  EXPECT_TRUE(robot->select_job(1).ok());
  EXPECT_EQ(last.kind, CommandKind::select_job);
  EXPECT_TRUE(robot->heartbeat().ok());
  EXPECT_TRUE(robot->halt().ok());
  EXPECT_EQ(robot->read().block.state, LinkState::halted);
  EXPECT_EQ(robot->measure(1, 1).code, 105);
  EXPECT_TRUE(robot->resume().ok());
  EXPECT_TRUE(robot->reset().ok());
  EXPECT_EQ(last.kind, CommandKind::reset);
  EXPECT_EQ(robot->read().block.state, LinkState::ready);
}

TEST_F(RobotTest, AZeroThatFailedIsNotOk) {
  start_with([](const Request& request) {
    Report report;
    report.request_id = request.id;
    report.code = Code::storage_failed;
    return report;
  });
  const RobotAnswer answer = robot->zero(1);
  EXPECT_EQ(answer.refusal, "not ok");
  EXPECT_EQ(answer.code, 703);
}

TEST_F(RobotTest, NobodyThere) {
  start_with([](const Request& request) { return ok_report(request); });
  ASSERT_TRUE(robot->measure(1, 1).ok());
  stop();
  EXPECT_EQ(robot->measure(1, 1).refusal, "connection lost");
  EXPECT_NE(robot->measure(1, 1).refusal.find("no connection"), std::string::npos);
}

TEST_F(RobotTest, ARestartInMidRequestIsRefused) {
  handshake.measure_deadline = milliseconds(10000);
  start_with([](const Request&) { return std::nullopt; });
  std::optional<RobotAnswer> answer;
  std::thread thread([&] { answer = robot->measure(1, 1); });
  wait_until([&] { return endpoint->counters().accepted == 1; });
  server.reset();
  thread.join();
  EXPECT_FALSE(answer->ok());
  EXPECT_FALSE(answer->correction);
}

}  // namespace
}  // namespace zeropose
