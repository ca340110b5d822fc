#include "protocol/codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <string>

#include "protocol/crc32.h"

namespace zeropose {
namespace {

// The block of spec 80 with a different, recognisable number in every field.
ResultBlock example() {
  ResultBlock block;
  block.sequence = 0x0203;
  block.epoch = 0x04050607;
  block.request_id = 0x08090A0B;
  block.job = 0x0C0D;
  block.robot_index = 0x0E0F;
  block.part = 0x10111213;
  block.state = LinkState::ready;
  block.status = status_bit::ready | status_bit::exposure_done | status_bit::result_valid;
  block.code = 0;
  block.values = {1, -1, 0x12345678, -2147483647, 2147483647, 0, invalid_value, invalid_value};
  block.convention = 2;
  block.frame = 3;
  block.age_ms = 0x1415;
  block.validity_ms = 0x1617;
  block.effective_marks = 0x1819;
  block.effective_cameras = 0x1A1B;
  block.largest_deviation_um = 0x1C1D;
  block.sigma_um = 0x1E1F;
  block.config_hash = 0x20212223;
  block.calibration_hash = 0x24252627;
  block.zero_id = 0x28292A2B;
  return block;
}

// CRC bit by bit, straight from the definition: independent of the table in the code.
std::uint32_t slow_crc(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes)
    for (int bit = 0; bit < 8; ++bit) {
      const bool one = ((crc ^ (static_cast<std::uint32_t>(byte) >> bit)) & 1u) != 0;
      crc >>= 1;
      if (one) crc ^= 0xC8DF352Fu;  // 0xF4ACFB13, bits reversed
    }
  return ~crc;
}

TEST(Crc32, CheckValue) {
  const std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc32_autosar(digits), 0x1697D06Au);
  EXPECT_EQ(slow_crc(digits), 0x1697D06Au);
}

TEST(Crc32, RegistersAreBytesHighFirstAfterTheDataId) {
  const std::array<std::uint16_t, 3> registers{0x3334, 0x3536, 0x3738};
  const std::array<std::uint8_t, 8> bytes{'1', '2', '3', '4', '5', '6', '7', '8'};
  EXPECT_EQ(crc32_of_registers(0x3132, registers), slow_crc(bytes));
}

TEST(Codec, EveryRegisterOfTheResultBlock) {
  const ResultRegisters r = encode(example());
  ResultRegisters expected{0x5A50, 1,      0x0203, 0x0405, 0x0607, 0x0809, 0x0A0B, 0x0C0D, 0x0E0F,
                           0x1011, 0x1213, 2,      13,     0,      0,      1,      0xFFFF, 0xFFFF,
                           0x1234, 0x5678, 0x8000, 0x0001, 0x7FFF, 0xFFFF, 0,      0,      0x8000,
                           0,      0x8000, 0,      2,      3,      0x1415, 0x1617, 0x1819, 0x1A1B,
                           0x1C1D, 0x1E1F, 0x2021, 0x2223, 0x2425, 0x2627, 0x2829, 0x2A2B};
  std::vector<std::uint8_t> bytes{0x5A, 0x50};
  for (std::size_t i = 0; i < 58; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(expected[i] >> 8));
    bytes.push_back(static_cast<std::uint8_t>(expected[i]));
  }
  const std::uint32_t crc = slow_crc(bytes);
  expected[58] = static_cast<std::uint16_t>(crc >> 16);
  expected[59] = static_cast<std::uint16_t>(crc);
  expected[60] = 0x0203;
  for (std::size_t i = 0; i < r.size(); ++i) EXPECT_EQ(r[i], expected[i]) << "register " << i;
}

TEST(Codec, EveryFieldComesBack) {
  const auto decoded = decode_result(encode(example()));
  ASSERT_FALSE(decoded.problem);
  EXPECT_EQ(decoded.block, example());
}

struct FieldChange {
  std::string_view field;
  std::function<void(ResultBlock&)> change;
};

