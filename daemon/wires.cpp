#include "daemon/wires.h"

#include <spdlog/spdlog.h>

#include <map>

#include "protocol/can_link.h"

namespace zeropose {
namespace {

using Wires = std::vector<std::unique_ptr<Wire>>;
using Servers = std::map<std::pair<std::string, std::uint16_t>, std::vector<ModbusTcpServer::Served>>;

void open(const ModbusTcpOptions& tcp, RobotEndpoint& endpoint, Wires&, Servers& servers) {
  servers[{tcp.address, tcp.port}].push_back({tcp.robot, endpoint});
}
void open(const ModbusRtuOptions& rtu, RobotEndpoint& endpoint, Wires& wires, Servers&) {
  wires.push_back(std::make_unique<ModbusRtuServer>(rtu, endpoint));
}
void open(const ModbusClientOptions& client, RobotEndpoint& endpoint, Wires& wires, Servers&) {
  wires.push_back(std::make_unique<ModbusClientLink>(client, endpoint));
}
void open(const CanOptions& can, RobotEndpoint& endpoint, Wires& wires, Servers&) {
  wires.push_back(std::make_unique<CanLink>(can, endpoint));
}

}  // namespace

Wires open_wires(const std::vector<RobotOptions>& robots,
                 const std::vector<std::unique_ptr<RobotEndpoint>>& endpoints) {
  Wires wires;
  Servers servers;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    std::visit([&](const auto& link) { open(link, *endpoints[i], wires, servers); }, robots[i].link);
    spdlog::info("{}: {}", robots[i].name, describe(robots[i].link));
  }
  for (const auto& [place, served] : servers) {
    ModbusServerOptions options;
    options.address = place.first;
    options.port = place.second;
    wires.push_back(std::make_unique<ModbusTcpServer>(options, served));
  }
  return wires;
}

}  // namespace zeropose
