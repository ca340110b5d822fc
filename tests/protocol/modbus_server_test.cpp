#include "protocol/modbus_server.h"

#include <gmock/gmock.h>

#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

TEST_F(LinkTest, WholeHandshakeOverTcp) {
  start();
  RawModbus client(link->port());
  ResultBlock block = client.block();
  EXPECT_EQ(block.state, LinkState::ready);
  EXPECT_EQ(block.status, status_bit::ready | status_bit::simulated);
  EXPECT_EQ(block.robot_index, 3);
  EXPECT_EQ(block.convention, 2);
  EXPECT_EQ(block.frame, 3);
  EXPECT_NE(block.epoch, 0u);

  ASSERT_EQ(measure(client, 9), 0);
  EXPECT_TRUE(client.block().has(status_bit::busy));
  const auto request = next_request();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->part, 77u);
  link->exposure_done(9);
  EXPECT_TRUE(client.block().has(status_bit::busy | status_bit::exposure_done));
  publish(ok_report(*request));
  block = client.block();
  EXPECT_TRUE(block.has(status_bit::result_valid));
  EXPECT_EQ(block.request_id, 9u);
  EXPECT_EQ(block.values[0], 1500);
  EXPECT_EQ(block.effective_marks, 12);
  EXPECT_EQ(block.zero_id, 0x33333333u);
  EXPECT_LT(block.age_ms, 2000);
  EXPECT_EQ(client.command({9, 2, 0, 0, 0}), 0);
  recorder.withdrawn(9);
  EXPECT_EQ(client.block().request_id, 0u);
  expect_clean_cycle(client, 10);
}

TEST_F(LinkTest, HoldingRegistersMirrorTheBlock) {
  start();
  RawModbus client(link->port());
  const auto input = client.read_registers(4), holding = client.read_registers(3);
  ASSERT_TRUE(input && holding);
  EXPECT_EQ(*input, *holding);
}

TEST_F(LinkTest, PartialReads) {
  start();
  RawModbus client(link->port());
  EXPECT_TRUE(client.read_registers(4, 0, 14));
  EXPECT_TRUE(client.read_registers(3, 30, 31));
  EXPECT_EQ(client.ask(read_pdu(4, 0, 15)), (Bytes{0x84, 2}));
  EXPECT_EQ(client.ask(read_pdu(4, 14, 2)), (Bytes{0x84, 2}));
  EXPECT_EQ(client.ask(read_pdu(3, 0, 60)), (Bytes{0x83, 2}));
  EXPECT_EQ(client.ask(read_pdu(4, 1, 61)), (Bytes{0x84, 2}));
  EXPECT_EQ(link->counters().exception_2, 4u);
  expect_clean_cycle(client, 1);
}

TEST_F(LinkTest, RefusalsChangeNothing) {
  start();
  RawModbus client(link->port());
  expect_clean_cycle(client, 1);
  const ResultBlock before = client.block();
  CommandRegisters damaged = encode_command({2, 1, 1, 0, 0});
  damaged[9] ^= 1;
  EXPECT_EQ(client.ask(write_pdu(1000, damaged)), (Bytes{0x90, 3}));  // CRC
  EXPECT_EQ(client.command({0, 1, 1, 0, 0}), 3);                      // request id 0
  EXPECT_EQ(client.command({1, 1, 1, 0, 0}), 3);                      // the last id again
  EXPECT_EQ(client.ask(write_pdu(1000, std::span(damaged).first(9))), (Bytes{0x90, 3}));
  EXPECT_EQ(client.ask(write_pdu(999, damaged)), (Bytes{0x90, 2}));
  EXPECT_EQ(client.ask({6, 3, 232, 0, 1}), (Bytes{0x86, 1}));
  EXPECT_EQ(client.ask({5, 0, 0, 255, 0}), (Bytes{0x85, 1}));
  EXPECT_EQ(client.ask({17}), (Bytes{0x91, 1}));
  EXPECT_EQ(client.ask({23, 0, 0, 0, 61, 3, 232, 0, 1, 2, 0, 1}), (Bytes{0x97, 1}));
  EXPECT_EQ(client.block(), before);
  const ModbusCounters counters = link->counters();
  EXPECT_EQ(counters.wrong_crc, 1u);
  EXPECT_EQ(counters.handshake.refused_request_id, 2u);
  EXPECT_EQ(counters.exception_1, 4u);
  EXPECT_EQ(counters.exception_3, 4u);
  expect_clean_cycle(client, 2);
}

TEST_F(LinkTest, SimplePlcWithoutCrc) {
  options.require_command_crc = false;
  start();
  RawModbus client(link->port());
  CommandRegisters command = encode_command({2, 1, 1, 0, 0});
  command[8] = command[9] = 0;
  recorder.requested(2);
  EXPECT_EQ(client.ask(write_pdu(1000, command)).front(), 16);
  EXPECT_TRUE(next_request());
}

TEST_F(LinkTest, OtherDataIds) {
  options.result_data_id = 0x1111;
  options.command_data_id = 0x2222;
  options.tap = {};
  start();
  RawModbus client(link->port());
  const auto registers = client.read_registers();
  ASSERT_TRUE(registers);
  EXPECT_EQ(decode_result(*registers).problem, BlockProblem::wrong_crc);
  EXPECT_FALSE(decode_result(*registers, 0x1111).problem);
  EXPECT_EQ(client.command({2, 1, 1, 0, 0}), 3);
  EXPECT_EQ(client.ask(write_pdu(1000, encode_command({2, 1, 1, 0, 0}, 0x2222))).front(), 16);
}

