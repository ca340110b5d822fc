// Clients that are slow, wrong, foreign or too many.
#include "protocol/modbus_server.h"

#include <gmock/gmock.h>

#include <random>

#include "tests/protocol/link_fixture.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

TEST_F(LinkTest, HalfAFrameStallsNobodyAndIsClosed) {
  options.frame_time = milliseconds(150);
  start();
  RawModbus half(server->port()), robot(server->port());
  const Bytes whole = adu(1, command_pdu({5, 1, 1, 0, 0}));
  half.send(Bytes(whole.begin(), whole.begin() + 11));
  expect_clean_cycle(robot, 1);
  EXPECT_TRUE(half.closed_by_peer());
  EXPECT_EQ(server->counters().closed_slow, 1u);
  expect_clean_cycle(robot, 2);
}

TEST_F(LinkTest, AClientSendingAByteNowAndThenIsClosed) {
  options.frame_time = milliseconds(200);
  start();
  RawModbus slow(server->port()), robot(server->port());
  const Bytes whole = adu(1, command_pdu({5, 1, 1, 0, 0}));
  std::size_t sent = 0;
  wait_until([&] {
    if (sent < whole.size() - 1 && sent % 2 == 0) slow.send({whole[sent / 2]});
    ++sent;
    std::this_thread::sleep_for(milliseconds(10));
    return server->counters().closed_slow == 1;
  });
  EXPECT_TRUE(slow.closed_by_peer());
  EXPECT_TRUE(requests.empty());
  expect_clean_cycle(robot, 1);
}

TEST_F(LinkTest, AClientThatTakesNoAnswersIsClosed) {
  options.frame_time = milliseconds(200);
  start();
  RawModbus deaf(server->port()), robot(server->port());
  Bytes flood;
  for (std::uint16_t i = 0; i < 50; ++i) {
    const Bytes request = adu(i, read_pdu(4, 0, 61));
    flood.insert(flood.end(), request.begin(), request.end());
  }
  std::atomic<bool> closed{false};
  std::thread sender([&] {
    while (!closed) deaf.send(flood);
  });
  wait_until([&] { return server->counters().closed_slow == 1; });
  closed = true;
  sender.join();
  expect_clean_cycle(robot, 1);
}

TEST_F(LinkTest, TwoRequestsInOneSegment) {
  start();
  RawModbus client(server->port());
  Bytes both = adu(1, read_pdu(4, 0, 61));
  const Bytes second = adu(2, read_pdu(4, 30, 2));
  both.insert(both.end(), second.begin(), second.end());
  client.send(both);
  EXPECT_EQ(client.receive().size(), 9u + 122u);
  EXPECT_EQ(client.receive().size(), 9u + 4u);
}

TEST_F(LinkTest, TwoCommandsInOneSegmentAreOneRequest) {
  start();
  RawModbus client(server->port());
  recorder.requested(1);
  Bytes both = adu(1, command_pdu({1, 1, 1, 0, 0}));
  const Bytes second = adu(2, command_pdu({2, 1, 1, 0, 0}));
  both.insert(both.end(), second.begin(), second.end());
  client.send(both);
  EXPECT_EQ(client.receive().at(7), 16);
  EXPECT_EQ(client.receive().at(7), 0x90);
  publish(ok_report(*next_request()));
  EXPECT_EQ(client.block().request_id, 1u);
  const std::scoped_lock lock(mutex);
  EXPECT_TRUE(requests.empty());
}

TEST_F(LinkTest, ASecondRequestHiddenInAFrameIsNotExecuted) {
  start();
  RawModbus client(server->port());
  Bytes pdu = read_pdu(4, 0, 61);
  const Bytes hidden = adu(2, command_pdu({5, 1, 1, 0, 0}));
  pdu.insert(pdu.end(), hidden.begin(), hidden.end());
  client.send(adu(1, pdu));
  EXPECT_TRUE(client.closed_by_peer());
  EXPECT_EQ(server->counters().wrong_pdu, 1u);
  EXPECT_EQ(endpoint->counters().accepted, 0u);
}

TEST_F(LinkTest, WrongProtocolLengthAndUnitAreClosedWithoutAByte) {
  start();
  const std::vector<Bytes> wrong = {{0, 1, 0, 1, 0, 6, 1, 4, 0, 0, 0, 61},
                                    {0, 1, 0, 0, 0, 255, 1, 4, 0, 0, 0, 61},
                                    {0, 1, 0, 0, 0, 6, 9, 4, 0, 0, 0, 61}};
  for (const Bytes& bytes : wrong) {
    RawModbus client(server->port());
    client.send(bytes);
    EXPECT_TRUE(client.closed_by_peer());
  }
  const ModbusCounters counters = server->counters();
  EXPECT_EQ(counters.wrong_protocol, 1u);
  EXPECT_EQ(counters.wrong_length, 1u);
  EXPECT_EQ(counters.wrong_unit, 1u);
  RawModbus robot(server->port());
  expect_clean_cycle(robot, 1);
}

