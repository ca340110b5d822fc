#include "protocol/can_codec.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/crc32.h"

namespace zeropose {
namespace {

constexpr std::uint32_t largest_code = 0x3FF;

CanFrame frame_of(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  return frame;
}

bool is_plain(const CanFrame& frame, std::uint32_t id, std::uint8_t size) {
  return frame.id == id && !frame.extended && !frame.remote && !frame.error && frame.size == size;
}

CanFrame values_frame(std::uint32_t id, std::uint32_t request_id, std::span<const std::int16_t> values) {
  CanFrame frame = frame_of(id, 8);
  put_le(frame.data, 0, 2, request_id);
  for (std::size_t i = 0; i < values.size(); ++i)
    put_le(frame.data, 2 + 2 * i, 2, static_cast<std::uint16_t>(values[i]));
  return frame;
}

// Over the data id, the bytes of both frames with values, the first four of the commit, and the epoch.
std::uint32_t commit_crc(std::span<const CanFrame, 3> frames, std::uint32_t epoch, std::uint16_t data_id) {
  std::array<std::uint8_t, 26> bytes{};
  put_le(bytes, 0, 2, data_id);
  std::copy_n(frames[0].data.begin(), 8, bytes.begin() + 2);
  std::copy_n(frames[1].data.begin(), 8, bytes.begin() + 10);
  std::copy_n(frames[2].data.begin(), 4, bytes.begin() + 18);
  put_le(bytes, 22, 4, epoch);
  return crc32_autosar(bytes);
}

std::uint32_t fd_crc(const CanFrame& frame, std::uint16_t data_id) {
  std::array<std::uint8_t, 46> bytes{};
  put_le(bytes, 0, 2, data_id);
  std::copy_n(frame.data.begin(), 44, bytes.begin() + 2);
  return crc32_autosar(bytes);
}

std::uint32_t saturated8(std::uint16_t value) { return std::min<std::uint32_t>(value, 255); }

std::int16_t int16_at(const CanFrame& frame, std::size_t at) {
  return static_cast<std::int16_t>(get_le(frame.data, at, 2));
}

}  // namespace

bool fits_can(Convention convention) {
  return convention != Convention::matrix && convention != Convention::abb;
}

std::optional<Command> decode_can_command(const CanFrame& frame, std::uint32_t node) {
  if (!is_plain(frame, can_id::rpdo1 + node, 8)) return std::nullopt;
  Command command;
  command.request_id = get_le(frame.data, 0, 2);
  command.kind = frame.data[2];
  command.job = frame.data[3];
  const std::uint32_t part = get_le(frame.data, 4, 4);
  if (command.kind == static_cast<std::uint16_t>(CommandKind::zero))
    command.argument = static_cast<std::int32_t>(part);
  else
    command.part = part;
  return command;
}

CanFrame encode_can_command(const Command& command, std::uint32_t node) {
  CanFrame frame = frame_of(can_id::rpdo1 + node, 8);
  const bool zero = command.kind == static_cast<std::uint16_t>(CommandKind::zero);
  put_le(frame.data, 0, 2, command.request_id);
  put_le(frame.data, 2, 1, command.kind);
  put_le(frame.data, 3, 1, command.job);
  put_le(frame.data, 4, 4, zero ? static_cast<std::uint32_t>(command.argument) : command.part);
  return frame;
}

std::optional<CanValues> to_can_values(const WireValues& values, const CanCoding& coding) {
  CanValues steps = no_can_values;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double step = std::round(values[i] / (i < 3 ? coding.length_scale : coding.angle_scale));
    if (!(std::abs(step) <= 32767)) return std::nullopt;
    steps[i] = static_cast<std::int16_t>(step);
  }
  return steps;
}

ResultBlock fit_to_can(ResultBlock block, const CanCoding& coding, bool fd) {
  if (block.request_id > 0xFFFF) {
    clear_report(block);
    block.request_id = 0;
  }
  if (!fd && block.has(status_bit::result_valid) && !to_can_values(block.values, coding)) {
    clear_report(block);
    block.status |= status_bit::not_ok;
    block.code = static_cast<std::uint16_t>(Code::value_out_of_range);
  }
  return block;
}

std::uint8_t can_status_of(std::uint16_t status) {
  constexpr std::uint16_t attention = status_bit::zero_missing | status_bit::camera_moved;
  unsigned bits = 0;
  if (status & status_bit::result_valid) bits |= can_status::valid;
  if (status & status_bit::not_ok) bits |= can_status::not_ok;
  if (status & status_bit::busy) bits |= can_status::busy;
  if (status & status_bit::error) bits |= can_status::error;
  if (status & status_bit::simulated) bits |= can_status::simulated;
  if (status & attention) bits |= can_status::attention;
  return static_cast<std::uint8_t>(bits);
}

