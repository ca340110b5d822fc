#include "protocol/modbus_server.h"

#include <gmock/gmock.h>

#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

TEST_F(LinkTest, WholeHandshakeOverTcp) {
  start();
  RawModbus client(server->port());
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
  endpoint->exposure_done(9);
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
  RawModbus client(server->port());
  const auto input = client.read_registers(4), holding = client.read_registers(3);
  ASSERT_TRUE(input && holding);
  EXPECT_EQ(*input, *holding);
}

TEST_F(LinkTest, TargetsAreShownWithTheEpochOfNow) {
  start();
  RawModbus client(server->port());
  const auto target = [&] { return decode_target(client.read_registers(4, 200, 22).value()); };
  ASSERT_TRUE(target());
  EXPECT_EQ(target()->index, 0u);
  EXPECT_EQ(target()->values, no_values);
  const Pose X_RH = from_six_numbers({1234.5, -20, 300, 10, -20, 30});
  endpoint->show_target(7, X_RH);
  EXPECT_EQ(target()->epoch, client.block().epoch);
  EXPECT_EQ(target()->index, 7u);
  EXPECT_EQ(target()->values, *to_wire(endpoint->options().convention, X_RH));
  endpoint->show_target(0, X_RH);
  EXPECT_EQ(target()->index, 0u);
  EXPECT_EQ(target()->values, no_values);
}

TEST_F(LinkTest, PartialReads) {
  start();
  RawModbus client(server->port());
  EXPECT_TRUE(client.read_registers(4, 0, 14));
  EXPECT_TRUE(client.read_registers(3, 30, 31));
  EXPECT_EQ(client.ask(read_pdu(4, 0, 15)), (Bytes{0x84, 2}));
  EXPECT_EQ(client.ask(read_pdu(4, 14, 2)), (Bytes{0x84, 2}));
  EXPECT_EQ(client.ask(read_pdu(3, 0, 60)), (Bytes{0x83, 2}));
  EXPECT_EQ(client.ask(read_pdu(4, 1, 61)), (Bytes{0x84, 2}));
  EXPECT_EQ(server->counters().exception_2, 4u);
  expect_clean_cycle(client, 1);
}

TEST_F(LinkTest, RefusalsChangeNothing) {
  start();
  RawModbus client(server->port());
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
  const ModbusCounters counters = server->counters();
  EXPECT_EQ(counters.wrong_block_crc, 1u);
  EXPECT_EQ(endpoint->counters().refused_request_id, 2u);
  EXPECT_EQ(counters.exception_1, 4u);
  EXPECT_EQ(counters.exception_3, 4u);
  expect_clean_cycle(client, 2);
}

TEST_F(LinkTest, SimplePlcWithoutCrc) {
  served.unit.require_command_crc = false;
  start();
  RawModbus client(server->port());
  CommandRegisters command = encode_command({2, 1, 1, 0, 0});
  command[8] = command[9] = 0;
  recorder.requested(2);
  EXPECT_EQ(client.ask(write_pdu(1000, command)).front(), 16);
  EXPECT_TRUE(next_request());
}

TEST_F(LinkTest, OtherDataIds) {
  served.unit.result_data_id = 0x1111;
  served.unit.command_data_id = 0x2222;
  endpoint_options.tap = nullptr;
  start();
  RawModbus client(server->port());
  const auto registers = client.read_registers();
  ASSERT_TRUE(registers);
  EXPECT_EQ(decode_result(*registers).problem, BlockProblem::wrong_crc);
  EXPECT_FALSE(decode_result(*registers, 0x1111).problem);
  EXPECT_EQ(client.command({2, 1, 1, 0, 0}), 3);
  EXPECT_EQ(client.ask(write_pdu(1000, encode_command({2, 1, 1, 0, 0}, 0x2222))).front(), 16);
}

TEST_F(LinkTest, TheDeadmanAnswersASilentCycle) {
  handshake.measure_deadline = milliseconds(60);
  start();
  RawModbus client(server->port());
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
  EXPECT_EQ(endpoint->counters().late_reports, 1u);
  expect_clean_cycle(client, 2);
}

// Nobody reads: the loop itself must keep the deadline.
TEST_F(LinkTest, TheDeadmanNeedsNoReader) {
  handshake.measure_deadline = milliseconds(30);
  start();
  RawModbus client(server->port());
  ASSERT_EQ(measure(client, 1), 0);
  wait_until([&] { return endpoint->counters().timeouts == 1; });
}

TEST_F(LinkTest, AReportWithAForeignIdIsNotPublished) {
  start();
  RawModbus client(server->port());
  ASSERT_EQ(measure(client, 1), 0);
  const auto request = next_request();
  ASSERT_TRUE(request);
  Report foreign = ok_report(*request);
  foreign.request_id = 2;
  endpoint->publish(foreign);
  EXPECT_TRUE(client.block().has(status_bit::busy));
  publish(ok_report(*request));
  EXPECT_TRUE(client.block().has(status_bit::result_valid));
}

TEST_F(LinkTest, ValidityEnds) {
  handshake.validity = milliseconds(50);
  start();
  RawModbus client(server->port());
  ASSERT_EQ(measure(client, 1), 0);
  publish(ok_report(*next_request()));
  wait_until([&] { return !client.block().has(status_bit::result_valid); });
  EXPECT_EQ(client.block().request_id, 0u);
  EXPECT_EQ(endpoint->counters().expired, 1u);
  handshake.validity = milliseconds(2000);
}

