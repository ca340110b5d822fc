// The daemon on a serial line that is shared, noisy, late, or unplugged.
#include "protocol/modbus_rtu_server.h"

#include <gmock/gmock.h>

#include <random>

#include "tests/protocol/endpoint_fixture.h"
#include "tests/support/raw_rtu.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Counter = std::uint64_t ModbusRtuCounters::*;

class RtuServerTest : public EndpointTest {
 protected:
  RtuServerTest() {
    options.line = {line.device(), 115200, 'N', 1};
    options.first_pause = milliseconds(5);
    options.longest_pause = milliseconds(20);
    options.answer_within = milliseconds(2000);  // a busy machine is not what is tested
    options.master_timeout = milliseconds(60000);
  }
  ~RtuServerTest() override { server.reset(); }

  void start() {
    make_endpoint();
    server.emplace(options, *endpoint);
    ASSERT_TRUE(soon([this] { return server->counters().open; }));
  }
  int measure(std::uint32_t id) {
    recorder.requested(id);
    return line.command({id, 1, 1, 77, 0});
  }
  void expect_clean_cycle(std::uint32_t id) {
    ASSERT_EQ(measure(id), 0);
    const auto request = next_request();
    ASSERT_TRUE(request);
    EXPECT_EQ(request->part, 77u);
    EXPECT_TRUE(line.block().has(status_bit::busy));
    endpoint->exposure_done(id);
    publish(ok_report(*request));
    const ResultBlock block = line.block();
    EXPECT_EQ(block.request_id, id);
    EXPECT_TRUE(block.has(status_bit::result_valid));
    EXPECT_EQ(block.values, to_wire(Convention::kuka, ok_report(*request).correction));
    EXPECT_EQ(line.command({id, 2, 0, 0, 0}), 0);
    recorder.withdrawn(id);
    EXPECT_FALSE(line.block().has(status_bit::result_valid));
    EXPECT_EQ(waiting_requests(), 0u);
  }
  // Looked at and dropped for this reason, without a byte of an answer.
  void expect_ignored(const Bytes& bytes, Counter why) {
    const ModbusRtuCounters before = server->counters();
    line.send(bytes);
    ASSERT_TRUE(soon([&] { return server->counters().*why > before.*why; }));
    EXPECT_TRUE(line.nothing_to_read());
    EXPECT_EQ(server->counters().*why, before.*why + 1);
    EXPECT_EQ(server->counters().answers, before.answers);
    EXPECT_EQ(server->counters().commands, before.commands);
  }

  RawRtu line;
  ModbusRtuOptions options;
  std::optional<ModbusRtuServer> server;
};

TEST_F(RtuServerTest, WholeHandshake) {
  start();
  const ResultBlock block = line.block();
  EXPECT_EQ(block.state, LinkState::ready);
  EXPECT_EQ(block.robot_index, 3);
  EXPECT_EQ(line.ask(read_pdu(3, 0, 61)).size(), 124u);
  for (std::uint32_t id = 1; id <= 20; ++id) expect_clean_cycle(id);
  EXPECT_EQ(server->counters().commands, 40u);
}

TEST_F(RtuServerTest, RefusalsAreThoseOfTcpAndChangeNothing) {
  start();
  expect_clean_cycle(1);
  const ResultBlock before = line.block();
  CommandRegisters damaged = encode_command({2, 1, 1, 0, 0});
  damaged[9] ^= 1;
  EXPECT_EQ(line.ask(write_pdu(1000, damaged)), (Bytes{0x90, 3}));
  EXPECT_EQ(line.command({0, 1, 1, 0, 0}), 3);
  EXPECT_EQ(line.command({1, 1, 1, 0, 0}), 3);
  EXPECT_EQ(line.ask(write_pdu(1000, std::span(damaged).first(9))), (Bytes{0x90, 3}));
  EXPECT_EQ(line.ask(write_pdu(999, damaged)), (Bytes{0x90, 2}));
  EXPECT_EQ(line.ask(write_pdu(0, encode(before))), (Bytes{0x90, 2}));
  EXPECT_EQ(line.ask(read_pdu(4, 14, 16)), (Bytes{0x84, 2}));
  EXPECT_EQ(line.ask(read_pdu(3, 0, 126)), (Bytes{0x83, 3}));
  constexpr std::uint8_t refused[] = {1, 2, 5, 6, 7, 8, 11, 15, 17, 20, 22, 23, 24, 43, 127};
  for (const std::uint8_t function : refused)
    EXPECT_EQ(line.ask({function, 0, 0, 0, 1}), (Bytes{static_cast<std::uint8_t>(function | 0x80), 1}));
  ResultBlock after = line.block();
  after.age_ms = before.age_ms;
  EXPECT_EQ(after, before);
  EXPECT_EQ(server->counters().exception_1, 15u);
  EXPECT_EQ(server->counters().wrong_block_crc, 1u);
  recorder.requested(5);
  EXPECT_EQ(line.command({5, 1, 1, 0, 0}), 0);
  EXPECT_EQ(line.command({6, 1, 1, 0, 0}), 6);
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  expect_clean_cycle(7);
}

