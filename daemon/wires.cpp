#include "daemon/wires.h"

#include <spdlog/spdlog.h>

#include <map>

#include "protocol/modbus_server.h"

namespace zeropose {
namespace {

ModbusTcpRobot tcp_robot(const RobotOptions& robot) {
  ModbusTcpRobot served;
  served.unit.unit = robot.unit;
  served.unit.require_command_crc = robot.require_command_crc;
  served.allowed_writers = robot.allowed_writers;
  served.allowed_readers = robot.allowed_readers;
  return served;
}

}  // namespace

std::vector<std::unique_ptr<Wire>> open_wires(const std::vector<RobotOptions>& robots,
                                              const std::vector<std::unique_ptr<RobotEndpoint>>& endpoints) {
  std::map<std::pair<std::string, std::uint16_t>, std::vector<ModbusTcpServer::Served>> servers;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const RobotOptions& robot = robots[i];
    servers[{robot.address, robot.port}].push_back({tcp_robot(robot), *endpoints[i]});
    spdlog::info("{}: Modbus TCP on {}:{}, unit {}", robot.name, robot.address, robot.port, robot.unit);
  }
  std::vector<std::unique_ptr<Wire>> wires;
  for (const auto& [place, served] : servers) {
    ModbusServerOptions options;
    options.address = place.first;
    options.port = place.second;
    wires.push_back(std::make_unique<ModbusTcpServer>(options, served));
  }
  return wires;
}

}  // namespace zeropose
