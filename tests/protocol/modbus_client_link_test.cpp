// The daemon as client of a controller that is right, wrong, late, stubborn, or gone.
#include "protocol/modbus_client_link.h"

#include <gmock/gmock.h>

#include "tests/protocol/endpoint_fixture.h"
#include "tests/support/fake_controller.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class ClientLinkTest : public EndpointTest {
 protected:
  ClientLinkTest() {
    options.poll_period = milliseconds(2);
    options.heartbeat_period = milliseconds(50);
    options.first_pause = milliseconds(5);
    options.longest_pause = milliseconds(40);
    options.response_timeout = milliseconds(500);
  }
  ~ClientLinkTest() override { link.reset(); }

  void start() {
    make_endpoint();
    options.where = ModbusTcpAddress{"127.0.0.1", controller.port()};
    // Whoever looks between two messages: a block that seems whole is one that the robot may see.
    controller.after_write([this] { look(); });
    link.emplace(options, *endpoint);
    ASSERT_TRUE(soon([this] { return link->counters().connected; }));
  }
  void look() {
    const auto registers = controller.get(options.result_address, reg::block_size);
    ++looks;
    const auto problem = decode_result(registers).problem;
    if (!problem) return recorder.see(registers, Recorder::Clock::now());
    ++unusable_looks;
    if (registers[reg::sequence_begin] == registers[reg::sequence_end]) ++torn_without_a_sign;
  }

  void command(const Command& command) { controller.set(options.command_address, encode_command(command)); }
  std::vector<std::uint16_t> life() const { return controller.get(options.life_address, 4); }
  ResultBlock block() const {
    return decode_result(controller.get(options.result_address, reg::block_size)).block;
  }
  bool answered(std::uint32_t id, std::uint16_t exception) {
    return soon([&] {
      const auto now = life();
      return now[1] == id >> 16 && now[2] == (id & 0xFFFF) && now[3] == exception;
    });
  }

  void expect_clean_cycle(std::uint32_t id) {
    ASSERT_TRUE(soon([this] { return link->counters().connected; }));
    recorder.requested(id);
    command({id, 1, 1, 77, 0});
    const auto request = next_request();
    ASSERT_TRUE(request);
    ASSERT_EQ(request->id, id);
    ASSERT_TRUE(soon([&] { return block().request_id == id && block().has(status_bit::busy); }));
    ASSERT_TRUE(answered(id, 0));
    endpoint->exposure_done(id);
    publish(ok_report(*request));
    ASSERT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
    EXPECT_EQ(block().request_id, id);
    EXPECT_EQ(block().values, to_wire(Convention::kuka, ok_report(*request).correction));
    command({id, 2, 0, 0, 0});
    ASSERT_TRUE(soon([&] { return block().request_id == 0; }));
    recorder.withdrawn(id);
    EXPECT_FALSE(block().has(status_bit::result_valid));
    EXPECT_TRUE(recorder.saw_valid(id));
  }
  // A session in which the controller cannot use anything must end, and the next one be as good as new.
  void expect_new_session_after(const FakeController::Faults& faults, std::uint64_t dropped_unwritable = 0) {
    const auto before = link->counters().connections;
    const auto epoch = block().epoch;
    controller.fail(faults);
    ASSERT_TRUE(soon([&] {
      const ModbusClientCounters now = link->counters();
      return !now.connected && now.dropped_unwritable >= dropped_unwritable;
    }));
    controller.fail({});
    ASSERT_TRUE(soon([&] { return link->counters().connected; }));
    EXPECT_GT(link->counters().connections, before);
    EXPECT_NE(block().epoch, epoch);
  }

  FakeController controller;
  ModbusClientOptions options;
  std::atomic<int> looks{0}, unusable_looks{0}, torn_without_a_sign{0};
  std::optional<ModbusClientLink> link;
};

TEST_F(ClientLinkTest, WholeHandshake) {
  start();
  EXPECT_EQ(block().state, LinkState::ready);
  EXPECT_NE(block().epoch, 0u);
  EXPECT_EQ(block().robot_index, 3);
  for (std::uint32_t id = 1; id <= 5; ++id) expect_clean_cycle(id);
  EXPECT_EQ(link->counters().commands, 10u);
  EXPECT_EQ(link->counters().connections, 1u);
  EXPECT_EQ(link->counters().read_back_wrong, 0u);
  EXPECT_EQ(unusable_looks, 0);
}

