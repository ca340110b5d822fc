#include "protocol/codec.h"

#include <algorithm>
#include <cmath>

#include "protocol/crc32.h"

namespace zeropose {
namespace {

void put32(std::span<std::uint16_t> registers, std::size_t at, std::uint32_t value) {
  registers[at] = static_cast<std::uint16_t>(value >> 16);
  registers[at + 1] = static_cast<std::uint16_t>(value & 0xFFFF);
}

std::uint32_t get32(std::span<const std::uint16_t> registers, std::size_t at) {
  return (std::uint32_t{registers[at]} << 16) | registers[at + 1];
}

// The eight values of a block, two registers each.
void put_values(std::span<std::uint16_t> registers, std::size_t first, const WireValues& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    put32(registers, first + 2 * i, static_cast<std::uint32_t>(values[i]));
}

WireValues get_values(std::span<const std::uint16_t> registers, std::size_t first) {
  WireValues values{};
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::int32_t>(get32(registers, first + 2 * i));
  return values;
}

std::size_t value_count(Convention convention) { return convention == Convention::abb ? 7 : 6; }

// Units per unit of to_maker().
double scale(Convention convention, std::size_t i) {
  if (convention == Convention::universal_robots) return 1e6;  // m to um, rad to 1e-6 rad
  if (i < 3) return 1e3;
  return convention == Convention::abb ? 1e9 : 1e4;
}

std::optional<std::int32_t> fixed_point(double value) {
  const double rounded = std::round(value);
  if (!(std::abs(rounded) <= 2147483647.0)) return std::nullopt;  // NaN and infinity end here too
  return static_cast<std::int32_t>(rounded);
}

// 65535 is kept for "none".
std::optional<std::uint16_t> micrometres(double value_mm) {
  const double um = std::ceil(value_mm * 1000);
  if (!(value_mm >= 0 && um <= 65534)) return std::nullopt;
  return static_cast<std::uint16_t>(um);
}

std::optional<std::uint16_t> count16(int value) {
  if (value < 0 || value > 65535) return std::nullopt;
  return static_cast<std::uint16_t>(value);
}

bool on_the_wire(Convention convention) {
  const auto all = all_conventions();
  return convention != Convention::matrix && std::ranges::find(all, convention) != all.end();
}

std::uint32_t result_crc(std::span<const std::uint16_t> registers, std::uint16_t data_id) {
  return crc32_of_registers(data_id, registers.first(reg::crc));
}

ResultBlock read_fields(std::span<const std::uint16_t> r) {
  ResultBlock block;
  block.sequence = r[reg::sequence_begin];
  block.epoch = get32(r, reg::epoch);
  block.request_id = get32(r, reg::request_id);
  block.job = r[reg::job];
  block.robot_index = r[reg::robot_index];
  block.part = get32(r, reg::part);
  block.state = static_cast<LinkState>(r[reg::state]);
  block.status = r[reg::status];
  block.code = r[reg::code];
  block.values = get_values(r, reg::values);
  block.convention = r[reg::convention];
  block.frame = r[reg::frame];
  block.age_ms = r[reg::age];
  block.validity_ms = r[reg::validity];
  block.effective_marks = r[reg::marks];
  block.effective_cameras = r[reg::cameras];
  block.largest_deviation_um = r[reg::deviation];
  block.sigma_um = r[reg::sigma];
  block.config_hash = get32(r, reg::config_hash);
  block.calibration_hash = get32(r, reg::calibration_hash);
  block.zero_id = get32(r, reg::zero_id);
  return block;
}

}  // namespace

std::optional<WireValues> to_wire(Convention convention, const Pose& X_AB) {
  if (!on_the_wire(convention) || !X_AB.matrix().allFinite()) return std::nullopt;
  const std::vector<double> maker_values = to_maker(convention, X_AB);
  WireValues values = no_values;
  for (std::size_t i = 0; i < maker_values.size(); ++i) {
    const auto value = fixed_point(maker_values[i] * scale(convention, i));
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  return values;
}

std::optional<Pose> from_wire(Convention convention, const WireValues& values) {
  if (!on_the_wire(convention)) return std::nullopt;
  std::vector<double> maker_values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool used = i < value_count(convention);
    if (used == (values[i] == invalid_value)) return std::nullopt;
    if (used) maker_values.push_back(values[i] / scale(convention, i));
  }
  return from_maker(convention, maker_values);
}

void clear_report(ResultBlock& block) {
  block.values = no_values;
  block.status &= static_cast<std::uint16_t>(~(status_bit::result_valid | status_bit::not_ok));
  block.code = 0;
  block.effective_marks = block.effective_cameras = 0;
  block.largest_deviation_um = block.sigma_um = not_representable;
}

void put_report(const Report& report, Convention convention, ResultBlock& block) {
  clear_report(block);
  const auto marks = count16(report.effective_marks), cameras = count16(report.effective_cameras);
  const auto deviation = micrometres(report.largest_deviation_mm), sigma = micrometres(report.sigma_mm);
  block.effective_marks = marks.value_or(0);
  block.effective_cameras = cameras.value_or(0);
  block.largest_deviation_um = deviation.value_or(not_representable);
  block.sigma_um = sigma.value_or(not_representable);

  Code code = report.code;
  if (code == Code::ok) {
    const auto values = to_wire(convention, report.correction);
    if (values && marks && cameras && deviation && sigma) {
      block.values = *values;
      block.status |= status_bit::result_valid;
      return;
    }
    code = Code::value_out_of_range;
  }
  block.status |= status_bit::not_ok;
  block.code = static_cast<std::uint16_t>(code);
}

ResultRegisters encode(const ResultBlock& block, std::uint16_t data_id) {
  ResultRegisters r{};
  r[reg::magic] = block_magic;
  r[reg::map_version] = block_map_version;
  r[reg::sequence_begin] = r[reg::sequence_end] = block.sequence;
  put32(r, reg::epoch, block.epoch);
  put32(r, reg::request_id, block.request_id);
  r[reg::job] = block.job;
  r[reg::robot_index] = block.robot_index;
  put32(r, reg::part, block.part);
  r[reg::state] = static_cast<std::uint16_t>(block.state);
  r[reg::status] = block.status;
  r[reg::code] = block.code;
  // Whatever the caller did: without the valid bit no value leaves the house.
  put_values(r, reg::values, block.has(status_bit::result_valid) ? block.values : no_values);
  r[reg::convention] = block.convention;
  r[reg::frame] = block.frame;
  r[reg::age] = block.age_ms;
  r[reg::validity] = block.validity_ms;
  r[reg::marks] = block.effective_marks;
  r[reg::cameras] = block.effective_cameras;
  r[reg::deviation] = block.largest_deviation_um;
  r[reg::sigma] = block.sigma_um;
  put32(r, reg::config_hash, block.config_hash);
  put32(r, reg::calibration_hash, block.calibration_hash);
  put32(r, reg::zero_id, block.zero_id);
  put32(r, reg::crc, result_crc(r, data_id));
  return r;
}

std::string_view name_of(BlockProblem problem) {
  switch (problem) {
    case BlockProblem::wrong_length:
      return "wrong length";
    case BlockProblem::wrong_magic:
      return "wrong magic number";
    case BlockProblem::wrong_map_version:
      return "wrong map version";
    case BlockProblem::torn:
      return "torn: the two sequence numbers differ";
    case BlockProblem::wrong_crc:
      return "wrong CRC";
  }
  return "unknown";
}

DecodedBlock decode_result(std::span<const std::uint16_t> registers, std::uint16_t data_id) {
  if (registers.size() != reg::block_size) return {BlockProblem::wrong_length, {}};
  if (registers[reg::magic] != block_magic) return {BlockProblem::wrong_magic, {}};
  if (registers[reg::map_version] != block_map_version) return {BlockProblem::wrong_map_version, {}};
  if (registers[reg::sequence_begin] != registers[reg::sequence_end]) return {BlockProblem::torn, {}};
  if (get32(registers, reg::crc) != result_crc(registers, data_id)) return {BlockProblem::wrong_crc, {}};
  return {std::nullopt, read_fields(registers)};
}

std::optional<Command> decode_command(std::span<const std::uint16_t> registers, bool require_crc,
                                      std::uint16_t data_id) {
  if (registers.size() != command_reg::block_size) return std::nullopt;
  const std::uint32_t crc = crc32_of_registers(data_id, registers.first(command_reg::crc));
  if (require_crc && get32(registers, command_reg::crc) != crc) return std::nullopt;
  return Command{get32(registers, command_reg::request_id), registers[command_reg::command],
                 registers[command_reg::job], get32(registers, command_reg::part),
                 static_cast<std::int32_t>(get32(registers, command_reg::argument))};
}

CommandRegisters encode_command(const Command& command, std::uint16_t data_id) {
  CommandRegisters r{};
  put32(r, command_reg::request_id, command.request_id);
  r[command_reg::command] = command.kind;
  r[command_reg::job] = command.job;
  put32(r, command_reg::part, command.part);
  put32(r, command_reg::argument, static_cast<std::uint32_t>(command.argument));
  put32(r, command_reg::crc,
        crc32_of_registers(data_id, std::span<const std::uint16_t>(r).first(command_reg::crc)));
  return r;
}

std::optional<PositionBlock> decode_position(std::span<const std::uint16_t> registers, bool require_crc,
                                             std::uint16_t data_id) {
  if (registers.size() != position_reg::block_size) return std::nullopt;
  const std::uint32_t crc = crc32_of_registers(data_id, registers.first(position_reg::crc));
  if (require_crc && get32(registers, position_reg::crc) != crc) return std::nullopt;
  PositionBlock position{get32(registers, position_reg::index), {}};
  position.values = get_values(registers, position_reg::values);
  return position;
}

PositionRegisters encode_position(const PositionBlock& position, std::uint16_t data_id) {
  PositionRegisters r{};
  put32(r, position_reg::index, position.index);
  put_values(r, position_reg::values, position.values);
  put32(r, position_reg::crc,
        crc32_of_registers(data_id, std::span<const std::uint16_t>(r).first(position_reg::crc)));
  return r;
}

std::optional<TargetBlock> decode_target(std::span<const std::uint16_t> registers, std::uint16_t data_id) {
  if (registers.size() != target_reg::block_size) return std::nullopt;
  if (get32(registers, target_reg::crc) != crc32_of_registers(data_id, registers.first(target_reg::crc)))
    return std::nullopt;
  TargetBlock target{get32(registers, target_reg::epoch), get32(registers, target_reg::index), {}};
  target.values = get_values(registers, target_reg::values);
  return target;
}

TargetRegisters encode_target(const TargetBlock& target, std::uint16_t data_id) {
  TargetRegisters r{};
  put32(r, target_reg::epoch, target.epoch);
  put32(r, target_reg::index, target.index);
  put_values(r, target_reg::values, target.values);
  put32(r, target_reg::crc,
        crc32_of_registers(data_id, std::span<const std::uint16_t>(r).first(target_reg::crc)));
  return r;
}

}  // namespace zeropose