std::vector<FieldChange> changes() {
  return {{"session epoch", [](ResultBlock& b) { b.epoch ^= 0xFFFFFFFF; }},
          {"request id", [](ResultBlock& b) { b.request_id ^= 0xFFFFFFFF; }},
          {"job", [](ResultBlock& b) { b.job ^= 0xFFFF; }},
          {"robot index", [](ResultBlock& b) { b.robot_index ^= 0xFFFF; }},
          {"part id", [](ResultBlock& b) { b.part ^= 0xFFFFFFFF; }},
          {"state", [](ResultBlock& b) { b.state = LinkState::error; }},
          {"status bits", [](ResultBlock& b) { b.status ^= 0xFFFF ^ status_bit::result_valid; }},
          {"code", [](ResultBlock& b) { b.code ^= 0xFFFF; }},
          {"values", [](ResultBlock& b) { b.values = {-1, -1, -1, 0x7FFFFFF0, 9, 8, 7, 6}; }},
          {"convention", [](ResultBlock& b) { b.convention ^= 0xFFFF; }},
          {"frame of the values", [](ResultBlock& b) { b.frame ^= 0xFFFF; }},
          {"age", [](ResultBlock& b) { b.age_ms ^= 0xFFFF; }},
          {"validity", [](ResultBlock& b) { b.validity_ms ^= 0xFFFF; }},
          {"effective marks", [](ResultBlock& b) { b.effective_marks ^= 0xFFFF; }},
          {"effective cameras", [](ResultBlock& b) { b.effective_cameras ^= 0xFFFF; }},
          {"largest deviation", [](ResultBlock& b) { b.largest_deviation_um ^= 0xFFFF; }},
          {"sigma at the worst application point", [](ResultBlock& b) { b.sigma_um ^= 0xFFFF; }},
          {"config hash", [](ResultBlock& b) { b.config_hash ^= 0xFFFFFFFF; }},
          {"calibration hash", [](ResultBlock& b) { b.calibration_hash ^= 0xFFFFFFFF; }},
          {"zero id", [](ResultBlock& b) { b.zero_id ^= 0xFFFFFFFF; }}};
}

// The table that the docs print says where each field stands: change the field, see which registers change.
TEST(Codec, FieldsStandWhereTheTableSays) {
  const ResultRegisters before = encode(example());
  for (const FieldChange& entry : changes()) {
    ResultBlock block = example();
    entry.change(block);
    const ResultRegisters after = encode(block);
    const auto fields = result_block_fields();
    const auto row = std::ranges::find(fields, entry.field, &RegisterField::name);
    ASSERT_NE(row, fields.end()) << entry.field;
    for (std::size_t i = 0; i < reg::crc; ++i)
      if (i < row->first || i >= row->first + row->count) {
        EXPECT_EQ(before[i], after[i]) << entry.field << " " << i;
      }
    EXPECT_NE(before[row->first], after[row->first]) << entry.field;
    EXPECT_NE(before[row->first + row->count - 1], after[row->first + row->count - 1]) << entry.field;
  }
  EXPECT_EQ(changes().size() + 6, result_block_fields().size()) << "magic, version, sequences, spare, CRC";
}

TEST(Codec, TheTableCoversEveryRegisterOnce) {
  std::size_t next = 0;
  for (const RegisterField& field : result_block_fields()) {
    EXPECT_EQ(field.first, next) << field.name;
    next += field.count;
  }
  EXPECT_EQ(next, reg::block_size);
}

TEST(Codec, NoValueWithoutTheValidBit) {
  ResultBlock block = example();
  block.status = status_bit::ready | status_bit::not_ok;
  const ResultRegisters r = encode(block);
  for (std::size_t i = reg::values; i < reg::values_end; i += 2) {
    EXPECT_EQ(r[i], 0x8000) << i;
    EXPECT_EQ(r[i + 1], 0) << i;
  }
}