TEST_F(RtuServerTest, NoiseCostsTheDisturbedFrameAlone) {
  start();
  const Bytes measure = rtu_frame(command_pdu({1000, 1, 1, 0, 0}));
  Bytes before{0x00}, after = measure, within = measure, wrong_crc = measure;
  before.insert(before.end(), measure.begin(), measure.end());
  after.push_back(0xFF);
  within.insert(within.begin() + 9, 0x55);
  wrong_crc.back() ^= 0x80;
  std::uint32_t id = 1;
  for (const Bytes& noisy : {before, after, within, wrong_crc}) {
    expect_ignored(noisy, &ModbusRtuCounters::wrong_crc);
    expect_clean_cycle(id++);
  }
  expect_ignored({0xFF}, &ModbusRtuCounters::wrong_length);
  expect_clean_cycle(id++);
  expect_ignored(Bytes(600, 0xAA), &ModbusRtuCounters::wrong_length);
  expect_clean_cycle(id++);
}

TEST_F(RtuServerTest, HalfAFrameAndItsLateRestAreNoRequest) {
  start();
  const Bytes whole = rtu_frame(command_pdu({1000, 1, 1, 0, 0}));
  std::uint32_t id = 1;
  for (std::size_t cut = 4; cut + 4 <= whole.size(); ++cut) {
    const auto middle = whole.begin() + static_cast<std::ptrdiff_t>(cut);
    expect_ignored(Bytes(whole.begin(), middle), &ModbusRtuCounters::wrong_crc);
    expect_ignored(Bytes(middle, whole.end()), &ModbusRtuCounters::wrong_crc);
    expect_clean_cycle(id++);
  }
}

TEST_F(RtuServerTest, RandomNoiseBeforeEveryRequest) {
  start();
  std::mt19937 random(7);
  for (std::uint32_t id = 1; id <= 100; ++id) {
    Bytes noise(4 + random() % 40);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    expect_ignored(noise, &ModbusRtuCounters::wrong_crc);
    expect_clean_cycle(id);
  }
}

TEST_F(RtuServerTest, OtherUnitsAndBroadcastsAreNotAnswered) {
  start();
  const Bytes measure = command_pdu({1000, 1, 1, 0, 0});
  std::uint32_t id = 1;
  for (const int unit : {2, 17, 247, 255}) {
    expect_ignored(rtu_frame(measure, static_cast<std::uint8_t>(unit)), &ModbusRtuCounters::other_units);
    expect_ignored(rtu_frame({16, 3, 232, 0, 10}, static_cast<std::uint8_t>(unit)),
                   &ModbusRtuCounters::other_units);  // that unit's answer
    expect_clean_cycle(id++);
  }
  expect_ignored(rtu_frame(measure, 0), &ModbusRtuCounters::broadcasts);
  EXPECT_EQ(waiting_requests(), 0u);
  expect_clean_cycle(id);
}

TEST_F(RtuServerTest, AnEchoOfOurAnswersIsNotAnswered) {
  start();
  for (const Bytes& pdu : {read_pdu(4, 0, 61), read_pdu(4, 14, 2), Bytes{5, 0, 0, 255, 0}}) {
    line.send(rtu_frame(pdu));
    const Bytes answer = line.receive();
    ASSERT_FALSE(answer.empty());
    expect_ignored(answer, &ModbusRtuCounters::wrong_pdu);
  }
  expect_clean_cycle(1);
}

// The cycle takes the request slowly, so the answer would come when the master has long asked something else.
TEST_F(RtuServerTest, ALateAnswerIsNotSent) {
  options.answer_within = milliseconds(30);
  std::atomic<bool> slow{true};
  endpoint.emplace(endpoint_options, [&](const Request& request) {
    if (slow.exchange(false)) std::this_thread::sleep_for(milliseconds(60));
    const std::scoped_lock lock(mutex);
    requests.push_back(request);
    came.notify_all();
  });
  endpoint->set_cell_state({true, true, true, true, 1, 2, 3});
  server.emplace(options, *endpoint);
  ASSERT_TRUE(soon([this] { return server->counters().open; }));
  recorder.requested(1);
  line.send(rtu_frame(command_pdu({1, 1, 1, 0, 0})));
  ASSERT_TRUE(soon([&] { return server->counters().late == 1; }));
  EXPECT_TRUE(line.nothing_to_read());
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  server.reset();
  options.answer_within = milliseconds(2000);
  server.emplace(options, *endpoint);
  ASSERT_TRUE(soon([this] { return server->counters().open; }));
  expect_clean_cycle(2);
}

