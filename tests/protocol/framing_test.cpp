#include "protocol/modbus_framing.h"

#include <gtest/gtest.h>

#include <random>

#include "protocol/modbus_reply.h"
#include "tests/support/raw_modbus.h"

namespace zeropose {
namespace {

Bytes read_block(std::uint16_t transaction = 7) { return adu(transaction, read_pdu(4, 0, 61)); }

std::optional<FrameProblem> problem_of(const Bytes& bytes) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(bytes);
  while (reader.next()) continue;
  return reader.problem();
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(Framing, AWholeRequest) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(read_block());
  const auto request = reader.next();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->size, 12u);
  EXPECT_EQ(request->function(), 4);
  EXPECT_EQ(request->address(), 0);
  EXPECT_EQ(request->quantity(), 61);
  EXPECT_FALSE(reader.next());
  EXPECT_FALSE(reader.has_partial_frame());
}

TEST(Framing, ByteByByte) {
  const Bytes bytes = adu(1, command_pdu({5, 1, 1, 2, 3}));
  FrameReader reader(UnitSet().set(1));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    EXPECT_FALSE(reader.next()) << i;
    EXPECT_EQ(reader.has_partial_frame(), i > 0);
    reader.feed(std::span(bytes).subspan(i, 1));
  }
  const auto request = reader.next();
  ASSERT_TRUE(request);
  EXPECT_EQ(decode_command(written_registers(*request)), (Command{5, 1, 1, 2, 3}));
}

TEST(Framing, TwoRequestsInOneSegmentAreTwoFrames) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(joined({read_block(1), read_block(2), {0, 3, 0}}));
  EXPECT_EQ(reader.next()->word(0), 1);
  EXPECT_EQ(reader.next()->word(0), 2);
  EXPECT_FALSE(reader.next());
  EXPECT_TRUE(reader.has_partial_frame());
  EXPECT_FALSE(reader.problem());
}

TEST(Framing, ASecondRequestInsideOneFrameIsRefused) {
  Bytes hidden = adu(1, joined({read_pdu(4, 0, 61), command_pdu({5, 1, 1, 0, 0})}));
  EXPECT_EQ(problem_of(hidden), FrameProblem::wrong_pdu);
  hidden = adu(1, joined({command_pdu({5, 1, 1, 0, 0}), read_pdu(4, 0, 61)}));
  EXPECT_EQ(problem_of(hidden), FrameProblem::wrong_pdu);
}

TEST(Framing, WrongHeadersAreSeenAsSoonAsTheyAreThere) {
  EXPECT_EQ(problem_of({0, 1, 0, 1}), FrameProblem::wrong_protocol);
  EXPECT_EQ(problem_of({0, 1, 1, 0}), FrameProblem::wrong_protocol);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 1}), FrameProblem::wrong_length);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 0}), FrameProblem::wrong_length);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 255}), FrameProblem::wrong_length);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 1, 0}), FrameProblem::wrong_length);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 254}), std::nullopt);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 6, 2}), FrameProblem::wrong_unit);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 6, 0}), FrameProblem::wrong_unit);
  EXPECT_EQ(problem_of({0, 1, 0, 0, 0, 6, 255}), FrameProblem::wrong_unit);
}

TEST(Framing, LengthMustFitTheFunction) {
  for (const std::uint8_t function : std::initializer_list<std::uint8_t>{3, 4})
    for (std::size_t size = 1; size < 12; ++size) {
      Bytes pdu = read_pdu(function, 0, 61);
      pdu.resize(size);
      EXPECT_EQ(problem_of(adu(1, pdu)).has_value(), size != 5) << size;
    }
  const Bytes good = command_pdu({5, 1, 1, 0, 0});
  for (std::size_t size = 1; size < 40; ++size) {
    Bytes pdu = good;
    pdu.resize(size);
    EXPECT_EQ(problem_of(adu(1, pdu)).has_value(), size != good.size()) << size;
  }
  Bytes count_lies = good;
  count_lies[4] = 9;  // nine registers, twenty bytes
  EXPECT_EQ(problem_of(adu(1, count_lies)), FrameProblem::wrong_pdu);
  Bytes byte_count_lies = good;
  byte_count_lies[5] = 18;
  EXPECT_EQ(problem_of(adu(1, byte_count_lies)), FrameProblem::wrong_pdu);
  EXPECT_EQ(problem_of(adu(1, {16, 3, 232, 0, 0, 0})), FrameProblem::wrong_pdu);
}