TEST_F(ClientLinkTest, TheSignOfLifeGrowsAndTheAgeIsRefreshed) {
  start();
  recorder.requested(1);
  command({1, 1, 1, 0, 0});
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  ASSERT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
  const auto counter = life()[0];
  const auto age = block().age_ms;
  EXPECT_TRUE(soon([&] { return block().age_ms >= age + 60 || !block().has(status_bit::result_valid); }));
  EXPECT_TRUE(block().has(status_bit::result_valid));
  EXPECT_TRUE(soon([&] { return life()[0] >= counter + 2; }));
  EXPECT_GT(link->rounds(), 10u);
}

TEST_F(ClientLinkTest, ARefusalIsToldAndChangesNothing) {
  start();
  expect_clean_cycle(1);
  recorder.requested(2);
  command({2, 1, 1, 0, 0});
  const auto request = next_request();
  ASSERT_TRUE(request);
  command({3, 1, 1, 0, 0});
  EXPECT_TRUE(answered(3, 6));  // busy
  EXPECT_EQ(block().request_id, 2u);
  publish(ok_report(*request));
  EXPECT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
  command({4, 2, 0, 0, 0});
  EXPECT_TRUE(answered(4, 3));  // acknowledges what nobody asked
  EXPECT_TRUE(block().has(status_bit::result_valid));
  CommandRegisters wrong = encode_command({5, 1, 1, 0, 0});
  wrong[8] ^= 1;
  controller.set(options.command_address, wrong);
  EXPECT_TRUE(answered(5, 3));
  EXPECT_EQ(link->counters().wrong_crc, 1u);
  EXPECT_EQ(link->counters().refused_commands, 2u);
  EXPECT_EQ(waiting_requests(), 0u);
  expect_clean_cycle(6);
}

TEST_F(ClientLinkTest, TheDeadmanAnswersASilentCycle) {
  endpoint_options.handshake.measure_deadline = milliseconds(60);
  start();
  recorder.requested(1);
  command({1, 1, 1, 0, 0});
  ASSERT_TRUE(next_request());
  ASSERT_TRUE(soon([&] { return block().has(status_bit::not_ok); }));
  EXPECT_EQ(block().code, 205);
  EXPECT_EQ(block().request_id, 1u);
  expect_clean_cycle(2);
}

TEST_F(ClientLinkTest, AResultIsWithdrawnAtTheEndOfItsValidity) {
  endpoint_options.handshake.validity = milliseconds(100);
  start();
  recorder.requested(1);
  command({1, 1, 1, 0, 0});
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  ASSERT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
  ASSERT_TRUE(soon([&] { return block().request_id == 0; }));
  EXPECT_EQ(endpoint->counters().expired, 1u);
  expect_clean_cycle(2);
}

TEST_F(ClientLinkTest, SplitWritesAreNeverTakenForAWholeBlock) {
  options.max_registers = 16;
  controller.fail({.max_registers = 16, .store = {}});
  start();
  for (std::uint32_t id = 1; id <= 5; ++id) expect_clean_cycle(id);
  EXPECT_GT(unusable_looks, 20);
  // Not even a robot that checks no CRC may take a torn one for whole.
  EXPECT_EQ(torn_without_a_sign, 0);
}

TEST_F(ClientLinkTest, AControllerThatTakesFewerRegistersIsNamed) {
  start();
  FakeController::Faults faults;
  faults.max_registers = 16;
  controller.fail(faults);
  EXPECT_TRUE(soon([&] { return link->counters().dropped_unwritable >= 1; }));
  EXPECT_THAT(link->counters().last_failure, HasSubstr("refused"));
  ASSERT_TRUE(soon([&] { return !link->counters().connected; }));
  controller.fail({});
  expect_clean_cycle(1);
}

