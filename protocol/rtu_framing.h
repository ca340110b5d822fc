// Modbus RTU, bytes to single requests: what stands between two silences is one frame or nothing. Pure.
//
// modbus_receive() of libmodbus 3.1.6, with its own time-outs, cuts frames by the length that the function
// code announces, from wherever it happens to begin, and waits for the rest: of 60 requests that came 5 ms
// after one to four noise bytes it answered 3. Here the silence decides: 59 of 60 under the same noise. A
// thread that runs late on a busy machine reads noise and request as one and drops both; the master asks
// again.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/modbus_framing.h"

namespace zeropose {

// Polynomial 0xA001 reflected, init 0xFFFF; low byte first on the wire (MODBUS over Serial Line
// V1.02, 6.2.2).
std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes);

// Why there is no answer.
enum class RtuProblem {
  wrong_length,  // not 4..256 bytes
  wrong_crc,
  broadcast,   // to all units: nothing here may be started that way
  other_unit,  // of another device on the same line
  wrong_pdu    // the length does not fit the function, or the function is an answer's: our own echo
};
std::string_view name_of(RtuProblem problem);

struct RtuFrame {
  std::optional<RtuProblem> problem = RtuProblem::wrong_length;
  Adu request;  // with an MBAP header that was never on the wire, for what TCP and RTU share
};
RtuFrame decode_rtu(std::span<const std::uint8_t> bytes, std::uint8_t unit);
// Unit, PDU and CRC of an answer that has an MBAP header. Precondition: at least eight bytes.
std::vector<std::uint8_t> encode_rtu(std::span<const std::uint8_t> adu);

// Collects bytes until the silence that ends a frame.
class RtuReader {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  // A frame that is too short for its function is waited for until `gap_tolerance`, for adapters that deliver
  // a frame in pieces. Below `silence`: strict.
  RtuReader(std::uint8_t unit, std::chrono::microseconds silence, std::chrono::microseconds gap_tolerance);
  void feed(std::span<const std::uint8_t> bytes, TimePoint now);
  // When take() has to be called; nullopt: nothing has come.
  std::optional<TimePoint> frame_end() const;
  // What stood between two silences; nullopt: the second one is not over yet.
  std::optional<RtuFrame> take(TimePoint now);
  void clear() { buffer_.clear(); }

 private:
  bool is_beginning() const;
  std::uint8_t unit_;
  std::chrono::microseconds silence_, gap_tolerance_;
  std::vector<std::uint8_t> buffer_;
  TimePoint last_byte_{};
};

}  // namespace zeropose