TEST_F(LinkTest, TheDeadmanAnswersASilentCycle) {
  options.handshake.measure_deadline = milliseconds(60);
  start();
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  const auto request = next_request();
  ASSERT_TRUE(request);
  wait_until([&] { return !client.block().has(status_bit::busy); });
  const ResultBlock block = client.block();
  EXPECT_TRUE(block.has(status_bit::not_ok));
  EXPECT_EQ(block.code, 205);
  EXPECT_EQ(block.request_id, 1u);
  publish(ok_report(*request));  // late
  EXPECT_TRUE(client.block().has(status_bit::not_ok));
  EXPECT_EQ(link->counters().handshake.late_reports, 1u);
  expect_clean_cycle(client, 2);
}

// Nobody reads: the loop itself must keep the deadline.
TEST_F(LinkTest, TheDeadmanNeedsNoReader) {
  options.handshake.measure_deadline = milliseconds(30);
  start();
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  wait_until([&] { return link->counters().handshake.timeouts == 1; });
}

TEST_F(LinkTest, AReportWithAForeignIdIsNotPublished) {
  start();
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  const auto request = next_request();
  ASSERT_TRUE(request);
  Report foreign = ok_report(*request);
  foreign.request_id = 2;
  link->publish(foreign);
  EXPECT_TRUE(client.block().has(status_bit::busy));
  publish(ok_report(*request));
  EXPECT_TRUE(client.block().has(status_bit::result_valid));
}

TEST_F(LinkTest, ValidityEnds) {
  options.handshake.validity = milliseconds(50);
  start();
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  publish(ok_report(*next_request()));
  wait_until([&] { return !client.block().has(status_bit::result_valid); });
  EXPECT_EQ(client.block().request_id, 0u);
  EXPECT_EQ(link->counters().handshake.expired, 1u);
  options.handshake.validity = milliseconds(2000);
}

TEST_F(LinkTest, SecondClientReadsAndDisturbsNothing) {
  start();
  RawModbus robot(link->port()), other(link->port());
  ASSERT_EQ(measure(robot, 1), 0);
  const auto request = next_request();
  EXPECT_EQ(other.command({2, 1, 1, 0, 0}), 6);
  EXPECT_EQ(robot.command({3, 1, 1, 0, 0}), 6);
  publish(ok_report(*request));
  EXPECT_TRUE(other.block().has(status_bit::result_valid));
  EXPECT_EQ(other.command({1, 2, 0, 0, 0}), 3);  // not its to acknowledge
  EXPECT_TRUE(robot.block().has(status_bit::result_valid));
  other.close();
  wait_until([&] { return link->counters().clients == 1; });
  EXPECT_TRUE(robot.block().has(status_bit::result_valid));
  EXPECT_EQ(link->counters().exception_6, 2u);
  EXPECT_EQ(link->counters().handshake.refused_acknowledge, 1u);
}

TEST_F(LinkTest, TheOwnersLinkIsLost) {
  start();
  RawModbus watcher(link->port());
  std::optional<RawModbus> robot(link->port());
  ASSERT_EQ(measure(*robot, 1), 0);
  publish(ok_report(*next_request()));
  const ResultBlock valid = watcher.block();
  EXPECT_TRUE(valid.has(status_bit::result_valid));
  robot.reset();
  wait_until([&] { return !watcher.block().has(status_bit::result_valid); });
  recorder.withdrawn(1);
  EXPECT_NE(watcher.block().epoch, valid.epoch);
  expect_clean_cycle(watcher, 2);
}

TEST_F(LinkTest, TheOwnerVanishesInMidRequest) {
  start();
  RawModbus watcher(link->port());
  std::optional<RawModbus> robot(link->port());
  ASSERT_EQ(measure(*robot, 1), 0);
  const auto request = next_request();
  robot.reset();
  wait_until([&] { return watcher.block().request_id == 0; });
  recorder.withdrawn(1);
  publish(ok_report(*request));
  EXPECT_EQ(watcher.block().values, no_values);
  EXPECT_EQ(link->counters().handshake.orphaned_reports, 1u);
  expect_clean_cycle(watcher, 2);
}

TEST_F(LinkTest, RestartIsANewSession) {
  start();
  const auto first = link->block().epoch;
  link.reset();
  start();
  EXPECT_NE(link->block().epoch, first);
}

TEST_F(LinkTest, AHandlerThatThrowsIsAnInternalError) {
  link.emplace(options, [](const Request&) { throw std::runtime_error("no"); });
  link->set_cell_state(ready_cell());
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  const ResultBlock block = client.block();
  EXPECT_EQ(block.code, 901);
  EXPECT_EQ(block.state, LinkState::error);
}

TEST_F(LinkTest, AHandlerMayAnswerAtOnce) {
  link.emplace(options, [this](const Request& request) { publish(ok_report(request)); });
  link->set_cell_state(ready_cell());
  RawModbus client(link->port());
  ASSERT_EQ(measure(client, 1), 0);
  EXPECT_TRUE(client.block().has(status_bit::result_valid));
}

// Faults on the wire.

}  // namespace
}  // namespace zeropose
