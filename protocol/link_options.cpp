#include "protocol/link_options.h"

namespace zeropose {
namespace {

std::string text_of(const ModbusTcpAddress& where) {
  return where.address + ":" + std::to_string(where.port);
}
std::string text_of(const SerialLine& line) {
  return line.device + " at " + std::to_string(line.baud) + " baud";
}

std::string text_of(const ModbusTcpOptions& tcp) {
  return "Modbus TCP " + tcp.address + ":" + std::to_string(tcp.port) + " unit " +
         std::to_string(tcp.robot.unit.unit);
}

std::string text_of(const ModbusRtuOptions& rtu) {
  return "Modbus RTU " + text_of(rtu.line) + " unit " + std::to_string(rtu.unit.unit);
}

std::string text_of(const ModbusClientOptions& client) {
  return "Modbus client of " + std::visit([](const auto& where) { return text_of(where); }, client.where) +
         " unit " + std::to_string(client.unit);
}

std::string text_of(const CanOptions& can) {
  return (can.fd ? "CAN FD " : "CAN ") + can.interface + " node " + std::to_string(can.node);
}

}  // namespace

std::string describe(const LinkOptions& link) {
  return std::visit([](const auto& options) { return text_of(options); }, link);
}

}  // namespace zeropose
