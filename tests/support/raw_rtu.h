// The master's end of a serial line for tests: a pseudo terminal whose other end has a lasting path, as a USB
// adapter has in /dev/serial/by-id. Sends any bytes, right or wrong; its CRC is its own.
#pragma once

#include <filesystem>

#include "tests/support/raw_modbus.h"

namespace zeropose {

Bytes rtu_frame(const Bytes& pdu, std::uint8_t unit = 1);

class RawRtu {
 public:
  RawRtu();  // plugged in
  ~RawRtu();
  RawRtu(const RawRtu&) = delete;
  RawRtu& operator=(const RawRtu&) = delete;

  std::string device() const { return link_; }
  void unplug();
  void plug_in();

  void send(const Bytes& bytes);
  // Unit, PDU and CRC; as much as belongs to an answer to `function`. Empty: nothing for `patience`.
  Bytes receive(std::chrono::milliseconds patience = std::chrono::milliseconds(2000));
  // For the other role: exactly so many bytes, or none.
  Bytes receive_bytes(std::size_t count,
                      std::chrono::milliseconds patience = std::chrono::milliseconds(2000));
  bool nothing_to_read() const;
  // send() and receive(); the PDU of the answer, empty when there is none or its CRC or unit is wrong.
  Bytes ask(const Bytes& pdu, std::uint8_t unit = 1);
  // Throws std::runtime_error when the block cannot be read or does not decode.
  ResultBlock block();
  // 0: accepted, else the exception's number; -1: no answer.
  int command(const Command& command);

 private:
  bool receive_exactly(Bytes& bytes, std::size_t count, std::chrono::steady_clock::time_point deadline);
  std::filesystem::path directory_, link_;
  Descriptor line_;
};

}  // namespace zeropose
