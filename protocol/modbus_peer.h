// Another device's registers over Modbus TCP or RTU, the house as the client: for the link to a controller
// that is itself a server, and for the tools that look at a robot's block and send commands.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/codec.h"
#include "protocol/serial_line.h"

namespace zeropose {

struct ModbusTcpAddress {
  std::string address = "127.0.0.1";  // numeric IPv4
  std::uint16_t port = 1502;
};

struct ModbusPeerOptions {
  std::variant<ModbusTcpAddress, SerialLine> where;
  std::uint8_t unit = 1;                            // 1..247; on TCP also 0 and 255
  std::chrono::milliseconds response_timeout{500};  // for the whole answer, and for connecting; 1..60000
  std::uint16_t result_data_id = default_result_data_id;
  std::uint16_t command_data_id = default_command_data_id;
};

enum class PeerProblem {
  not_connected,    // or no longer: connect() first
  cannot_connect,   // nobody listens, or the device cannot be opened
  no_answer,        // within the time-out
  connection_lost,  // closed by the peer, or the device is gone
  wrong_answer,     // another transaction, unit, function, length or CRC than was asked for
  refused           // a Modbus exception; the connection stays
};
std::string_view name_of(PeerProblem problem);

struct PeerFailure {
  PeerProblem problem = PeerProblem::not_connected;
  std::uint8_t exception = 0;  // of a refusal, 1..11
  std::string text;            // where, what, and what to do
};

struct RegisterAnswer {
  std::optional<PeerFailure> failure = PeerFailure{};
  std::vector<std::uint16_t> registers;
};
struct BlockAnswer {
  std::optional<PeerFailure> failure = PeerFailure{};
  DecodedBlock decoded;  // wrong_length when there was a failure
};

// After every failure but a refusal the connection is closed, so that a late answer is never taken for the
// answer to a later question; on a serial line, where an answer names no question, the next connect() also
// waits until the line has been silent for the time-out. Not thread-safe; blocks for about twice the time-out
// at the longest.
class ModbusPeer {
 public:
  // Does not connect. Throws std::invalid_argument for an option out of range.
  explicit ModbusPeer(const ModbusPeerOptions& options);
  ModbusPeer(const std::string& address, std::uint16_t port, std::uint8_t unit,
             std::chrono::milliseconds response_timeout);
  ~ModbusPeer();
  ModbusPeer(ModbusPeer&&) noexcept;
  ModbusPeer& operator=(ModbusPeer&&) noexcept;

  // nullopt: connected, also when it already was.
  std::optional<PeerFailure> connect();
  bool connected() const;
  void close();

  // 1..125 of them.
  RegisterAnswer read_input(std::uint16_t first, std::uint16_t count);
  RegisterAnswer read_holding(std::uint16_t first, std::uint16_t count);
  // 1..123 holding registers with one FC16. nullopt: written, says the peer.
  std::optional<PeerFailure> write(std::uint16_t first, std::span<const std::uint16_t> registers);

  // The result block and the command block of a daemon that is the server.
  BlockAnswer read_block();
  // nullopt: accepted. Exception 06: busy; 03: wrong request id or CRC.
  std::optional<PeerFailure> write_command(const Command& command);

 private:
  struct Session;
  RegisterAnswer read(std::uint16_t first, std::uint16_t count, bool holding);
  PeerFailure failure(PeerProblem problem, const std::string& what) const;
  PeerFailure failure_of_errno();
  std::string name() const;

  ModbusPeerOptions options_;
  std::unique_ptr<Session> session_;
};

}  // namespace zeropose
