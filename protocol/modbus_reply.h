// Answers to requests that are already framed, checked and decided: made by libmodbus over a socket pair.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "protocol/line_socket.h"
#include "protocol/modbus_framing.h"

namespace zeropose {

// Not thread-safe. Throws std::runtime_error when the operating system refuses the socket pair.
class ModbusReply {
 public:
  ModbusReply();
  ~ModbusReply();

  // The whole ADU to send back. Empty: libmodbus had none, close the connection.
  std::vector<std::uint8_t> registers(const Adu& request, const ResultRegisters& block);
  std::vector<std::uint8_t> registers(const Adu& request, const TargetRegisters& block);
  std::vector<std::uint8_t> written(const Adu& request);
  std::vector<std::uint8_t> exception(const Adu& request, std::uint8_t number);

 private:
  struct Library;
  std::vector<std::uint8_t> receive();
  Descriptor library_end_, our_end_;
  std::unique_ptr<Library> library_;
};

}  // namespace zeropose
