// A bare Modbus TCP connection for tests: sends any bytes, right or wrong, and shows what comes back.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/codec.h"
#include "protocol/line_socket.h"

namespace zeropose {

using Bytes = std::vector<std::uint8_t>;

Bytes adu(std::uint16_t transaction, const Bytes& pdu, std::uint8_t unit = 1);
Bytes read_pdu(std::uint8_t function, std::uint16_t first, std::uint16_t count);
Bytes write_pdu(std::uint16_t first, std::span<const std::uint16_t> registers);
Bytes command_pdu(const Command& command);

class RawModbus {
 public:
  // Throws std::runtime_error when nobody listens.
  // The client's own address: empty: whatever the system takes.
  explicit RawModbus(std::uint16_t port, const std::string& address = "127.0.0.1",
                     const std::string& own_address = {});

  void send(const Bytes& bytes);  // what the peer does not take any more is lost
  // One whole ADU; empty: closed by the peer, or nothing for two seconds.
  Bytes receive();
  // send() and receive(); the PDU of the answer.
  Bytes ask(const Bytes& pdu, std::uint8_t unit = 1);
  bool closed_by_peer(std::chrono::milliseconds within = std::chrono::milliseconds(3000));
  void close() { socket_ = Descriptor(); }
  int descriptor() const { return socket_.get(); }

  std::optional<std::vector<std::uint16_t>> read_registers(std::uint8_t function = 4, std::uint16_t first = 0,
                                                           std::uint16_t count = reg::block_size);
  // Throws std::runtime_error when the block cannot be read or does not decode.
  ResultBlock block();
  // 0: accepted, else the exception's number; -1: no answer.
  int command(const Command& command);

 private:
  bool receive_exactly(std::span<std::uint8_t> bytes);
  Descriptor socket_;
  std::uint16_t transaction_ = 0;
};

}  // namespace zeropose