TEST_F(LinkTest, SecondClientReadsAndDisturbsNothing) {
  start();
  RawModbus robot(server->port()), other(server->port());
  ASSERT_EQ(measure(robot, 1), 0);
  const auto request = next_request();
  EXPECT_EQ(other.command({2, 1, 1, 0, 0}), 6);
  EXPECT_EQ(robot.command({3, 1, 1, 0, 0}), 6);
  publish(ok_report(*request));
  EXPECT_TRUE(other.block().has(status_bit::result_valid));
  EXPECT_EQ(other.command({1, 2, 0, 0, 0}), 3);  // not its to acknowledge
  EXPECT_TRUE(robot.block().has(status_bit::result_valid));
  other.close();
  wait_until([&] { return server->counters().clients == 1; });
  EXPECT_TRUE(robot.block().has(status_bit::result_valid));
  EXPECT_EQ(server->counters().exception_6, 2u);
  EXPECT_EQ(endpoint->counters().refused_acknowledge, 1u);
}

TEST_F(LinkTest, TheOwnersLinkIsLost) {
  start();
  RawModbus watcher(server->port());
  std::optional<RawModbus> robot(server->port());
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
  RawModbus watcher(server->port());
  std::optional<RawModbus> robot(server->port());
  ASSERT_EQ(measure(*robot, 1), 0);
  const auto request = next_request();
  robot.reset();
  wait_until([&] { return watcher.block().request_id == 0; });
  recorder.withdrawn(1);
  publish(ok_report(*request));
  EXPECT_EQ(watcher.block().values, no_values);
  EXPECT_EQ(endpoint->counters().orphaned_reports, 1u);
  expect_clean_cycle(watcher, 2);
}

TEST_F(LinkTest, RestartIsANewSession) {
  start();
  const auto first = endpoint->block().epoch;
  stop();
  start();
  EXPECT_NE(endpoint->block().epoch, first);
}

TEST_F(LinkTest, AHandlerThatThrowsIsAnInternalError) {
  start_with_handler([](const Request&) { throw std::runtime_error("no"); });
  RawModbus client(server->port());
  ASSERT_EQ(measure(client, 1), 0);
  const ResultBlock block = client.block();
  EXPECT_EQ(block.code, 901);
  EXPECT_EQ(block.state, LinkState::error);
}

TEST_F(LinkTest, AHandlerMayAnswerAtOnce) {
  start_with_handler([this](const Request& request) { publish(ok_report(request)); });
  RawModbus client(server->port());
  ASSERT_EQ(measure(client, 1), 0);
  EXPECT_TRUE(client.block().has(status_bit::result_valid));
}

// Faults on the wire.

TEST_F(LinkTest, APositionIsWrittenAsABlockOfItsOwn) {
  start();
  RawModbus client(server->port());
  PositionBlock position{2, *to_wire(Convention::kuka, from_six_numbers({1, 2, 3, 4, 5, 6}))};
  auto registers = encode_position(position);
  EXPECT_EQ(client.ask(write_pdu(1100, registers)), (Bytes{16, 4, 76, 0, 20}));
  EXPECT_EQ(client.command({1, 7, 0, 0, 2}), 0);
  const auto request = next_request();
  ASSERT_TRUE(request);
  EXPECT_LT((request->X_RH.translation() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  publish(ok_report(*request));
  registers[18] ^= 1;
  EXPECT_EQ(client.ask(write_pdu(1100, registers)), (Bytes{0x90, 3}));
  EXPECT_EQ(server->counters().wrong_block_crc, 1u);
  expect_clean_cycle(client, 2);
}

// Two robots on one port: each has its own unit id, list, convention and handshake.
TEST_F(LinkTest, EveryUnitIsARobotOfItsOwn) {
  start();
  server.reset();
  EndpointOptions second_options;
  second_options.handshake.convention = Convention::abb;
  second_options.handshake.robot_index = 4;
  std::atomic<int> seconds_requests{0};
  RobotEndpoint second(second_options, [&](const Request&) { ++seconds_requests; });
  second.set_cell_state(ready_cell());
  ModbusTcpRobot second_served;
  second_served.unit.unit = 9;
  second_served.allowed_readers = {"127.0.0.1"};
  server.emplace(options, std::vector<ModbusTcpServer::Served>{{served, *endpoint}, {second_served, second}});
  RawModbus client(server->port());
  expect_clean_cycle(client, 1);
  EXPECT_EQ(client.ask(command_pdu({2, 1, 1, 0, 0}), 9), (Bytes{0x90, 1}));  // a listed reader there
  const Bytes block = client.ask(read_pdu(4, 8, 1), 9);
  EXPECT_EQ(block, (Bytes{4, 2, 0, 4}));
  EXPECT_EQ(seconds_requests, 0);
  client.send(adu(1, read_pdu(4, 0, 61), 2));
  EXPECT_TRUE(client.closed_by_peer());
  EXPECT_EQ(server->counters().wrong_unit, 1u);
  server.reset();
}

TEST_F(LinkTest, AUnitThatAnAddressMayNotReachIsNotAnswered) {
  start();
  server.reset();
  RobotEndpoint second({}, [](const Request&) {});
  ModbusTcpRobot second_served;
  second_served.unit.unit = 9;
  second_served.allowed_writers = {"192.0.2.1"};
  server.emplace(options, std::vector<ModbusTcpServer::Served>{{served, *endpoint}, {second_served, second}});
  RawModbus client(server->port());
  EXPECT_TRUE(client.read_registers());
  client.send(adu(1, read_pdu(4, 0, 61), 9));
  EXPECT_TRUE(client.closed_by_peer());
  server.reset();
}

}  // namespace
}  // namespace zeropose
