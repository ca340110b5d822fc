// What one robot answers to Modbus requests, on TCP and on a serial line.
#pragma once

#include <vector>

#include "protocol/robot_endpoint.h"

namespace zeropose {

struct Adu;
class ModbusReply;

struct ModbusUnit {
  std::uint8_t unit = 1;
  std::uint16_t result_data_id = default_result_data_id;
  std::uint16_t command_data_id = default_command_data_id;  // also that of the position block
  bool require_command_crc = true;
};

struct ModbusUnitCounters {
  std::uint64_t requests = 0, reads = 0, commands = 0, positions = 0;
  std::uint64_t wrong_block_crc = 0, writes_by_readers = 0;
  std::uint64_t exception_1 = 0, exception_2 = 0, exception_3 = 0, exception_6 = 0;
};

// Not thread-safe; the endpoint may be used by others meanwhile.
class ModbusUnitServer {
 public:
  ModbusUnitServer(const ModbusUnit& unit, RobotEndpoint& endpoint) : unit_(unit), endpoint_(&endpoint) {}

  // The whole ADU to send back; empty: libmodbus had none. Counts what happened.
  std::vector<std::uint8_t> answer(const Adu& request, ConnectionId from, bool may_write, ModbusReply& reply,
                                   ModbusUnitCounters& counters) const;

 private:
  // 0: taken; else the number of the exception.
  std::uint8_t take_command(const Adu& request, ConnectionId from, ModbusUnitCounters& counters) const;
  std::uint8_t take_position(const Adu& request, ConnectionId from, ModbusUnitCounters& counters) const;

  ModbusUnit unit_;
  RobotEndpoint* endpoint_;
};

}  // namespace zeropose
