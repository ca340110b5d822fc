#include "protocol/modbus_peer.h"

#include <gmock/gmock.h>

#include "tests/support/fake_controller.h"

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
