// What one robot answers to Modbus requests, on TCP and on a serial line.
#pragma once

#include <vector>

#include "protocol/modbus_framing.h"
#include "protocol/modbus_reply.h"
#include "protocol/modbus_server.h"

namespace zeropose {

// Not thread-safe; the endpoint may be used by others meanwhile.
class ModbusUnitServer {
 public:
  ModbusUnitServer(const ModbusUnit& unit, RobotEndpoint& endpoint) : unit_(unit), endpoint_(&endpoint) {}

  // The whole ADU to send back; empty: libmodbus had none. Counts what happened.
  std::vector<std::uint8_t> answer(const Adu& request, ConnectionId from, bool may_write, ModbusReply& reply,
                                   ModbusCounters& counters) const;

 private:
  // 0: taken; else the number of the exception.
  std::uint8_t take_command(const Adu& request, ConnectionId from, ModbusCounters& counters) const;
  std::uint8_t take_position(const Adu& request, ConnectionId from, ModbusCounters& counters) const;

  ModbusUnit unit_;
  RobotEndpoint* endpoint_;
};

}  // namespace zeropose