TEST_F(RtuServerTest, AnAnswerThatAnotherQuestionHasOvertakenIsNotSent) {
  std::atomic<bool> first{true};
  endpoint.emplace(endpoint_options, [&](const Request& request) {
    if (first.exchange(false)) line.send(rtu_frame(read_pdu(4, 0, 14)));
    const std::scoped_lock lock(mutex);
    requests.push_back(request);
    came.notify_all();
  });
  endpoint->set_cell_state({true, true, true, true, 1, 2, 3});
  server.emplace(options, *endpoint);
  ASSERT_TRUE(soon([this] { return server->counters().open; }));
  recorder.requested(1);
  line.send(rtu_frame(command_pdu({1, 1, 1, 0, 0})));
  const Bytes answer = line.receive();
  ASSERT_EQ(answer.size(), 5u + 28u);  // to the second question
  EXPECT_EQ(answer[1], 4);
  EXPECT_EQ(server->counters().overtaken, 1u);
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  expect_clean_cycle(2);
}

TEST_F(RtuServerTest, ALostDeviceWithdrawsTheResultAndIsOpenedAgain) {
  start();
  for (std::uint32_t id = 1; id <= 10; id += 2) {
    ASSERT_EQ(measure(id), 0);
    const auto request = next_request();
    ASSERT_TRUE(request);
    publish(ok_report(*request));
    const ResultBlock before = line.block();
    EXPECT_TRUE(before.has(status_bit::result_valid));
    line.unplug();
    ASSERT_TRUE(soon([&] { return !endpoint->block().has(status_bit::result_valid); }));
    recorder.withdrawn(id);
    const auto tries = server->counters().cannot_open;
    ASSERT_TRUE(soon([&] { return server->counters().cannot_open > tries; }));
    EXPECT_THAT(server->counters().last_failure, HasSubstr(line.device()));
    line.plug_in();
    ASSERT_TRUE(soon([&] { return server->counters().open; }));
    EXPECT_NE(line.block().epoch, before.epoch);
    expect_clean_cycle(id + 1);
  }
  EXPECT_EQ(server->counters().lost, 5u);
  EXPECT_EQ(server->counters().opened, 6u);
}

TEST_F(RtuServerTest, AMasterThatFallsSilentLosesItsResult) {
  options.master_timeout = milliseconds(150);
  start();
  ASSERT_EQ(measure(1), 0);
  const auto request = next_request();
  ASSERT_TRUE(request);
  publish(ok_report(*request));
  const auto epoch = endpoint->block().epoch;
  ASSERT_TRUE(soon([&] { return server->counters().masters_lost == 1; }));
  ASSERT_TRUE(soon([&] { return !endpoint->block().has(status_bit::result_valid); }));
  recorder.withdrawn(1);
  EXPECT_EQ(endpoint->counters().expired, 0u);
  EXPECT_NE(line.block().epoch, epoch);
  expect_clean_cycle(2);
}

TEST_F(RtuServerTest, TheDeadmanNeedsNoReader) {
  endpoint_options.handshake.measure_deadline = milliseconds(30);
  start();
  ASSERT_EQ(measure(1), 0);
  ASSERT_TRUE(next_request());
  ASSERT_TRUE(soon([&] { return endpoint->counters().timeouts == 1; }));
  EXPECT_EQ(line.block().code, 205);
}

TEST_F(RtuServerTest, ADeviceThatIsNotThereIsWaitedFor) {
  line.unplug();
  make_endpoint();
  server.emplace(options, *endpoint);
  ASSERT_TRUE(soon([&] { return server->counters().cannot_open >= 3; }));
  EXPECT_THAT(server->counters().last_failure, HasSubstr("plugged in"));
  line.plug_in();
  ASSERT_TRUE(soon([&] { return server->counters().open; }));
  expect_clean_cycle(1);
  const auto rounds = server->rounds();
  EXPECT_TRUE(soon([&] { return server->rounds() > rounds + 3; }));
}

TEST_F(RtuServerTest, OptionsOutOfRangeAreNamed) {
  make_endpoint();
  const auto refusal = [&](auto change) -> std::string {
    ModbusRtuOptions wrong = options;
    change(wrong);
    try {
      ModbusRtuServer never(wrong, *endpoint);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal([](auto& o) { o.unit.unit = 0; }), HasSubstr("1..247"));
  EXPECT_THAT(refusal([](auto& o) { o.unit.unit = 248; }), HasSubstr("248"));
  EXPECT_THAT(refusal([](auto& o) { o.line.baud = 1000; }), HasSubstr("baud 1000"));
  EXPECT_THAT(refusal([](auto& o) { o.line.parity = 'M'; }), HasSubstr("N, E or O"));
  EXPECT_THAT(refusal([](auto& o) { o.answer_within = milliseconds(9); }), HasSubstr("10..10000"));
  EXPECT_THAT(refusal([](auto& o) { o.master_timeout = milliseconds(1); }), HasSubstr("master"));
  EXPECT_THAT(refusal([](auto& o) { o.gap_tolerance = milliseconds(101); }), HasSubstr("gap"));
}

}  // namespace
}  // namespace zeropose