TEST(Codec, DamagedBlocksAreNamed) {
  const ResultRegisters good = encode(example());
  EXPECT_EQ(decode_result(std::span(good).first(60)).problem, BlockProblem::wrong_length);
  EXPECT_EQ(decode_result(good, 0x5A52).problem, BlockProblem::wrong_crc);
  for (std::size_t i = 0; i < good.size(); ++i)
    for (int bit = 0; bit < 16; ++bit) {
      ResultRegisters damaged = good;
      damaged[i] ^= static_cast<std::uint16_t>(1 << bit);
      const auto expected = i == 0              ? BlockProblem::wrong_magic
                            : i == 1            ? BlockProblem::wrong_map_version
                            : i == 2 || i == 60 ? BlockProblem::torn
                                                : BlockProblem::wrong_crc;
      EXPECT_EQ(decode_result(damaged).problem, expected) << i << " bit " << bit;
    }
}

Report good_report() {
  Report report;
  report.code = Code::ok;
  report.correction = from_six_numbers({1.2345, -2.5, 0, 0.01, -0.02, 30.12345});
  report.effective_marks = 11;
  report.effective_cameras = 4;
  report.largest_deviation_mm = 0.1234;
  report.sigma_mm = 0.05;
  return report;
}

TEST(Codec, ReportGoesInWithItsUnits) {
  ResultBlock block;
  put_report(good_report(), Convention::kuka, block);
  EXPECT_EQ(block.status, status_bit::result_valid);
  EXPECT_EQ(block.code, 0);
  // 1.2345 mm is half way between two micrometres: either neighbour.
  EXPECT_THAT(block.values[0], testing::AnyOf(1234, 1235));
  EXPECT_EQ(block.values[1], -2500);
  EXPECT_EQ(block.values[2], 0);
  EXPECT_THAT(block.values[3], testing::AnyOf(301234, 301235));  // KUKA: A = rz
  EXPECT_EQ(block.values[4], -200);
  EXPECT_EQ(block.values[5], 100);
  EXPECT_EQ(block.values[6], invalid_value);
  EXPECT_EQ(block.effective_marks, 11);
  EXPECT_EQ(block.effective_cameras, 4);
  EXPECT_EQ(block.largest_deviation_um, 124);  // rounded up
  EXPECT_EQ(block.sigma_um, 50);
}

TEST(Codec, UniversalRobotsAndAbbUnits) {
  const auto X = from_maker(Convention::generic, std::vector<double>{1, -2, 3, 20, -35, 50});
  EXPECT_EQ(to_wire(Convention::universal_robots, *X),
            (WireValues{1000, -2000, 3000, 584156, -421065, 942848, invalid_value, invalid_value}));
  EXPECT_EQ(to_wire(Convention::abb, *X),
            (WireValues{1000, -2000, 3000, 829161648, 275247804, -198401312, 444259527, invalid_value}));
  EXPECT_FALSE(to_wire(Convention::matrix, *X));
  EXPECT_FALSE(to_wire(static_cast<Convention>(0), *X));
}

TEST(Codec, PoseComesBackWithinTheResolution) {
  const Pose X = from_six_numbers({12.3456, -7.891, 1000.5, 11, -23, 47});
  for (const Convention convention : all_conventions()) {
    if (convention == Convention::matrix) continue;
    const auto back = from_wire(convention, *to_wire(convention, X));
    ASSERT_TRUE(back) << name_of(convention);
    const Vector6 d = difference(X, *back);
    EXPECT_LT(d.head<3>().cwiseAbs().maxCoeff(), 0.00051) << name_of(convention);
    // Half of 1e-4 deg on three angles, not orthogonal to each other: below 1.5e-4 deg.
    EXPECT_LT(d.tail<3>().norm() * degrees_per_radian, 1.5e-4) << name_of(convention);
  }
}

