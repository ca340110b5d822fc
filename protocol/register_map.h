// Where each field of the four Modbus blocks stands (spec 80). The codec and the robot programmer's page use
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace zeropose {

namespace reg {
inline constexpr std::size_t magic = 0, map_version = 1, sequence_begin = 2, epoch = 3, request_id = 5,
                             job = 7, robot_index = 8, part = 9, state = 11, status = 12, code = 13,
                             values = 14, convention = 30, frame = 31, age = 32, validity = 33, marks = 34,
                             cameras = 35, deviation = 36, sigma = 37, config_hash = 38,
                             calibration_hash = 40, zero_id = 42, spare = 44, crc = 58, sequence_end = 60,
                             block_size = 61;
inline constexpr std::size_t value_count = 8, values_end = values + 2 * value_count;
}  // namespace reg

namespace command_reg {
inline constexpr std::size_t first = 1000;  // holding register of the block's start; the others are offsets
inline constexpr std::size_t request_id = 0, command = 2, job = 3, part = 4, argument = 6, crc = 8,
                             block_size = 10;
}  // namespace command_reg

namespace position_reg {
inline constexpr std::size_t first = 1100;  // holding register of the block's start; the others are offsets
inline constexpr std::size_t index = 0, values = 2, crc = values + 2 * reg::value_count, block_size = crc + 2;
}  // namespace position_reg

namespace target_reg {
inline constexpr std::size_t first = 200;  // input register of the block's start; the others are offsets
inline constexpr std::size_t epoch = 0, index = 2, values = 4, crc = values + 2 * reg::value_count,
                             block_size = crc + 2;
}  // namespace target_reg

inline constexpr std::uint16_t block_magic = 0x5A50;
inline constexpr std::uint16_t block_map_version = 1;
inline constexpr std::uint16_t default_result_data_id = 0x5A50;
inline constexpr std::uint16_t default_command_data_id = 0x5A51;
inline constexpr std::int32_t zero_guard = 0x5A45524F;
inline constexpr std::int32_t invalid_value = INT32_MIN;  // 0x80000000: there is no value
inline constexpr std::uint16_t not_representable =
    0xFFFF;  // age, deviation, sigma: none, or beyond the range

struct RegisterField {
  std::size_t first;
  std::size_t count;
  std::string_view name;
  std::string_view meaning;
};

std::span<const RegisterField> result_block_fields();
std::span<const RegisterField> command_block_fields();
std::span<const RegisterField> position_block_fields();
std::span<const RegisterField> target_block_fields();

// The tables of docs/modbus.md, in Markdown.
std::string register_map_markdown();
std::string wire_values_markdown();  // how each convention's values are sent

}  // namespace zeropose