TEST(Framing, NothingComesOutAfterAProblem) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(joined({{0, 1, 0, 9, 0, 6}, read_block()}));
  EXPECT_FALSE(reader.next());
  reader.feed(read_block());
  EXPECT_FALSE(reader.next());
  EXPECT_TRUE(reader.problem());
  EXPECT_FALSE(reader.has_partial_frame());
}

// However the bytes are cut, the same requests come out.
TEST(Framing, CutAnywhere) {
  const Bytes bytes =
      joined({read_block(1), adu(2, command_pdu({9, 1, 1, 0, 0})), adu(3, {6, 0, 1, 0, 2}), read_block(4)});
  std::mt19937 random(3);
  for (int run = 0; run < 200; ++run) {
    FrameReader reader(UnitSet().set(1));
    int transaction = 0;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 30, bytes.size() - at);
      reader.feed(std::span(bytes).subspan(at, size));
      at += size;
      while (const auto request = reader.next()) EXPECT_EQ(request->word(0), ++transaction);
    }
    EXPECT_EQ(transaction, 4);
  }
}

Ruling ruling(const Bytes& pdu, bool may_write = true) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(adu(1, pdu));
  const auto request = reader.next();
  EXPECT_TRUE(request);
  return request ? rule(*request, may_write) : Ruling{};
}

int exception_of(const Bytes& pdu, bool may_write = true) {
  const Ruling r = ruling(pdu, may_write);
  return r.kind == Ruling::Kind::exception ? r.exception : 0;
}

TEST(Rules, ReadsOfTheBlock) {
  for (const std::uint8_t function : std::initializer_list<std::uint8_t>{3, 4}) {
    EXPECT_EQ(exception_of(read_pdu(function, 0, 61)), 0);
    for (std::uint16_t first = 0; first < 70; ++first)
      for (std::uint16_t count = 1; count <= 125; ++count) {
        const bool whole = first == 0 && count == 61;
        bool values = false;
        for (int r = first; r < first + count; ++r) values = values || (r >= 14 && r <= 29);
        const bool allowed = whole || (!values && first + count <= 61);
        EXPECT_EQ(exception_of(read_pdu(function, first, count)), allowed ? 0 : 2) << first << " " << count;
      }
    EXPECT_EQ(exception_of(read_pdu(function, 0, 0)), 3);
    EXPECT_EQ(exception_of(read_pdu(function, 0, 126)), 3);
    EXPECT_EQ(exception_of(read_pdu(function, 1000, 10)), 2);
    EXPECT_EQ(exception_of(read_pdu(function, 65535, 2)), 2);
  }
}

TEST(Rules, ReadsOfTheTargetBlockOnlyAsAWhole) {
  for (const std::uint8_t function : std::initializer_list<std::uint8_t>{3, 4}) {
    EXPECT_EQ(ruling(read_pdu(function, 200, 22), false).kind, Ruling::Kind::target);
    EXPECT_EQ(exception_of(read_pdu(function, 200, 21)), 2);
    EXPECT_EQ(exception_of(read_pdu(function, 200, 23)), 2);
    EXPECT_EQ(exception_of(read_pdu(function, 199, 22)), 2);
  }
  const std::vector<std::uint16_t> many(22);
  EXPECT_EQ(exception_of(write_pdu(200, many)), 2);
}

