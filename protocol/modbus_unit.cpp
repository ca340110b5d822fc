#include "protocol/modbus_unit.h"

#include "protocol/modbus_framing.h"
#include "protocol/modbus_reply.h"

namespace zeropose {
namespace {

using Counter = std::uint64_t ModbusUnitCounters::*;

Counter counter_of_exception(std::uint8_t number) {
  switch (number) {
    case modbus::illegal_function:
      return &ModbusUnitCounters::exception_1;
    case modbus::illegal_data_address:
      return &ModbusUnitCounters::exception_2;
    case modbus::illegal_data_value:
      return &ModbusUnitCounters::exception_3;
    default:
      return &ModbusUnitCounters::exception_6;
  }
}

std::uint8_t exception_of(CommandVerdict verdict) {
  switch (verdict) {
    case CommandVerdict::accepted:
      return 0;
    case CommandVerdict::busy:
      return modbus::busy;
    default:
      return modbus::illegal_data_value;
  }
}

}  // namespace

std::uint8_t ModbusUnitServer::take_command(const Adu& request, ConnectionId from,
                                            ModbusUnitCounters& counters) const {
  const auto command =
      decode_command(written_registers(request), unit_.require_command_crc, unit_.command_data_id);
  if (!command) {
    ++counters.wrong_block_crc;
    return modbus::illegal_data_value;
  }
  const std::uint8_t exception = exception_of(endpoint_->command(*command, from));
  if (exception == 0) ++counters.commands;
  return exception;
}

std::uint8_t ModbusUnitServer::take_position(const Adu& request, ConnectionId from,
                                             ModbusUnitCounters& counters) const {
  const auto position =
      decode_position(written_registers(request), unit_.require_command_crc, unit_.command_data_id);
  if (!position) {
    ++counters.wrong_block_crc;
    return modbus::illegal_data_value;
  }
  const std::uint8_t exception = exception_of(endpoint_->position(*position, from));
  if (exception == 0) ++counters.positions;
  return exception;
}

std::vector<std::uint8_t> ModbusUnitServer::answer(const Adu& request, ConnectionId from, bool may_write,
                                                   ModbusReply& reply, ModbusUnitCounters& counters) const {
  ++counters.requests;
  const Ruling ruling = rule(request, may_write);
  std::uint8_t exception = ruling.exception;
  switch (ruling.kind) {
    case Ruling::Kind::read:
      // One snapshot, with its age and CRC now, for the whole answer.
      ++counters.reads;
      return reply.registers(request, encode(endpoint_->block(), unit_.result_data_id));
    case Ruling::Kind::target:
      ++counters.reads;
      return reply.registers(request, encode_target(endpoint_->target(), unit_.result_data_id));
    case Ruling::Kind::command:
      exception = take_command(request, from, counters);
      break;
    case Ruling::Kind::position:
      exception = take_position(request, from, counters);
      break;
    case Ruling::Kind::exception:
      if (!may_write && request.function() != modbus::read_holding_registers &&
          request.function() != modbus::read_input_registers)
        ++counters.writes_by_readers;
      break;
  }
  if (exception == 0) return reply.written(request);
  ++(counters.*counter_of_exception(exception));
  return reply.exception(request, exception);
}

}  // namespace zeropose