std::array<CanFrame, 3> encode_can_result(const ResultBlock& block, const CanCoding& coding) {
  CanValues values = no_can_values;
  if (block.has(status_bit::result_valid))
    values = to_can_values(block.values, coding).value_or(no_can_values);
  const std::span<const std::int16_t> all(values);
  std::array<CanFrame, 3> frames = {
      values_frame(can_id::tpdo1 + coding.node, block.request_id, all.first(3)),
      values_frame(can_id::tpdo2 + coding.node, block.request_id, all.last(3)),
      values_frame(can_id::tpdo3 + coding.node, block.request_id, {}),
  };
  const std::uint32_t status = can_status_of(block.status);
  put_le(frames[2].data, 2, 2, (status << 10) | std::min<std::uint32_t>(block.code, largest_code));
  put_le(frames[2].data, 4, 4, commit_crc(frames, block.epoch, coding.data_id));
  return frames;
}

CanFrame encode_can_fd_result(const ResultBlock& block, const CanCoding& coding) {
  CanFrame frame = frame_of(can_id::result_fd + coding.node, can_fd_result_size);
  frame.fd = true;
  put_le(frame.data, 0, 4, block.request_id);
  put_le(frame.data, 4, 4, block.epoch);
  put_le(frame.data, 8, 2, block.code);
  put_le(frame.data, 10, 2, block.status);
  const WireValues& values = block.has(status_bit::result_valid) ? block.values : no_values;
  for (std::size_t i = 0; i < can_value_count; ++i)
    put_le(frame.data, 12 + 4 * i, 4, static_cast<std::uint32_t>(values[i]));
  put_le(frame.data, 36, 2, block.age_ms);
  put_le(frame.data, 38, 2, block.validity_ms);
  put_le(frame.data, 40, 1, saturated8(block.effective_marks));
  put_le(frame.data, 41, 1, saturated8(block.effective_cameras));
  put_le(frame.data, 44, 4, fd_crc(frame, coding.data_id));
  return frame;
}

std::optional<CanResult> decode_can_result(std::span<const CanFrame, 3> frames, std::uint32_t epoch,
                                           const CanCoding& coding) {
  constexpr std::array<std::uint32_t, 3> ids = {can_id::tpdo1, can_id::tpdo2, can_id::tpdo3};
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (frames[i].fd || !is_plain(frames[i], ids[i] + coding.node, 8)) return std::nullopt;
    if (get_le(frames[i].data, 0, 2) != get_le(frames[0].data, 0, 2)) return std::nullopt;
  }
  if (get_le(frames[2].data, 4, 4) != commit_crc(frames, epoch, coding.data_id)) return std::nullopt;
  const std::uint32_t status_and_code = get_le(frames[2].data, 2, 2);
  CanResult result;
  result.request_id = static_cast<std::uint16_t>(get_le(frames[0].data, 0, 2));
  result.status = static_cast<std::uint8_t>(status_and_code >> 10);
  result.code = static_cast<std::uint16_t>(status_and_code & largest_code);
  for (std::size_t i = 0; i < can_value_count; ++i)
    result.values[i] = int16_at(frames[i / 3], 2 + 2 * (i % 3));
  return result;
}

std::optional<CanFdResult> decode_can_fd_result(const CanFrame& frame, const CanCoding& coding) {
  if (!frame.fd || !is_plain(frame, can_id::result_fd + coding.node, can_fd_result_size)) return std::nullopt;
  if (get_le(frame.data, 44, 4) != fd_crc(frame, coding.data_id)) return std::nullopt;
  CanFdResult result;
  result.request_id = get_le(frame.data, 0, 4);
  result.epoch = get_le(frame.data, 4, 4);
  result.code = static_cast<std::uint16_t>(get_le(frame.data, 8, 2));
  result.status = static_cast<std::uint16_t>(get_le(frame.data, 10, 2));
  for (std::size_t i = 0; i < can_value_count; ++i)
    result.values[i] = static_cast<std::int32_t>(get_le(frame.data, 12 + 4 * i, 4));
  result.age_ms = static_cast<std::uint16_t>(get_le(frame.data, 36, 2));
  result.validity_ms = static_cast<std::uint16_t>(get_le(frame.data, 38, 2));
  result.effective_marks = frame.data[40];
  result.effective_cameras = frame.data[41];
  return result;
}

}  // namespace zeropose