TEST(Rules, WritesOfTheCommandBlockOnly) {
  const std::vector<std::uint16_t> many(100);
  EXPECT_EQ(ruling(write_pdu(1000, std::span(many).first(10))).kind, Ruling::Kind::command);
  EXPECT_EQ(exception_of(write_pdu(1000, std::span(many).first(9))), 3);
  EXPECT_EQ(exception_of(write_pdu(1000, std::span(many).first(11))), 2);
  EXPECT_EQ(exception_of(write_pdu(1001, std::span(many).first(9))), 3);
  EXPECT_EQ(exception_of(write_pdu(999, std::span(many).first(10))), 2);
  EXPECT_EQ(exception_of(write_pdu(0, std::span(many).first(61))), 2);
  EXPECT_EQ(exception_of(write_pdu(1010, std::span(many).first(10))), 2);
  EXPECT_EQ(exception_of(write_pdu(1000, std::span(many).first(100))), 2);
  EXPECT_EQ(exception_of(write_pdu(1000, std::span(many).first(10)), false), 1);
}

TEST(Rules, WritesOfThePositionBlockOnlyAsAWhole) {
  const std::vector<std::uint16_t> many(100);
  EXPECT_EQ(ruling(write_pdu(1100, std::span(many).first(20))).kind, Ruling::Kind::position);
  EXPECT_EQ(exception_of(write_pdu(1100, std::span(many).first(10))), 3);
  EXPECT_EQ(exception_of(write_pdu(1100, std::span(many).first(21))), 2);
  EXPECT_EQ(exception_of(write_pdu(1099, std::span(many).first(20))), 2);
  EXPECT_EQ(exception_of(write_pdu(1100, std::span(many).first(20)), false), 1);
}

TEST(Rules, NoOtherFunction) {
  for (int function = 0; function < 128; ++function) {
    if (function == 3 || function == 4 || function == 16) continue;
    EXPECT_EQ(exception_of({static_cast<std::uint8_t>(function), 3, 232, 0, 1}), 1) << function;
    EXPECT_EQ(exception_of({static_cast<std::uint8_t>(function)}), 1) << function;
  }
}

// libmodbus would answer 0x83 with 0x03 and one byte: a good answer in the eyes of a careless client.
TEST(Rules, WhatIsNoFunctionIsNotAnswered) {
  for (int function = 128; function < 256; ++function) {
    FrameReader reader(UnitSet().set(1));
    reader.feed(adu(1, {static_cast<std::uint8_t>(function), 0, 0, 0, 61}));
    EXPECT_FALSE(reader.next());
    EXPECT_EQ(reader.problem(), FrameProblem::wrong_pdu) << function;
  }
}

Adu parse(const Bytes& bytes) {
  FrameReader reader(UnitSet().set(1));
  reader.feed(bytes);
  return reader.next().value();
}

TEST(Reply, RegistersOfTheWholeBlock) {
  ModbusReply reply;
  ResultRegisters block{};
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<std::uint16_t>(0x0100 + i);
  for (const std::uint8_t function : std::initializer_list<std::uint8_t>{3, 4}) {
    const Bytes answer = reply.registers(parse(adu(0x1234, read_pdu(function, 0, 61))), block);
    ASSERT_EQ(answer.size(), 9u + 122u);
    EXPECT_EQ(Bytes(answer.begin(), answer.begin() + 9), (Bytes{0x12, 0x34, 0, 0, 0, 125, 1, function, 122}));
    for (std::size_t i = 0; i < block.size(); ++i)
      EXPECT_EQ(answer[9 + 2 * i] << 8 | answer[10 + 2 * i], block[i]);
  }
}

TEST(Reply, WrittenAndExceptions) {
  ModbusReply reply;
  const Adu command = parse(adu(0xABCD, command_pdu({5, 1, 1, 0, 0})));
  EXPECT_EQ(reply.written(command), (Bytes{0xAB, 0xCD, 0, 0, 0, 6, 1, 16, 0x03, 0xE8, 0, 10}));
  for (const std::uint8_t number : std::initializer_list<std::uint8_t>{1, 2, 3, 6})
    EXPECT_EQ(reply.exception(command, number), (Bytes{0xAB, 0xCD, 0, 0, 0, 3, 1, 0x90, number}));
  const Adu single = parse(adu(1, {6, 0, 1, 0, 2}));
  EXPECT_EQ(reply.exception(single, 1), (Bytes{0, 1, 0, 0, 0, 3, 1, 0x86, 1}));
}

}  // namespace
}  // namespace zeropose
