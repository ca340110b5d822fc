// Every field of the CAN frames by its bytes, and a robot that takes a result only whole.
#include <gtest/gtest.h>

#include "protocol/can_collector.h"
#include "protocol/crc32.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Bytes = std::vector<std::uint8_t>;

CanCoding coding_of_node(std::uint32_t node = 5) {
  CanCoding coding;
  coding.node = node;
  return coding;
}

Bytes bytes_of(const CanFrame& frame) { return {frame.bytes().begin(), frame.bytes().end()}; }

CanFrame frame_with(std::uint32_t id, const Bytes& bytes) {
  CanFrame frame;
  frame.id = id;
  frame.size = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

// x 12.34 mm, y -5 mm, z 0.01 mm, 1 deg, -2 deg, 0.001 deg.
ResultBlock valid_block() {
  ResultBlock block;
  block.epoch = 0xA1B2C3D4;
  block.request_id = 0x1234;
  block.status = status_bit::ready | status_bit::exposure_done | status_bit::result_valid;
  block.values = {12340, -5000, 10, 10000, -20000, 10, invalid_value, invalid_value};
  block.age_ms = 0x0102;
  block.validity_ms = 2000;
  block.effective_marks = 12;
  block.effective_cameras = 4;
  return block;
}

TEST(CanCodec, CommandByItsBytes) {
  const CanFrame frame = frame_with(0x205, {0x34, 0x12, 0x01, 0x07, 0x04, 0x03, 0x02, 0x01});
  const Command command{0x1234, 1, 7, 0x01020304, 0};
  EXPECT_EQ(decode_can_command(frame, 5), command);
  EXPECT_EQ(encode_can_command(command, 5), frame);
}

TEST(CanCodec, ZeroTakesThePartAsItsGuard) {
  const CanFrame frame = frame_with(0x205, {0x02, 0x00, 0x03, 0x01, 0x4F, 0x52, 0x45, 0x5A});
  const Command command{2, 3, 1, 0, zero_guard};
  EXPECT_EQ(decode_can_command(frame, 5), command);
  EXPECT_EQ(encode_can_command(command, 5), frame);
}

TEST(CanCodec, OnlyEightPlainBytesAreACommand) {
  const CanFrame good = frame_with(0x205, {1, 0, 1, 1, 0, 0, 0, 0});
  ASSERT_TRUE(decode_can_command(good, 5));
  EXPECT_FALSE(decode_can_command(good, 6));
  for (std::uint8_t size = 0; size <= 64; ++size) {
    CanFrame frame = good;
    frame.size = size;
    EXPECT_EQ(decode_can_command(frame, 5).has_value(), size == 8) << int{size};
  }
  for (bool CanFrame::*flag : {&CanFrame::extended, &CanFrame::remote, &CanFrame::error}) {
    CanFrame frame = good;
    frame.*flag = true;
    EXPECT_FALSE(decode_can_command(frame, 5));
  }
}

TEST(CanCodec, ResultByItsBytes) {
  const auto frames = encode_can_result(valid_block(), coding_of_node());
  EXPECT_EQ(frames[0].id, 0x185u);
  EXPECT_EQ(frames[1].id, 0x285u);
  EXPECT_EQ(frames[2].id, 0x385u);
  // 1234 and -500 steps of 10 um, 1; 1000, -2000 steps of 0.001 deg, 1.
  EXPECT_EQ(bytes_of(frames[0]), (Bytes{0x34, 0x12, 0xD2, 0x04, 0x0C, 0xFE, 0x01, 0x00}));
  EXPECT_EQ(bytes_of(frames[1]), (Bytes{0x34, 0x12, 0xE8, 0x03, 0x30, 0xF8, 0x01, 0x00}));
  const Bytes covered = {0x50, 0x5A, 0x34, 0x12, 0xD2, 0x04, 0x0C, 0xFE, 0x01, 0x00, 0x34, 0x12, 0xE8,
                         0x03, 0x30, 0xF8, 0x01, 0x00, 0x34, 0x12, 0x00, 0x04, 0xD4, 0xC3, 0xB2, 0xA1};
  const std::uint32_t crc = crc32_autosar(covered);
  Bytes commit = {0x34, 0x12, 0x00, 0x04};
  for (int i = 0; i < 4; ++i) commit.push_back(static_cast<std::uint8_t>(crc >> (8 * i)));
  EXPECT_EQ(bytes_of(frames[2]), commit);
  EXPECT_EQ(crc, 0x0BC20A30u);  // computed bit by bit by another program
}

TEST(CanCodec, StatusHasSixBitsAndTheCodeTen) {
  struct Case {
    std::uint16_t status, code, expected;
  };
  const Case cases[] = {{0, 0, 0x0000},
                        {status_bit::ready | status_bit::exposure_done, 0, 0x0000},
                        {status_bit::result_valid, 0, 1 << 10},
                        {status_bit::not_ok, 507, (2 << 10) | 507},
                        {status_bit::busy, 0, 4 << 10},
                        {status_bit::error | status_bit::not_ok, 901, (10 << 10) | 901},
                        {status_bit::simulated, 0, 16 << 10},
                        {status_bit::zero_missing, 0, 32 << 10},
                        {status_bit::camera_moved, 0, 32 << 10},
                        {status_bit::all, 1023, 0xFFFF},
                        {0, 5000, 0x03FF}};
  for (const Case& c : cases) {
    ResultBlock block = valid_block();
    block.status = c.status;
    block.code = c.code;
    EXPECT_EQ(get_le(encode_can_result(block, coding_of_node())[2].data, 2, 2), c.expected) << c.status;
  }
}

TEST(CanCodec, WithoutValidEveryValueIsInvalid) {
  ResultBlock block = valid_block();
  block.status = status_bit::not_ok;
  const auto frames = encode_can_result(block, coding_of_node());
  const Bytes invalid = {0x34, 0x12, 0x00, 0x80, 0x00, 0x80, 0x00, 0x80};
  EXPECT_EQ(bytes_of(frames[0]), invalid);
  EXPECT_EQ(bytes_of(frames[1]), invalid);
  const auto fd = decode_can_fd_result(encode_can_fd_result(block, coding_of_node()), coding_of_node());
  ASSERT_TRUE(fd);
  for (const std::int32_t value : fd->values) EXPECT_EQ(value, invalid_value);
}

TEST(CanCodec, EachValueAtItsLimitAndOneStepBeyond) {
  for (std::size_t i = 0; i < can_value_count; ++i) {
    for (const int sign : {1, -1}) {
      ResultBlock block = valid_block();
      block.values[i] = sign * 327670;
      EXPECT_EQ(fit_to_can(block, coding_of_node()), block);
      EXPECT_EQ((*to_can_values(block.values, coding_of_node()))[i], sign * 32767);
      block.values[i] = sign * 327674;  // rounds to the same step
      EXPECT_EQ((*to_can_values(block.values, coding_of_node()))[i], sign * 32767);
      block.values[i] = sign * 327680;
      EXPECT_FALSE(to_can_values(block.values, coding_of_node()));
      const ResultBlock fitted = fit_to_can(block, coding_of_node());
      EXPECT_EQ(fitted.code, 507);
      EXPECT_TRUE(fitted.has(status_bit::not_ok));
      EXPECT_FALSE(fitted.has(status_bit::result_valid));
      EXPECT_EQ(fitted.values, no_values);
    }
  }
}

TEST(CanCodec, ScalesAreFree) {
  CanCoding coding = coding_of_node();
  coding.length_scale = 100;
  coding.angle_scale = 1;
  const auto values = to_can_values(valid_block().values, coding);
  ASSERT_TRUE(values);
  EXPECT_EQ(*values, (CanValues{123, -50, 0, 10000, -20000, 10}));
}

TEST(CanCodec, AnAnswerToALongIdIsNone) {
  ResultBlock block = valid_block();
  block.request_id = 0x00011234;
  const ResultBlock fitted = fit_to_can(block, coding_of_node());
  EXPECT_EQ(fitted.request_id, 0u);
  EXPECT_FALSE(fitted.has(status_bit::result_valid));
  EXPECT_EQ(fitted.values, no_values);
}

TEST(CanCodec, FdResultByItsBytes) {
  ResultBlock block = valid_block();
  block.code = 0x0203;
  block.effective_marks = 300;  // saturates
  const CanFrame frame = encode_can_fd_result(block, coding_of_node());
  EXPECT_EQ(frame.id, 0x485u);
  EXPECT_TRUE(frame.fd);
  const Bytes expected = {0x34, 0x12, 0x00, 0x00, 0xD4, 0xC3, 0xB2, 0xA1, 0x03, 0x02, 0x0D,
                          0x00, 0x34, 0x30, 0x00, 0x00, 0x78, 0xEC, 0xFF, 0xFF, 0x0A, 0x00,
                          0x00, 0x00, 0x10, 0x27, 0x00, 0x00, 0xE0, 0xB1, 0xFF, 0xFF, 0x0A,
                          0x00, 0x00, 0x00, 0x02, 0x01, 0xD0, 0x07, 0xFF, 0x04, 0x00, 0x00};
  const Bytes bytes = bytes_of(frame);
  ASSERT_EQ(bytes.size(), 48u);
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 44), expected);
  const auto decoded = decode_can_fd_result(frame, coding_of_node());
  ASSERT_TRUE(decoded);
  EXPECT_EQ(
      *decoded,
      (CanFdResult{
          0x1234, 0xA1B2C3D4, 0x0203, 13, {12340, -5000, 10, 10000, -20000, 10}, 0x0102, 2000, 255, 4}));
}

