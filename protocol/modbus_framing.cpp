#include "protocol/modbus_framing.h"

#include <algorithm>

namespace zeropose {
namespace {

using namespace modbus;

std::size_t word_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::size_t>(bytes[at] << 8 | bytes[at + 1]);
}

Ruling exception(std::uint8_t number) { return {Ruling::Kind::exception, number}; }

Ruling rule_read(std::size_t first, std::size_t count) {
  if (count == 0 || count > 125) return exception(illegal_data_value);
  const std::size_t end = first + count;
  if (first == target_reg::first && count == target_reg::block_size) return {Ruling::Kind::target, 0};
  if (end > reg::block_size) return exception(illegal_data_address);
  const bool whole = first == 0 && end == reg::block_size;
  const bool touches_values = first < reg::values_end && end > reg::values;
  if (!whole && touches_values) return exception(illegal_data_address);
  return {Ruling::Kind::read, 0};
}

Ruling rule_write(std::size_t first, std::size_t count) {
  struct Block {
    std::size_t first, size;
    Ruling::Kind kind;
  };
  constexpr Block blocks[] = {{command_reg::first, command_reg::block_size, Ruling::Kind::command},
                              {position_reg::first, position_reg::block_size, Ruling::Kind::position}};
  for (const Block& block : blocks) {
    if (first < block.first || first + count > block.first + block.size) continue;
    if (count != block.size) return exception(illegal_data_value);
    return {block.kind, 0};
  }
  return exception(illegal_data_address);
}

}  // namespace

std::string_view name_of(FrameProblem problem) {
  switch (problem) {
    case FrameProblem::wrong_protocol:
      return "wrong protocol id";
    case FrameProblem::wrong_length:
      return "wrong MBAP length";
    case FrameProblem::wrong_unit:
      return "wrong unit id";
    case FrameProblem::wrong_pdu:
      return "length does not fit the function";
  }
  return "unknown";
}

bool pdu_is_whole(const Adu& adu) {
  const std::size_t pdu = adu.size - header;
  switch (adu.function()) {
    case read_holding_registers:
    case read_input_registers:
      return pdu == 5;
    case write_multiple_registers: {
      if (pdu < 6) return false;
      const std::size_t byte_count = adu.bytes[header + 5];
      return byte_count >= 2 && byte_count == 2 * std::size_t{adu.quantity()} && pdu == 6 + byte_count;
    }
    default:
      return adu.function() < 0x80;  // above are answers: an exception to one would look like a good answer
  }
}

void FrameReader::feed(std::span<const std::uint8_t> bytes) {
  if (!problem_) buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::size_t FrameReader::frame_size() const { return 6 + word_at(buffer_, 4); }

// Each field as soon as it is there: what is wrong is not waited for.
std::optional<FrameProblem> FrameReader::check_header() const {
  if (buffer_.size() >= 4 && word_at(buffer_, 2) != 0) return FrameProblem::wrong_protocol;
  if (buffer_.size() >= 6 && (word_at(buffer_, 4) < 2 || word_at(buffer_, 4) > 254))
    return FrameProblem::wrong_length;
  if (buffer_.size() >= 7 && !units_[buffer_[6]]) return FrameProblem::wrong_unit;
  return std::nullopt;
}

std::optional<Adu> FrameReader::next() {
  if (!problem_) problem_ = check_header();
  if (problem_ || buffer_.size() < header + 1 || buffer_.size() < frame_size()) return std::nullopt;
  Adu adu;
  adu.size = frame_size();
  std::copy_n(buffer_.begin(), adu.size, adu.bytes.begin());
  if (!pdu_is_whole(adu)) {
    problem_ = FrameProblem::wrong_pdu;
    return std::nullopt;
  }
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(adu.size));
  return adu;
}

Ruling rule(const Adu& request, bool may_write) {
  switch (request.function()) {
    case read_holding_registers:
    case read_input_registers:
      return rule_read(request.address(), request.quantity());
    case write_multiple_registers:
      if (!may_write) return exception(illegal_function);
      return rule_write(request.address(), request.quantity());
    default:
      return exception(illegal_function);
  }
}

std::vector<std::uint16_t> written_registers(const Adu& request) {
  std::vector<std::uint16_t> registers(request.quantity());
  for (std::size_t i = 0; i < registers.size(); ++i) registers[i] = request.word(header + 6 + 2 * i);
  return registers;
}

}  // namespace zeropose
