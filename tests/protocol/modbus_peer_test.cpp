#include "protocol/modbus_peer.h"

#include <gmock/gmock.h>

#include <future>

#include "tests/support/fake_controller.h"
#include "tests/support/raw_rtu.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class ModbusPeerTest : public testing::Test {
 protected:
  ModbusPeerTest() : peer("127.0.0.1", controller.port(), 1, milliseconds(200)) {
    shown.sequence = 9;
    shown.epoch = 1;
    controller.set(0, encode(shown));
  }
  void expect_clean_question() {
    ASSERT_FALSE(peer.connect());
    const BlockAnswer answer = peer.read_block();
    ASSERT_FALSE(answer.failure) << answer.failure->text;
    ASSERT_FALSE(answer.decoded.problem);
    EXPECT_EQ(answer.decoded.block, shown);
  }
  PeerProblem problem_with(const FakeController::Faults& faults) {
    controller.fail(faults);
    const BlockAnswer answer = peer.read_block();
    controller.fail({});
    EXPECT_EQ(answer.decoded.problem, BlockProblem::wrong_length);
    return answer.failure ? answer.failure->problem : PeerProblem::not_connected;
  }

  FakeController controller;
  ResultBlock shown;
  ModbusPeer peer;
};

TEST_F(ModbusPeerTest, ReadsTheBlockAndWritesACommand) {
  EXPECT_EQ(peer.read_block().failure->problem, PeerProblem::not_connected);
  expect_clean_question();
  const Command command{7, 1, 2, 3, -4};
  EXPECT_FALSE(peer.write_command(command));
  EXPECT_EQ(decode_command(controller.get(command_reg::first, command_reg::block_size)), command);
  expect_clean_question();
  EXPECT_EQ(controller.connections(), 1);
}

TEST_F(ModbusPeerTest, ADamagedBlockIsNamed) {
  auto registers = encode(shown);
  registers[20] ^= 1;
  controller.set(0, registers);
  ASSERT_FALSE(peer.connect());
  const BlockAnswer answer = peer.read_block();
  ASSERT_FALSE(answer.failure);
  EXPECT_EQ(answer.decoded.problem, BlockProblem::wrong_crc);
}

TEST_F(ModbusPeerTest, ARefusalKeepsTheConnection) {
  ASSERT_FALSE(peer.connect());
  FakeController::Faults faults;
  faults.refuses_writes = true;
  controller.fail(faults);
  const auto failure = peer.write_command({7, 1, 2, 3, 4});
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->problem, PeerProblem::refused);
  EXPECT_EQ(failure->exception, 2);
  EXPECT_TRUE(peer.connected());
  expect_clean_question();
  EXPECT_EQ(controller.connections(), 1);
}

// The answer to the first question comes while the second is under way, and is not taken for it.
TEST_F(ModbusPeerTest, ALateAnswerIsNotTakenForTheNext) {
  ASSERT_FALSE(peer.connect());
  FakeController::Faults late;
  late.answer_delay = milliseconds(300);
  EXPECT_EQ(problem_with(late), PeerProblem::no_answer);
  EXPECT_FALSE(peer.connected());
  EXPECT_EQ(peer.read_block().failure->problem, PeerProblem::not_connected);
  shown.sequence = 10;
  controller.set(0, encode(shown));
  expect_clean_question();
}

TEST_F(ModbusPeerTest, EveryFaultHasItsNameAndTheNextQuestionIsAnswered) {
  expect_clean_question();
  FakeController::Faults silent, wrong;
  silent.silent = true;
  wrong.wrong_transaction = true;
  EXPECT_EQ(problem_with(silent), PeerProblem::no_answer);
  expect_clean_question();
  EXPECT_EQ(problem_with(wrong), PeerProblem::wrong_answer);
  EXPECT_FALSE(peer.connected());
  expect_clean_question();
  controller.stop();
  EXPECT_EQ(peer.read_block().failure->problem, PeerProblem::connection_lost);
  const auto failure = peer.connect();
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->problem, PeerProblem::cannot_connect);
  EXPECT_THAT(failure->text, HasSubstr("127.0.0.1 port " + std::to_string(controller.port()) + " unit 1"));
  controller.start();
  expect_clean_question();
}

