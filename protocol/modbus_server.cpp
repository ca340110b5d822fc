#include "protocol/modbus_server.h"

#include "protocol/modbus_loop.h"

namespace zeropose {

ModbusTcpServer::ModbusTcpServer(const ModbusServerOptions& options, const std::vector<Served>& robots)
    : loop_(std::make_unique<Loop>(options, robots)) {}

ModbusTcpServer::~ModbusTcpServer() = default;

std::uint16_t ModbusTcpServer::port() const { return loop_->port(); }
ModbusCounters ModbusTcpServer::counters() const { return loop_->counters(); }

}  // namespace zeropose
