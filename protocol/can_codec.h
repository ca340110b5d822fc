// Commands and results in CAN frames (spec 80, CAN). Pure. Everything is little-endian.
//
//   RPDO1 0x200+n  request id u16, command u8, job u8, part u32
//   TPDO1 0x180+n  request id u16, x y z int16
//   TPDO2 0x280+n  request id u16, rx ry rz int16
//   TPDO3 0x380+n  request id u16, status (upper 6 bits) and code (lower 10), CRC-32
//   0x480+n        instead of the three, on CAN FD: 48 bytes with 32-bit values
//
// The int16 are the block's 32-bit values divided by the scale and rounded; 0x8000: there is no value.
#pragma once

#include <optional>

#include "protocol/can_frame.h"
#include "protocol/codec.h"

namespace zeropose {

namespace can_id {
inline constexpr std::uint32_t nmt = 0x000, emergency = 0x080, tpdo1 = 0x180, rpdo1 = 0x200, tpdo2 = 0x280,
                               tpdo3 = 0x380, result_fd = 0x480, sdo_answer = 0x580, sdo_request = 0x600,
                               heartbeat = 0x700;
}  // namespace can_id

namespace can_status {
inline constexpr std::uint8_t valid = 1, not_ok = 2, busy = 4, error = 8, simulated = 16, attention = 32;
}  // namespace can_status

inline constexpr std::size_t can_value_count = 6;
inline constexpr std::int16_t invalid_can_value = INT16_MIN;
inline constexpr std::uint8_t can_fd_result_size = 48;

// Both ends must agree on these.
struct CanCoding {
  std::uint32_t node = 1;    // 1..127
  double length_scale = 10;  // um per step
  double angle_scale = 10;   // 0.0001 deg per step; with Universal Robots 100, of 1e-6 rad: set it
  std::uint16_t data_id = default_result_data_id;  // in front of what the CRC is computed over
};

using CanValues = std::array<std::int16_t, can_value_count>;
inline constexpr CanValues no_can_values = {invalid_can_value, invalid_can_value, invalid_can_value,
                                            invalid_can_value, invalid_can_value, invalid_can_value};

// Three lengths and three angles, or a rotation vector. Not so ABB's quaternion.
bool fits_can(Convention convention);

// RPDO1 has no argument: with Zero the part is the guard and goes into the argument, else the argument is 0.
// nullopt: not RPDO1 of this node with exactly eight bytes.
std::optional<Command> decode_can_command(const CanFrame& frame, std::uint32_t node);
// The request id's lower 16 bits and the job's lower 8. Zero: part = argument.
CanFrame encode_can_command(const Command& command, std::uint32_t node);

// The block as this wire can show it: an answer to a request id of more than 16 bits was asked for elsewhere
// and is none; without CAN FD a valid result that does not fit becomes not ok with value_out_of_range.
ResultBlock fit_to_can(ResultBlock block, const CanCoding& coding, bool fd = false);
// nullopt: a value does not fit.
std::optional<CanValues> to_can_values(const WireValues& values, const CanCoding& coding);
std::uint8_t can_status_of(std::uint16_t status);

// Of a block that fits. Without result valid every value is invalid_can_value.
std::array<CanFrame, 3> encode_can_result(const ResultBlock& block, const CanCoding& coding);
CanFrame encode_can_fd_result(const ResultBlock& block, const CanCoding& coding);

// What a robot finds in the three frames.
struct CanResult {
  std::uint16_t request_id = 0;
  std::uint8_t status = 0;  // can_status
  std::uint16_t code = 0;
  CanValues values = no_can_values;

  bool has(std::uint8_t bits) const { return (status & bits) == bits; }
  friend bool operator==(const CanResult&, const CanResult&) = default;
};
// nullopt: not these three frames of this node, different ids, or a wrong CRC, which a wrong epoch makes too.
std::optional<CanResult> decode_can_result(std::span<const CanFrame, 3> frames, std::uint32_t epoch,
                                           const CanCoding& coding);

struct CanFdResult {
  std::uint32_t request_id = 0, epoch = 0;
  std::uint16_t code = 0, status = 0;  // status_bit
  std::array<std::int32_t, can_value_count> values{};
  std::uint16_t age_ms = 0, validity_ms = 0;
  std::uint8_t effective_marks = 0, effective_cameras = 0;  // 255: or more
  friend bool operator==(const CanFdResult&, const CanFdResult&) = default;
};
// nullopt: not this frame of this node, or a wrong CRC.
std::optional<CanFdResult> decode_can_fd_result(const CanFrame& frame, const CanCoding& coding);

}  // namespace zeropose