// The test is the slave.
class SerialPeerTest : public testing::Test {
 protected:
  SerialPeerTest() : peer({SerialLine{line.device(), 115200, 'N', 1}, 7, milliseconds(200)}) {}

  static Bytes answer_with(std::uint16_t sequence, std::uint8_t unit = 7) {
    ResultBlock block;
    block.sequence = sequence;
    Bytes pdu{4, 122};
    for (const std::uint16_t value : encode(block)) {
      pdu.push_back(static_cast<std::uint8_t>(value >> 8));
      pdu.push_back(static_cast<std::uint8_t>(value & 0xFF));
    }
    return rtu_frame(pdu, unit);
  }
  BlockAnswer ask(const Bytes& answer) {
    auto question = std::async(std::launch::async, [this] { return peer.read_block(); });
    EXPECT_EQ(line.receive_bytes(8), rtu_frame(read_pdu(4, 0, 61), 7));
    if (!answer.empty()) line.send(answer);
    return question.get();
  }
  void expect_clean_question(std::uint16_t sequence) {
    ASSERT_FALSE(peer.connect());
    const BlockAnswer answer = ask(answer_with(sequence));
    ASSERT_FALSE(answer.failure) << answer.failure->text;
    EXPECT_EQ(answer.decoded.block.sequence, sequence);
  }

  RawRtu line;
  ModbusPeer peer;
};

TEST_F(SerialPeerTest, WrongAnswersAreNamedAndTheNextIsRight) {
  expect_clean_question(1);
  Bytes damaged = answer_with(2);
  damaged[20] ^= 4;
  EXPECT_EQ(ask(damaged).failure->problem, PeerProblem::wrong_answer);
  EXPECT_FALSE(peer.connected());
  expect_clean_question(3);
  EXPECT_EQ(ask(answer_with(4, 8)).failure->problem, PeerProblem::wrong_answer);
  expect_clean_question(5);
  const BlockAnswer refused = ask(rtu_frame({0x84, 2}, 7));
  EXPECT_EQ(refused.failure->problem, PeerProblem::refused);
  EXPECT_EQ(refused.failure->exception, 2);
  EXPECT_TRUE(peer.connected());
  expect_clean_question(6);
}

// On a line an answer names no question: the late one has the right unit, function, length and CRC.
TEST_F(SerialPeerTest, ALateAnswerIsNotTakenForTheNext) {
  expect_clean_question(1);
  EXPECT_EQ(ask({}).failure->problem, PeerProblem::no_answer);
  auto connecting = std::async(std::launch::async, [this] { return peer.connect(); });
  line.send(answer_with(2));
  ASSERT_FALSE(connecting.get());
  expect_clean_question(3);
}

TEST_F(SerialPeerTest, ALostDeviceIsNamed) {
  expect_clean_question(1);
  line.unplug();
  EXPECT_EQ(peer.read_block().failure->problem, PeerProblem::connection_lost);
  EXPECT_EQ(peer.connect()->problem, PeerProblem::cannot_connect);
  line.plug_in();
  expect_clean_question(2);
}

TEST(ModbusPeerOptions, OutOfRangeAreNamed) {
  const auto refusal = [](const ModbusPeerOptions& options) -> std::string {
    try {
      ModbusPeer never(options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal({ModbusTcpAddress{"robot", 502}}), HasSubstr("\"robot\" is no numeric IPv4 address"));
  EXPECT_THAT(refusal({ModbusTcpAddress{"127.0.0.1", 0}}), HasSubstr("port 0"));
  EXPECT_THAT(refusal({ModbusTcpAddress{}, 248}), HasSubstr("unit 248"));
  EXPECT_THAT(refusal({SerialLine{}, 0}), HasSubstr("unit 0"));
  EXPECT_THAT(refusal({SerialLine{"/dev/x", 12345}}), HasSubstr("12345"));
  EXPECT_THAT(refusal({SerialLine{"/dev/x", 9600, 'E', 3}}), HasSubstr("stop bits"));
  EXPECT_THAT(refusal({SerialLine{""}}), HasSubstr("no device"));
  EXPECT_THAT(refusal({ModbusTcpAddress{}, 1, milliseconds(0)}), HasSubstr("time-out"));
}

}  // namespace
}  // namespace zeropose