TEST(Codec, FromWireRefusesMissingAndSurplusValues) {
  WireValues values = *to_wire(Convention::kuka, Pose::Identity());
  EXPECT_TRUE(from_wire(Convention::kuka, values));
  EXPECT_FALSE(from_wire(Convention::abb, values));  // seventh value missing
  for (std::size_t i = 0; i < values.size(); ++i) {
    WireValues wrong = values;
    wrong[i] = wrong[i] == invalid_value ? 0 : invalid_value;
    EXPECT_FALSE(from_wire(Convention::kuka, wrong)) << i;
  }
  EXPECT_FALSE(from_wire(static_cast<Convention>(99), values));
}

void expect_out_of_range(const Report& report, Convention convention = Convention::kuka) {
  ResultBlock block;
  put_report(report, convention, block);
  EXPECT_EQ(block.status, status_bit::not_ok);
  EXPECT_EQ(block.code, 507);
  EXPECT_EQ(block.values, no_values);
}

TEST(Codec, OutOfRangeIsACodeAndNotANumber) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  // The largest value that fits is +-2147483647; the next one is the invalid pattern, and no value.
  for (const double limit_mm : {2147483.6474, -2147483.6474}) {
    Report report = good_report();
    report.correction.translation().x() = limit_mm;
    ResultBlock block;
    put_report(report, Convention::kuka, block);
    EXPECT_EQ(block.status, status_bit::result_valid);
    EXPECT_EQ(block.values[0], limit_mm > 0 ? 2147483647 : -2147483647);
  }
  for (const double value_mm : {2147483.648, -2147483.648, 1e300, -1e300, nan, inf, -inf})
    for (int axis = 0; axis < 3; ++axis) {
      Report report = good_report();
      report.correction.translation()[axis] = value_mm;
      expect_out_of_range(report);
      expect_out_of_range(report, Convention::universal_robots);
      expect_out_of_range(report, Convention::abb);
    }
  Report report = good_report();
  report.correction.linear()(1, 1) = nan;
  expect_out_of_range(report);
}

