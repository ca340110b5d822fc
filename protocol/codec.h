// The result, command, position and target blocks, between values and registers (spec 80). Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/conventions.h"
#include "protocol/register_map.h"
#include "protocol/report.h"

namespace zeropose {

enum class LinkState : std::uint16_t {
  preoperational = 0,
  initialized = 1,
  ready = 2,
  single_execution = 3,
  halted = 4,
  error = 5
};

namespace status_bit {
inline constexpr std::uint16_t ready = 1, busy = 2, exposure_done = 4, result_valid = 8, not_ok = 16,
                               error = 32, simulated = 64, zero_missing = 128, camera_moved = 256;
inline constexpr std::uint16_t all = 511;
}  // namespace status_bit

// A pose in a maker's convention as signed 32-bit numbers: lengths um, angles 0.0001 deg, quaternion
// components 1e-9, rotation vectors 1e-6 rad. Values that the convention does not use are invalid_value.
using WireValues = std::array<std::int32_t, reg::value_count>;
inline constexpr WireValues no_values = {invalid_value, invalid_value, invalid_value, invalid_value,
                                         invalid_value, invalid_value, invalid_value, invalid_value};

// nullopt: a value is not finite or does not fit, or the convention is never on the wire. No wrap, no clamp.
std::optional<WireValues> to_wire(Convention convention, const Pose& X_AB);
// nullopt: a used value is invalid_value or an unused one is not, or the values are no pose.
std::optional<Pose> from_wire(Convention convention, const WireValues& values);

// Every field of the result block that is not a constant, as it stands on the wire.
struct ResultBlock {
  std::uint16_t sequence = 0;
  std::uint32_t epoch = 0;
  std::uint32_t request_id = 0;  // 0: no answer is present and no request is under way
  std::uint16_t job = 0;
  std::uint16_t robot_index = 0;
  std::uint32_t part = 0;
  LinkState state = LinkState::preoperational;
  std::uint16_t status = 0;
  std::uint16_t code = 0;
  WireValues values = no_values;
  std::uint16_t convention = 0;
  std::uint16_t frame = 0;
  std::uint16_t age_ms = not_representable;
  std::uint16_t validity_ms = 0;
  std::uint16_t effective_marks = 0;
  std::uint16_t effective_cameras = 0;
  std::uint16_t largest_deviation_um = not_representable;
  std::uint16_t sigma_um = not_representable;
  std::uint32_t config_hash = 0, calibration_hash = 0, zero_id = 0;

  bool has(std::uint16_t bits) const { return (status & bits) == bits; }
  friend bool operator==(const ResultBlock&, const ResultBlock&) = default;
};

using ResultRegisters = std::array<std::uint16_t, reg::block_size>;
using CommandRegisters = std::array<std::uint16_t, command_reg::block_size>;

// What the report says goes into the block: values and bit 3, or the code and bit 4. A report that is ok but
// has a number that the wire cannot carry becomes not ok with value_out_of_range. Touches only the fields
// that come from a report.
void put_report(const Report& report, Convention convention, ResultBlock& block);
// Takes everything away that put_report put there.
void clear_report(ResultBlock& block);

ResultRegisters encode(const ResultBlock& block, std::uint16_t data_id = default_result_data_id);

enum class BlockProblem { wrong_length, wrong_magic, wrong_map_version, torn, wrong_crc };
std::string_view name_of(BlockProblem problem);

struct DecodedBlock {
  std::optional<BlockProblem> problem = BlockProblem::wrong_length;  // none: the block may be looked at
  ResultBlock block;
};
DecodedBlock decode_result(std::span<const std::uint16_t> registers,
                           std::uint16_t data_id = default_result_data_id);

struct Command {
  std::uint32_t request_id = 0;
  std::uint16_t kind = 0;  // a CommandKind, or a number that is none
  std::uint16_t job = 0;
  std::uint32_t part = 0;
  std::int32_t argument = 0;
  friend bool operator==(const Command&, const Command&) = default;
};

// nullopt: not exactly ten registers, or the CRC is asked for and wrong.
std::optional<Command> decode_command(std::span<const std::uint16_t> registers, bool require_crc = true,
                                      std::uint16_t data_id = default_command_data_id);
CommandRegisters encode_command(const Command& command, std::uint16_t data_id = default_command_data_id);

// Where the robot's hand is, for calibration: X_RH in its convention.
struct PositionBlock {
  std::uint32_t index = 0;
  WireValues values = no_values;
  friend bool operator==(const PositionBlock&, const PositionBlock&) = default;
};
using PositionRegisters = std::array<std::uint16_t, position_reg::block_size>;

// nullopt: not exactly its registers, or the CRC is asked for and wrong.
std::optional<PositionBlock> decode_position(std::span<const std::uint16_t> registers,
                                             bool require_crc = true,
                                             std::uint16_t data_id = default_command_data_id);
PositionRegisters encode_position(const PositionBlock& position,
                                  std::uint16_t data_id = default_command_data_id);

// Where the robot's hand shall go next, for calibration: X_RH in its convention. index 0: nowhere.
struct TargetBlock {
  std::uint32_t epoch = 0;
  std::uint32_t index = 0;
  WireValues values = no_values;
  friend bool operator==(const TargetBlock&, const TargetBlock&) = default;
};
using TargetRegisters = std::array<std::uint16_t, target_reg::block_size>;

// nullopt: not exactly its registers, or the CRC is wrong.
std::optional<TargetBlock> decode_target(std::span<const std::uint16_t> registers,
                                         std::uint16_t data_id = default_result_data_id);
TargetRegisters encode_target(const TargetBlock& target, std::uint16_t data_id = default_result_data_id);

}  // namespace zeropose
