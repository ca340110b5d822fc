#include "protocol/rtu_framing.h"

#include <algorithm>

namespace zeropose {
namespace {

constexpr std::size_t shortest = 4, longest = 256, crc_size = 2;

}  // namespace

std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

std::string_view name_of(RtuProblem problem) {
  switch (problem) {
    case RtuProblem::wrong_length:
      return "wrong length";
    case RtuProblem::wrong_crc:
      return "wrong CRC";
    case RtuProblem::broadcast:
      return "broadcast";
    case RtuProblem::other_unit:
      return "another unit";
    case RtuProblem::wrong_pdu:
      return "length does not fit the function";
  }
  return "unknown";
}

RtuFrame decode_rtu(std::span<const std::uint8_t> bytes, std::uint8_t unit) {
  if (bytes.size() < shortest || bytes.size() > longest) return {RtuProblem::wrong_length, {}};
  const auto body = bytes.first(bytes.size() - crc_size);
  const auto crc = static_cast<std::uint16_t>(bytes[body.size()] | bytes[body.size() + 1] << 8);
  if (crc16_modbus(body) != crc) return {RtuProblem::wrong_crc, {}};
  if (body[0] == 0) return {RtuProblem::broadcast, {}};
  if (body[0] != unit) return {RtuProblem::other_unit, {}};
  RtuFrame frame{std::nullopt, {}};
  Adu& adu = frame.request;
  adu.size = modbus::header - 1 + body.size();
  adu.bytes[5] = static_cast<std::uint8_t>(body.size());
  std::ranges::copy(body, adu.bytes.begin() + modbus::header - 1);
  if (adu.function() >= 0x80 || !pdu_is_whole(adu)) frame.problem = RtuProblem::wrong_pdu;
  return frame;
}

std::vector<std::uint8_t> encode_rtu(std::span<const std::uint8_t> adu) {
  const auto body = adu.subspan(modbus::header - 1);
  std::vector<std::uint8_t> bytes(body.begin(), body.end());
  const std::uint16_t crc = crc16_modbus(body);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

RtuReader::RtuReader(std::uint8_t unit, std::chrono::microseconds silence,
                     std::chrono::microseconds gap_tolerance)
    : unit_(unit), silence_(silence), gap_tolerance_(std::max(silence, gap_tolerance)) {}

// What is beyond the longest frame is not kept, but the frame stays too long.
void RtuReader::feed(std::span<const std::uint8_t> bytes, TimePoint now) {
  const std::size_t room = longest + 1 - buffer_.size();
  const auto kept = bytes.first(std::min(room, bytes.size()));
  buffer_.insert(buffer_.end(), kept.begin(), kept.end());
  last_byte_ = now;
}

bool RtuReader::is_beginning() const {
  if (buffer_.size() < 2) return true;
  switch (buffer_[1]) {
    case modbus::read_holding_registers:
    case modbus::read_input_registers:
      return buffer_.size() < 8;
    case modbus::write_multiple_registers:
      return buffer_.size() < 7 || buffer_.size() < std::size_t{9} + buffer_[6];
    default:
      return buffer_.size() < shortest;
  }
}

std::optional<RtuReader::TimePoint> RtuReader::frame_end() const {
  if (buffer_.empty()) return std::nullopt;
  return last_byte_ + (is_beginning() ? gap_tolerance_ : silence_);
}

std::optional<RtuFrame> RtuReader::take(TimePoint now) {
  const auto end = frame_end();
  if (!end || now < *end) return std::nullopt;
  const RtuFrame frame = decode_rtu(buffer_, unit_);
  buffer_.clear();
  return frame;
}

}  // namespace zeropose
