// How a robot is reached: what the cell file says of its link.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "protocol/can_node.h"
#include "protocol/modbus_client_link.h"
#include "protocol/modbus_rtu_server.h"
#include "protocol/modbus_server.h"

namespace zeropose {

// The daemon as Modbus TCP server. Robots of one address and port share it, with a unit id each.
struct ModbusTcpOptions {
  std::string address = "127.0.0.1";  // where it listens, numeric IPv4
  std::uint16_t port = 1502;
  ModbusTcpRobot robot;
};

using LinkOptions = std::variant<ModbusTcpOptions, ModbusRtuOptions, ModbusClientOptions, CanOptions>;

// In the order of the alternatives: as in the cell file.
inline constexpr std::string_view link_names[] = {"modbus-tcp", "modbus-rtu", "modbus-client", "can"};

// For people: "Modbus TCP 127.0.0.1:1502 unit 1".
std::string describe(const LinkOptions& link);

}  // namespace zeropose