TEST_F(ClientLinkTest, AStaleCommandStartsNothingAfterAReconnect) {
  command({41, 1, 1, 0, 0});  // from before the daemon started
  start();
  EXPECT_TRUE(answered(41, 3));
  const auto polls = link->counters().polls;
  EXPECT_TRUE(soon([&] { return link->counters().polls > polls + 5; }));
  EXPECT_EQ(waiting_requests(), 0u);
  expect_clean_cycle(42);

  recorder.requested(43);
  command({43, 1, 1, 0, 0});
  ASSERT_TRUE(next_request());
  ASSERT_TRUE(soon([&] { return block().request_id == 43; }));
  const auto epoch = block().epoch;
  controller.stop();  // in mid-cycle
  ASSERT_TRUE(soon([&] { return !link->counters().connected; }));
  controller.start();
  ASSERT_TRUE(soon([&] { return link->counters().connected; }));
  EXPECT_NE(block().epoch, epoch);
  EXPECT_EQ(block().request_id, 0u);
  const auto later = link->counters().polls;
  EXPECT_TRUE(soon([&] { return link->counters().polls > later + 5; }));
  EXPECT_EQ(waiting_requests(), 0u);
  ASSERT_TRUE(soon([&] { return !endpoint->block().has(status_bit::busy); }));  // the deadline is over
  expect_clean_cycle(44);
}

TEST_F(ClientLinkTest, AResultIsWithdrawnWhenTheConnectionIsLost) {
  start();
  recorder.requested(1);
  command({1, 1, 1, 0, 0});
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  ASSERT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
  const auto epoch = block().epoch;
  controller.stop();
  ASSERT_TRUE(soon([&] { return !endpoint->block().has(status_bit::result_valid); }));
  recorder.withdrawn(1);
  controller.start();
  ASSERT_TRUE(soon([&] { return link->counters().connected; }));
  EXPECT_FALSE(block().has(status_bit::result_valid));
  EXPECT_NE(block().epoch, epoch);
  expect_clean_cycle(2);
}

TEST_F(ClientLinkTest, OneKillAfterTheOther) {
  start();
  for (std::uint32_t id = 1; id <= 10; ++id) {
    expect_clean_cycle(id);
    controller.stop();
    ASSERT_TRUE(soon([&] { return !link->counters().connected; }));
    controller.start();
  }
  expect_clean_cycle(11);
  EXPECT_GE(link->counters().connections, 11u);
}

TEST_F(ClientLinkTest, ALateAnswerIsNeverTakenForALaterOne) {
  options.response_timeout = milliseconds(100);
  start();
  expect_clean_cycle(1);
  FakeController::Faults late;
  late.answer_delay = milliseconds(150);
  expect_new_session_after(late);
  EXPECT_GE(link->counters().no_answer, 1u);
  EXPECT_EQ(link->counters().wrong_answer, 0u);  // the connection was closed before it came
  expect_clean_cycle(2);
}

TEST_F(ClientLinkTest, SilenceAndWrongTransactionsEndTheConnection) {
  options.response_timeout = milliseconds(100);
  start();
  expect_clean_cycle(1);
  FakeController::Faults silent;
  silent.silent = true;
  expect_new_session_after(silent);
  EXPECT_GE(link->counters().no_answer, 1u);
  expect_clean_cycle(2);
  FakeController::Faults wrong;
  wrong.wrong_transaction = true;
  expect_new_session_after(wrong);
  EXPECT_GE(link->counters().wrong_answer, 1u);
  expect_clean_cycle(3);
}

TEST_F(ClientLinkTest, RefusedReadsAndWritesEndTheConnection) {
  start();
  expect_clean_cycle(1);
  FakeController::Faults reads;
  reads.refuses_reads = true;
  expect_new_session_after(reads);
  EXPECT_GE(link->counters().refused_reads, 1u);
  expect_clean_cycle(2);
  FakeController::Faults writes;
  writes.refuses_writes = true;
  // Mostly the sign of life ends the session; the next one does not begin, since its block cannot be written.
  expect_new_session_after(writes, 1);
  EXPECT_GE(link->counters().refused_writes, 3u);
  expect_clean_cycle(3);
}