TEST(CanCodec, EveryFlippedBitOfAnFdResultIsSeen) {
  const CanFrame good = encode_can_fd_result(valid_block(), coding_of_node());
  for (std::size_t bit = 0; bit < 48 * 8; ++bit) {
    CanFrame bad = good;
    bad.data[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    EXPECT_FALSE(decode_can_fd_result(bad, coding_of_node())) << bit;
  }
  EXPECT_FALSE(decode_can_fd_result(good, coding_of_node(6)));
  CanCoding other = coding_of_node();
  other.data_id = 0x5A52;
  EXPECT_FALSE(decode_can_fd_result(good, other));
}

TEST(CanCodec, ConventionsThatFit) {
  for (const Convention convention : all_conventions())
    EXPECT_EQ(fits_can(convention), convention != Convention::abb && convention != Convention::matrix);
}

class CanCollector : public testing::Test {
 protected:
  CanCollector() { collector.expect(0x1234, 0xA1B2C3D4); }

  std::array<CanFrame, 3> frames_of(const ResultBlock& block) { return encode_can_result(block, coding); }
  std::optional<CanResult> take(std::span<const CanFrame> frames) {
    std::optional<CanResult> result;
    for (const CanFrame& frame : frames)
      if (const auto taken = collector.take(frame, now)) result = taken;
    return result;
  }
  // The last word of each test that refuses something.
  void expect_taken() {
    const auto result = take(frames_of(valid_block()));
    ASSERT_TRUE(result);
    EXPECT_EQ(*result, (CanResult{0x1234, can_status::valid, 0, {1234, -500, 1, 1000, -2000, 1}}));
  }

  CanCoding coding = coding_of_node();
  CanResultCollector collector{coding};
  TimePoint now = TimePoint() + std::chrono::hours(1);
};

TEST_F(CanCollector, TakesAResultOnce) {
  expect_taken();
  EXPECT_FALSE(take(frames_of(valid_block())));
}

TEST_F(CanCollector, BusyIsNoAnswer) {
  ResultBlock block = valid_block();
  block.status = status_bit::busy;
  EXPECT_FALSE(take(frames_of(block)));
  expect_taken();
}

TEST_F(CanCollector, NotOkIsAnAnswer) {
  ResultBlock block = valid_block();
  block.status = status_bit::not_ok;
  block.code = 301;
  const auto result = take(frames_of(block));
  ASSERT_TRUE(result);
  EXPECT_EQ(*result, (CanResult{0x1234, can_status::not_ok, 301, no_can_values}));
}

TEST_F(CanCollector, RefusesWhatIsMixed) {
  ResultBlock other = valid_block();
  other.values[0] += 10;
  ResultBlock foreign = valid_block();
  foreign.request_id = 0x1235;
  for (const ResultBlock& second : {other, foreign}) {
    const auto ours = frames_of(valid_block()), theirs = frames_of(second);
    for (unsigned mask = 1; mask < 8; ++mask) {
      std::array<CanFrame, 3> mixed;
      for (std::size_t i = 0; i < 3; ++i) mixed[i] = mask & (1u << i) ? theirs[i] : ours[i];
      // Frames that are the same in both are no mixture.
      if (mixed == ours || mixed == theirs) continue;
      EXPECT_FALSE(take(mixed)) << mask;
    }
  }
  EXPECT_FALSE(take(frames_of(foreign)));
  expect_taken();
}

TEST_F(CanCollector, RefusesWhatIsIncompleteOrOutOfOrder) {
  const auto f = frames_of(valid_block());
  for (const auto& some : std::vector<std::vector<CanFrame>>{
           {f[0], f[2]}, {f[1], f[2]}, {f[2]}, {f[1], f[0], f[2]}, {f[2], f[0], f[1]}, {f[0], f[1]}})
    EXPECT_FALSE(take(some));
  collector.expect(0x1234, 0xA1B2C3D4);
  expect_taken();
}

TEST_F(CanCollector, RefusesAnotherEpochNodeOrDataId) {
  ResultBlock old = valid_block();
  --old.epoch;
  EXPECT_FALSE(take(frames_of(old)));
  coding.node = 6;
  EXPECT_FALSE(take(frames_of(valid_block())));
  coding = coding_of_node();
  coding.data_id = 0x5A52;
  EXPECT_FALSE(take(frames_of(valid_block())));
  coding = coding_of_node();
  expect_taken();
}

TEST_F(CanCollector, ThreeFramesWithinFiftyMilliseconds) {
  const auto f = frames_of(valid_block());
  collector.take(f[0], now);
  collector.take(f[1], now + milliseconds(20));
  EXPECT_FALSE(collector.take(f[2], now + milliseconds(51)));
  collector.take(f[0], now);
  collector.take(f[1], now + milliseconds(50));
  EXPECT_TRUE(collector.take(f[2], now + milliseconds(50)));
}

TEST_F(CanCollector, EveryFlippedBitIsSeen) {
  const auto good = frames_of(valid_block());
  for (std::size_t bit = 0; bit < 3 * 64; ++bit) {
    auto bad = good;
    bad[bit / 64].data[bit % 64 / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    EXPECT_FALSE(take(bad)) << bit;
  }
  expect_taken();
}

TEST_F(CanCollector, LooksOnlyAtPlainFramesOfEightBytes) {
  const auto good = frames_of(valid_block());
  for (std::size_t i = 0; i < 3; ++i) {
    for (bool CanFrame::*flag : {&CanFrame::extended, &CanFrame::remote, &CanFrame::error, &CanFrame::fd}) {
      auto bad = good;
      bad[i].*flag = true;
      EXPECT_FALSE(take(bad));
      collector.expect(0x1234, 0xA1B2C3D4);
    }
    auto bad = good;
    bad[i].size = 7;
    EXPECT_FALSE(take(bad));
  }
  expect_taken();
}

TEST_F(CanCollector, WithoutARequestNothingCounts) {
  CanResultCollector idle(coding);
  for (const CanFrame& frame : frames_of(valid_block())) EXPECT_FALSE(idle.take(frame, now));
}

}  // namespace
}  // namespace zeropose
