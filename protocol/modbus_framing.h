// Modbus TCP, bytes to single requests: strict MBAP framing and what each request may touch (spec 80). Pure.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/codec.h"

namespace zeropose {

namespace modbus {
inline constexpr std::uint8_t read_holding_registers = 3, read_input_registers = 4,
                              write_multiple_registers = 16;
inline constexpr std::uint8_t illegal_function = 1, illegal_data_address = 2, illegal_data_value = 3,
                              busy = 6;
inline constexpr std::size_t max_adu = 260, header = 7;
}  // namespace modbus

// Why a connection is closed without an answer.
enum class FrameProblem {
  wrong_protocol,  // MBAP protocol id is not 0
  wrong_length,    // MBAP length is not 2..254
  wrong_unit,      // a unit id that is none of ours
  wrong_pdu        // the length does not fit the function: half a request, or more than one
};
std::string_view name_of(FrameProblem problem);

// One whole request. FC03, FC04 and FC16 have exactly the length that belongs to them.
struct Adu {
  std::array<std::uint8_t, modbus::max_adu> bytes{};
  std::size_t size = 0;

  std::uint8_t unit() const { return bytes[modbus::header - 1]; }
  std::uint8_t function() const { return bytes[modbus::header]; }
  std::uint16_t address() const { return word(modbus::header + 1); }
  std::uint16_t quantity() const { return word(modbus::header + 3); }
  std::uint16_t word(std::size_t at) const {
    return static_cast<std::uint16_t>((bytes[at] << 8) | bytes[at + 1]);
  }
  std::span<const std::uint8_t> view() const { return std::span(bytes).first(size); }
};

// The length fits the function. Other functions than FC03, FC04 and FC16 are answered with an exception,
// whatever follows them in the frame; what is no function at all (128..255) is not answered.
bool pdu_is_whole(const Adu& adu);

using UnitSet = std::bitset<256>;  // unit ids

// Cuts one connection's bytes into requests. After a problem nothing more comes out.
class FrameReader {
 public:
  explicit FrameReader(const UnitSet& units) : units_(units) {}
  void feed(std::span<const std::uint8_t> bytes);
  // The next whole request; nullopt: more bytes are needed, or problem().
  std::optional<Adu> next();
  std::optional<FrameProblem> problem() const { return problem_; }
  bool has_partial_frame() const { return !problem_ && !buffer_.empty(); }

 private:
  std::optional<FrameProblem> check_header() const;
  std::size_t frame_size() const;  // precondition: at least six bytes
  UnitSet units_;
  std::vector<std::uint8_t> buffer_;
  std::optional<FrameProblem> problem_;
};

// What to do with a request.
struct Ruling {
  enum class Kind { exception, read, target, command, position };
  Kind kind = Kind::exception;
  std::uint8_t exception = modbus::illegal_function;
};

// Reads: of the result block, whole, or a part without its values; of the target block, whole. Writes:
// exactly the command block, or exactly the position block.
Ruling rule(const Adu& request, bool may_write);

// Precondition: rule() said command or position.
std::vector<std::uint16_t> written_registers(const Adu& request);

}  // namespace zeropose
