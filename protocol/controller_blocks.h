// The three blocks in a controller that is a Modbus server: reading its command, storing the result there so
// that it is what was meant, and the sign of life. Internal to ModbusClientLink.
#pragma once

#include "protocol/modbus_client_link.h"

namespace zeropose {

class ControllerBlocks {
 public:
  using Counter = std::uint64_t ModbusClientCounters::*;
  struct Events {
    std::function<void(Counter)> count;
    std::function<void()> asking;  // before every question
    std::function<void(const PeerFailure&)> failed;
  };
  ControllerBlocks(const ModbusClientOptions& options, Events events);

  bool connect();
  bool connected() const { return peer_.connected(); }
  void close() { peer_.close(); }

  // nullopt, false: told to Events::failed; the controller does not do what it must.
  std::optional<CommandRegisters> read_command();
  // One try: written, read back, compared. What is half written has a wrong sequence number at its end.
  bool store(const ResultRegisters& block);
  bool write_life(std::uint16_t counter, std::uint32_t request_id, std::uint16_t exception);

 private:
  bool write_block(const ResultRegisters& block);
  std::optional<ResultRegisters> read_back();
  bool write(std::size_t address, std::span<const std::uint16_t> registers);
  RegisterAnswer read(std::size_t address, std::size_t count);
  void report(const PeerFailure& failure, Counter refused);

  const ModbusClientOptions& options_;
  Events events_;
  ModbusPeer peer_;
};

}  // namespace zeropose
