#include "protocol/rtu_framing.h"

#include <gtest/gtest.h>

#include <random>

#include "protocol/serial_line.h"
#include "tests/support/raw_rtu.h"

namespace zeropose {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

std::optional<RtuProblem> problem_of(const Bytes& frame, std::uint8_t unit = 1) {
  return decode_rtu(frame, unit).problem;
}

TEST(RtuFraming, CrcOfTheBook) {
  const std::string text = "123456789";
  EXPECT_EQ(crc16_modbus(Bytes(text.begin(), text.end())), 0x4B37);
  EXPECT_EQ(rtu_frame({7}, 2), (Bytes{0x02, 0x07, 0x41, 0x12}));  // the example of the specification
}

TEST(RtuFraming, ARequestBecomesAnAdu) {
  const RtuFrame frame = decode_rtu(rtu_frame(command_pdu({7, 1, 2, 3, -4}), 17), 17);
  ASSERT_FALSE(frame.problem);
  EXPECT_EQ(frame.request.bytes[6], 17);
  EXPECT_EQ(frame.request.size, 7u + 26u);
  EXPECT_EQ(frame.request.word(4), 27);
  EXPECT_EQ(rule(frame.request, true).kind, Ruling::Kind::command);
  EXPECT_EQ(decode_command(written_registers(frame.request)), (Command{7, 1, 2, 3, -4}));
  EXPECT_EQ(encode_rtu(frame.request.view()), rtu_frame(command_pdu({7, 1, 2, 3, -4}), 17));
}

TEST(RtuFraming, WhatIsNotForUsOrNoRequest) {
  const Bytes read = read_pdu(4, 0, 61);
  EXPECT_FALSE(problem_of(rtu_frame(read)));
  EXPECT_FALSE(problem_of(rtu_frame({5, 0, 0, 255, 0})));  // to be refused with an exception
  EXPECT_EQ(problem_of(rtu_frame(read, 2)), RtuProblem::other_unit);
  EXPECT_EQ(problem_of(rtu_frame(read, 0)), RtuProblem::broadcast);
  EXPECT_EQ(problem_of({1, 4, 0}), RtuProblem::wrong_length);
  EXPECT_EQ(problem_of({}), RtuProblem::wrong_length);
  EXPECT_EQ(problem_of(Bytes(257, 1)), RtuProblem::wrong_length);
  EXPECT_EQ(problem_of(rtu_frame({4, 0, 0, 0})), RtuProblem::wrong_pdu);
  EXPECT_EQ(problem_of(rtu_frame({4, 0, 0, 0, 61, 0})), RtuProblem::wrong_pdu);
  // Our own answers, as an adapter with echo brings them back.
  EXPECT_EQ(problem_of(rtu_frame({0x85, 1})), RtuProblem::wrong_pdu);
  EXPECT_EQ(problem_of(rtu_frame({16, 3, 232, 0, 10})), RtuProblem::wrong_pdu);
  Bytes answer{4, 122};
  answer.resize(124);
  EXPECT_EQ(problem_of(rtu_frame(answer)), RtuProblem::wrong_pdu);
}

TEST(RtuFraming, UpToThreeWrongBitsAreAlwaysSeen) {
  std::mt19937 random(1);
  const Bytes good = rtu_frame(command_pdu({7, 1, 2, 3, -4}));
  for (int i = 0; i < 100'000; ++i) {
    Bytes bad = good;
    for (int n = 1 + i % 3; n > 0; --n)
      bad[random() % bad.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    if (bad == good) continue;
    EXPECT_EQ(problem_of(bad), RtuProblem::wrong_crc);
  }
}

class RtuReaderTest : public testing::Test {
 protected:
  RtuReader reader{1, microseconds(2000), microseconds(0)};
  RtuReader patient{1, microseconds(2000), microseconds(20000)};
  TimePoint now = TimePoint() + std::chrono::hours(1);
  Bytes frame = rtu_frame(command_pdu({7, 1, 2, 3, 4}));

  Bytes part(std::size_t from, std::size_t to) const {
    return {frame.begin() + static_cast<std::ptrdiff_t>(from),
            frame.begin() + static_cast<std::ptrdiff_t>(to)};
  }
};

TEST_F(RtuReaderTest, OneFramePerSilence) {
  EXPECT_FALSE(reader.frame_end());
  EXPECT_FALSE(reader.take(now));
  for (const std::uint8_t byte : frame) reader.feed(Bytes{byte}, now += microseconds(1999));
  EXPECT_FALSE(reader.take(now + microseconds(1999)));
  EXPECT_EQ(reader.frame_end(), now + microseconds(2000));
  const auto taken = reader.take(now + microseconds(2000));
  ASSERT_TRUE(taken);
  EXPECT_FALSE(taken->problem);
  EXPECT_FALSE(reader.take(now + microseconds(4000)));
}

TEST_F(RtuReaderTest, TwoFramesWithoutASilenceAreNone) {
  reader.feed(frame, now);
  reader.feed(frame, now + microseconds(100));
  EXPECT_EQ(reader.take(now + milliseconds(5))->problem, RtuProblem::wrong_crc);
  reader.feed(frame, now + milliseconds(10));
  EXPECT_FALSE(reader.take(now + milliseconds(15))->problem);
}

TEST_F(RtuReaderTest, TooMuchIsNotKeptAndStaysTooLong) {
  for (int i = 0; i < 1000; ++i) reader.feed(frame, now);
  EXPECT_EQ(reader.take(now + milliseconds(5))->problem, RtuProblem::wrong_length);
  EXPECT_FALSE(reader.frame_end());
}

TEST_F(RtuReaderTest, AGapEndsAFrameUnlessItIsTolerated) {
  reader.feed(part(0, 10), now);
  patient.feed(part(0, 10), now);
  now += milliseconds(10);
  EXPECT_TRUE(reader.take(now)->problem);
  EXPECT_FALSE(patient.take(now));
  patient.feed(part(10, frame.size()), now);
  EXPECT_FALSE(patient.take(now + microseconds(1999)));
  const auto taken = patient.take(now + microseconds(2000));  // whole: not waited for any longer
  ASSERT_TRUE(taken);
  EXPECT_FALSE(taken->problem);
  patient.feed(part(0, 10), now += milliseconds(30));
  EXPECT_TRUE(patient.take(now + milliseconds(20))->problem);
}

TEST(SerialLine, TheSilenceIsThatOfTheSpecification) {
  EXPECT_EQ(character_time({"x", 9600, 'E', 1}), microseconds(1146));
  EXPECT_EQ(frame_silence({"x", 9600, 'E', 1}), microseconds(4011));
  EXPECT_EQ(frame_silence({"x", 19200, 'N', 1}), microseconds(1823));
  EXPECT_EQ(frame_silence({"x", 38400, 'N', 1}), microseconds(1750));
  EXPECT_EQ(frame_silence({"x", 921600, 'O', 2}), microseconds(1750));
}

}  // namespace
}  // namespace zeropose