// One register of the values is stored with another number: once, and then always.
TEST_F(ClientLinkTest, WhatIsStoredOtherwiseIsWrittenAgainAndThenGivenUp) {
  start();
  expect_clean_cycle(1);
  FakeController::Faults faults;
  std::atomic<int> times{1};
  const std::size_t spoilt = options.result_address + reg::values + 1;
  faults.store = [&, spoilt](std::size_t address, std::uint16_t value) {
    if (address != spoilt || times <= 0) return value;
    --times;
    return static_cast<std::uint16_t>(value + 1);
  };
  controller.fail(faults);
  EXPECT_TRUE(soon([&] { return link->counters().read_back_wrong == 1; }));
  expect_clean_cycle(2);
  EXPECT_EQ(link->counters().dropped_unwritable, 0u);
  EXPECT_EQ(link->counters().connections, 1u);

  times = 1'000'000;
  EXPECT_TRUE(soon([&] { return link->counters().dropped_unwritable >= 1; }));
  EXPECT_GE(link->counters().read_back_wrong, 4u);
  EXPECT_THAT(link->counters().last_failure, HasSubstr("register " + std::to_string(spoilt)));
  EXPECT_TRUE(soon([&] { return !link->counters().connected; }));
  // A command is not carried out as long as its answer could not be shown.
  command({3, 1, 1, 0, 0});
  EXPECT_TRUE(soon([&] { return link->counters().dropped_unwritable >= 3; }));
  EXPECT_EQ(waiting_requests(), 0u);
  controller.fail({});
  expect_clean_cycle(4);
}

TEST_F(ClientLinkTest, TheResultIsWithdrawnWhenTheDaemonEnds) {
  start();
  recorder.requested(1);
  command({1, 1, 1, 0, 0});
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  ASSERT_TRUE(soon([&] { return block().has(status_bit::result_valid); }));
  link.reset();
  recorder.withdrawn(1);
  EXPECT_FALSE(block().has(status_bit::result_valid));
  EXPECT_EQ(block().request_id, 0u);
  link.emplace(options, *endpoint);
  expect_clean_cycle(2);
}

TEST_F(ClientLinkTest, ItStartsAndEndsWithoutAController) {
  make_endpoint();
  controller.stop();
  options.where = ModbusTcpAddress{"127.0.0.1", controller.port()};
  link.emplace(options, *endpoint);
  ASSERT_TRUE(soon([&] { return link->counters().cannot_connect >= 3; }));
  EXPECT_THAT(link->counters().last_failure, HasSubstr("cannot connect"));
  controller.start();
  expect_clean_cycle(1);
  controller.stop();
}

TEST_F(ClientLinkTest, OptionsOutOfRangeAreNamed) {
  make_endpoint();
  const auto refusal = [&](auto change) -> std::string {
    ModbusClientOptions wrong;
    change(wrong);
    try {
      ModbusClientLink never(wrong, *endpoint);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal([](auto& o) { o.result_address = 137; }),
              HasSubstr("command and result block overlap"));
  EXPECT_THAT(refusal([](auto& o) { o.life_address = 200; }), HasSubstr("overlap"));
  EXPECT_THAT(refusal([](auto& o) { o.result_address = 65476; }), HasSubstr("65535"));
  EXPECT_THAT(refusal([](auto& o) { o.max_registers = 9; }), HasSubstr("10..123"));
  EXPECT_THAT(refusal([](auto& o) { o.poll_period = milliseconds(0); }), HasSubstr("poll period"));
  EXPECT_THAT(refusal([](auto& o) { o.response_timeout = milliseconds(1001); }), HasSubstr("1..1000"));
  EXPECT_THAT(refusal([](auto& o) { o.write_attempts = 0; }), HasSubstr("attempts"));
  EXPECT_THAT(refusal([](auto& o) { o.where = ModbusTcpAddress{"robot", 502}; }), HasSubstr("IPv4"));
  EXPECT_THAT(refusal([](auto& o) { o.where = SerialLine{"/dev/x", 19200, 'X', 1}; }), HasSubstr("parity"));
  EXPECT_THAT(refusal([](auto& o) { o.unit = 250; }), HasSubstr("unit 250"));
}

}  // namespace
}  // namespace zeropose