TEST_F(LinkTest, RandomBytesChangeNothing) {
  start();
  RawModbus robot(server->port());
  const ResultBlock before = robot.block();
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    RawModbus client(server->port());
    Bytes bytes = adu(1, i % 2 ? command_pdu({5, 1, 1, 0, 0}) : read_pdu(4, 0, 61));
    for (int k = 0; k < 3; ++k)
      bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
    if (i % 3 == 0) bytes.resize(random() % bytes.size());
    client.send(bytes);
  }
  wait_until([&] { return server->counters().clients == 1; });
  EXPECT_EQ(robot.block(), before);
  expect_clean_cycle(robot, 1);
}

// Who may come.

TEST_F(LinkTest, AddressesThatAreNotListedGetNoByte) {
  served.allowed_writers = {"192.0.2.1"};
  start();
  RawModbus stranger(server->port());
  stranger.send(adu(1, read_pdu(4, 0, 61)));
  EXPECT_TRUE(stranger.closed_by_peer());
  EXPECT_EQ(server->counters().refused_address, 1u);
  EXPECT_EQ(server->counters().requests, 0u);
}

TEST_F(LinkTest, ListedReadersReadAndNeverWrite) {
  served.allowed_readers = {"127.0.0.1"};
  start();
  RawModbus reader(server->port());
  EXPECT_TRUE(reader.read_registers());
  EXPECT_EQ(reader.command({1, 1, 1, 0, 0}), 1);
  EXPECT_EQ(reader.ask({6, 3, 232, 0, 1}), (Bytes{0x86, 1}));
  EXPECT_EQ(server->counters().writes_by_readers, 2u);
  EXPECT_EQ(endpoint->counters().accepted, 0u);
}

TEST_F(LinkTest, ConnectionLimit) {
  options.max_clients = 2;
  options.frame_time = milliseconds(500);
  start();
  RawModbus robot(server->port());
  expect_clean_cycle(robot, 1);
  RawModbus second(server->port());
  EXPECT_TRUE(second.read_registers());
  RawModbus third(server->port());
  EXPECT_TRUE(third.closed_by_peer());
  EXPECT_EQ(server->counters().refused_full, 1u);
  // One that has been silent for a while makes room; the owner does not.
  std::this_thread::sleep_for(milliseconds(600));
  RawModbus fourth(server->port());
  EXPECT_TRUE(fourth.read_registers());
  EXPECT_TRUE(second.closed_by_peer());
  EXPECT_EQ(server->counters().evicted, 1u);
  expect_clean_cycle(robot, 2);
}

std::string failure_of(const ModbusServerOptions& options, const ModbusTcpRobot& robot = {}) {
  try {
    RobotEndpoint endpoint({}, [](const Request&) {});
    ModbusTcpServer server(options, {{robot, endpoint}});
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST_F(LinkTest, AnAddressInUseIsNamedWithARemedy) {
  start();
  options.port = server->port();
  const std::string message = failure_of(options);
  EXPECT_THAT(message, HasSubstr("127.0.0.1 port " + std::to_string(options.port)));
  EXPECT_THAT(message, HasSubstr("another program listens there"));
}

TEST_F(LinkTest, BadOptionsAreNamed) {
  options.address = "192.0.2.1";
  EXPECT_THAT(failure_of(options), HasSubstr("192.0.2.1"));
  options.address = "robot";
  EXPECT_THAT(failure_of(options), HasSubstr("\"robot\" is no numeric IPv4 address"));
  options.address = "127.0.0.1";
  served.allowed_writers = {"10.0.0.256"};
  EXPECT_THAT(failure_of(options, served), HasSubstr("10.0.0.256"));
  options.max_clients = 0;
  EXPECT_THAT(failure_of(options), HasSubstr("max_clients"));
}

// A robot that is on the list finds its place, however many others are there (127.0.0.0/8 is all loopback).
TEST_F(LinkTest, AListedWriterHasItsPlaceReserved) {
  options.max_clients = 3;
  served.allowed_writers = {"127.0.0.2", "127.0.0.3"};
  served.allowed_readers = {"127.0.0.1"};
  start();
  RawModbus first(server->port());
  EXPECT_TRUE(first.read_registers());
  RawModbus refused(server->port());
  EXPECT_TRUE(refused.closed_by_peer());
  EXPECT_EQ(server->counters().refused_full, 1u);
  RawModbus robot(server->port(), "127.0.0.1", "127.0.0.2"), other(server->port(), "127.0.0.1", "127.0.0.3");
  expect_clean_cycle(robot, 1);
  expect_clean_cycle(other, 2);
  EXPECT_EQ(server->counters().clients, 3u);
}

TEST_F(LinkTest, MorePlacesThanListedWriters) {
  options.max_clients = 1;
  served.allowed_writers = {"127.0.0.2", "127.0.0.3"};
  EXPECT_THAT(failure_of(options, served),
              HasSubstr("max_clients must be at least 1 and hold every listed writer, 2"));
}

}  // namespace
}  // namespace zeropose
