#include "protocol/modbus_server.h"

#include "protocol/modbus_loop.h"

namespace zeropose {
namespace {

using Counter = std::uint64_t ModbusCounters::*;

Counter counter_of_exception(std::uint8_t number) {
  switch (number) {
    case modbus::illegal_function:
      return &ModbusCounters::exception_1;
    case modbus::illegal_data_address:
      return &ModbusCounters::exception_2;
    case modbus::illegal_data_value:
      return &ModbusCounters::exception_3;
    default:
      return &ModbusCounters::exception_6;
  }
}

}  // namespace

void ModbusTcpLink::Server::count(Counter counter) {
  const std::scoped_lock lock(mutex_);
  ++(counters_.*counter);
}

ModbusCounters ModbusTcpLink::Server::counters() {
  const std::scoped_lock lock(mutex_);
  ModbusCounters copy = counters_;
  copy.handshake = handshake_.counters();
  return copy;
}

ResultBlock ModbusTcpLink::Server::block() {
  ResultBlock block;
  locked([&](Handshake& handshake, TimePoint now) { block = handshake.block(now); });
  return block;
}

void ModbusTcpLink::Server::show_to_tap() {
  if (!options_.tap) return;
  const ResultBlock block = handshake_.block(Clock::now());
  if (tapped_sequence_ == block.sequence) return;
  tapped_sequence_ = block.sequence;
  options_.tap(encode(block, options_.result_data_id));
}

std::vector<std::uint8_t> ModbusTcpLink::Server::exception(const Adu& request, std::uint8_t number) {
  count(counter_of_exception(number));
  return reply_.exception(request, number);
}

std::vector<std::uint8_t> ModbusTcpLink::Server::answer(const Adu& request, ConnectionId id, bool may_write) {
  count(&ModbusCounters::requests);
  const Ruling ruling = rule(request, may_write);
  switch (ruling.kind) {
    case Ruling::Kind::read:
      return read_block(request);
    case Ruling::Kind::command:
      return take_command(request, id);
    case Ruling::Kind::exception:
      break;
  }
  const bool reads = request.function() == modbus::read_holding_registers ||
                     request.function() == modbus::read_input_registers;
  if (!may_write && !reads) count(&ModbusCounters::writes_by_readers);
  return exception(request, ruling.exception);
}

// One snapshot, with its age and CRC now, for the whole answer.
std::vector<std::uint8_t> ModbusTcpLink::Server::read_block(const Adu& request) {
  count(&ModbusCounters::reads);
  return reply_.registers(request, encode(block(), options_.result_data_id));
}

std::vector<std::uint8_t> ModbusTcpLink::Server::take_command(const Adu& request, ConnectionId id) {
  const auto command =
      decode_command(command_registers(request), options_.require_command_crc, options_.command_data_id);
  if (!command) {
    count(&ModbusCounters::wrong_crc);
    return exception(request, modbus::illegal_data_value);
  }
  CommandOutcome outcome;
  locked([&](Handshake& handshake, TimePoint now) { outcome = handshake.on_command(*command, id, now); });
  if (outcome.verdict == CommandVerdict::busy) return exception(request, modbus::busy);
  if (outcome.verdict != CommandVerdict::accepted) return exception(request, modbus::illegal_data_value);
  if (outcome.request) hand_over(*outcome.request);
  return reply_.written(request);
}

// A handler that throws has not taken the request: the robot gets "internal" at once and not at the deadline.
void ModbusTcpLink::Server::hand_over(const Request& request) {
  try {
    handler_(request);
  } catch (...) {
    Report report;
    report.request_id = request.id;
    report.ticket = request.ticket;
    report.code = Code::internal;
    locked([&](Handshake& handshake, TimePoint now) { handshake.on_report(report, now); });
  }
}

ModbusTcpLink::ModbusTcpLink(const ModbusServerOptions& options, RequestHandler handler)
    : server_(std::make_unique<Server>(options, std::move(handler))) {}

ModbusTcpLink::~ModbusTcpLink() = default;

void ModbusTcpLink::set_cell_state(const CellState& state) {
  server_->change([&](Handshake& handshake, TimePoint now) { handshake.set_cell_state(state, now); });
}

void ModbusTcpLink::exposure_done(std::uint32_t request_id) {
  server_->change([&](Handshake& handshake, TimePoint now) { handshake.on_exposure_done(request_id, now); });
}

void ModbusTcpLink::publish(const Report& report) {
  server_->change([&](Handshake& handshake, TimePoint now) { handshake.on_report(report, now); });
}

std::uint16_t ModbusTcpLink::port() const { return server_->port(); }
ModbusCounters ModbusTcpLink::counters() const { return server_->counters(); }
ResultBlock ModbusTcpLink::block() const { return server_->block(); }

}  // namespace zeropose