TEST(Codec, FiguresThatDoNotFitAreOutOfRangeToo) {
  for (const double value_mm : {65.535, -1e-6, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    Report deviation = good_report(), sigma = good_report();
    deviation.largest_deviation_mm = value_mm;
    sigma.sigma_mm = value_mm;
    expect_out_of_range(deviation);
    expect_out_of_range(sigma);
  }
  for (const int count : {-1, 65536}) {
    Report marks = good_report(), cameras = good_report();
    marks.effective_marks = count;
    cameras.effective_cameras = count;
    expect_out_of_range(marks);
    expect_out_of_range(cameras);
  }
  expect_out_of_range(good_report(), Convention::matrix);
}

TEST(Codec, AReportThatIsNotOkKeepsItsCode) {
  Report report = good_report();
  report.code = Code::deviation_not_attributable;
  report.largest_deviation_mm = 1e6;
  ResultBlock block;
  put_report(report, Convention::kuka, block);
  EXPECT_EQ(block.status, status_bit::not_ok);
  EXPECT_EQ(block.code, 403);
  EXPECT_EQ(block.values, no_values);
  EXPECT_EQ(block.largest_deviation_um, not_representable);
  EXPECT_EQ(block.effective_marks, 11);
}

TEST(Codec, ADefaultReportIsNotOk) {
  ResultBlock block;
  put_report(Report{}, Convention::kuka, block);
  EXPECT_EQ(block.status, status_bit::not_ok);
  EXPECT_EQ(block.code, 901);
}

TEST(Codec, EveryRegisterOfTheCommandBlock) {
  const Command command{0x01020304, 1, 0x0506, 0x0708090A, -2};
  const CommandRegisters r = encode_command(command);
  const std::array<std::uint8_t, 18> bytes{0x5A, 0x51, 1, 2, 3,  4,    0,    1,    5,
                                           6,    7,    8, 9, 10, 0xFF, 0xFF, 0xFF, 0xFE};
  const std::uint32_t crc = slow_crc(bytes);
  EXPECT_EQ(r, (CommandRegisters{0x0102, 0x0304, 1, 0x0506, 0x0708, 0x090A, 0xFFFF, 0xFFFE,
                                 static_cast<std::uint16_t>(crc >> 16), static_cast<std::uint16_t>(crc)}));
  EXPECT_EQ(decode_command(r), command);
}

TEST(Codec, CommandOfWrongLengthOrCrc) {
  CommandRegisters r = encode_command({7, 1, 1, 0, 0});
  EXPECT_FALSE(decode_command(std::span(r).first(9)));
  std::array<std::uint16_t, 11> longer{};
  EXPECT_FALSE(decode_command(longer, false));
  EXPECT_FALSE(decode_command(r, true, 0x5A52));
  for (std::size_t i = 0; i < r.size(); ++i) {
    CommandRegisters damaged = r;
    damaged[i] ^= 1;
    EXPECT_FALSE(decode_command(damaged)) << i;
  }
  r[9] ^= 1;
  EXPECT_TRUE(decode_command(r, false));
}

TEST(Codec, TheTargetBlockComesBackWholeOrNotAtAll) {
  TargetBlock target{0xA0B0C0D0, 27, no_values};
  for (std::size_t i = 0; i < 6; ++i) target.values[i] = -static_cast<std::int32_t>(i) - 1;
  const TargetRegisters r = encode_target(target);
  EXPECT_EQ((std::array{r[0], r[1], r[2], r[3], r[4], r[5]}),
            (std::array<std::uint16_t, 6>{0xA0B0, 0xC0D0, 0, 27, 0xFFFF, 0xFFFF}));
  EXPECT_EQ(decode_target(r), target);
  EXPECT_FALSE(decode_target(std::span(r).first(21)));
  EXPECT_FALSE(decode_target(r, default_command_data_id));
  for (std::size_t i = 0; i < r.size(); ++i) {
    TargetRegisters damaged = r;
    damaged[i] ^= 0x0100;
    EXPECT_FALSE(decode_target(damaged)) << i;
  }
}

TEST(Codec, EveryRegisterOfThePositionBlock) {
  PositionBlock position{0x01020304, no_values};
  for (std::size_t i = 0; i < 6; ++i) position.values[i] = -static_cast<std::int32_t>(i) - 1;
  const PositionRegisters r = encode_position(position);
  std::vector<std::uint8_t> bytes{0x5A, 0x51, 1, 2, 3, 4};
  for (std::uint8_t i = 0; i < 6; ++i)
    bytes.insert(bytes.end(), {0xFF, 0xFF, 0xFF, static_cast<std::uint8_t>(0xFF - i)});
  for (int i = 0; i < 2; ++i) bytes.insert(bytes.end(), {0x80, 0, 0, 0});
  const std::uint32_t crc = slow_crc(bytes);
  EXPECT_EQ(r, (PositionRegisters{0x0102,
                                  0x0304,
                                  0xFFFF,
                                  0xFFFF,
                                  0xFFFF,
                                  0xFFFE,
                                  0xFFFF,
                                  0xFFFD,
                                  0xFFFF,
                                  0xFFFC,
                                  0xFFFF,
                                  0xFFFB,
                                  0xFFFF,
                                  0xFFFA,
                                  0x8000,
                                  0,
                                  0x8000,
                                  0,
                                  static_cast<std::uint16_t>(crc >> 16),
                                  static_cast<std::uint16_t>(crc)}));
  EXPECT_EQ(decode_position(r), position);
  EXPECT_FALSE(decode_position(std::span(r).first(19)));
  for (std::size_t i = 0; i < r.size(); ++i) {
    PositionRegisters damaged = r;
    damaged[i] ^= 1;
    EXPECT_FALSE(decode_position(damaged)) << i;
    EXPECT_TRUE(decode_position(damaged, false)) << i;
  }
}

}  // namespace
}  // namespace zeropose
