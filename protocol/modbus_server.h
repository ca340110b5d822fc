// Robots on Modbus TCP, the daemon as server (spec 80): one port, and on it one unit id for each robot.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocol/modbus_unit.h"
#include "protocol/robot_endpoint.h"

namespace zeropose {

struct ModbusServerOptions {
  std::string address = "127.0.0.1";  // numeric IPv4
  std::uint16_t port = 1502;          // 0: any free one, port() tells
  std::size_t max_clients = 256;  // more than there are listed writers: each of these has a place reserved
  std::chrono::milliseconds frame_time{1000};  // from a request's first byte to its last; to take an answer
};

struct ModbusTcpRobot {
  ModbusUnit unit;
  std::vector<std::string> allowed_writers;  // numeric IPv4; empty: everybody who is not a reader
  std::vector<std::string> allowed_readers;  // may read, never write
};

struct ModbusCounters : ModbusUnitCounters {
  std::uint64_t connections = 0, refused_address = 0, refused_full = 0, evicted = 0, closed_slow = 0,
                closed_by_peer = 0;
  std::uint64_t wrong_protocol = 0, wrong_length = 0, wrong_unit = 0, wrong_pdu = 0;  // frames refused
  std::uint64_t rounds = 0;  // of the loop: grows at least twice a second while the server is alive
  std::size_t clients = 0;   // now
};

class ModbusTcpServer : public Wire {
 public:
  struct Served {
    ModbusTcpRobot robot;
    RobotEndpoint& endpoint;  // must outlive the server
  };

  // Listens from here on. Throws std::invalid_argument for an option out of range and std::runtime_error when
  // the address cannot be listened on; both say which and what to do.
  ModbusTcpServer(const ModbusServerOptions& options, const std::vector<Served>& robots);
  ~ModbusTcpServer() override;
  ModbusTcpServer(const ModbusTcpServer&) = delete;
  ModbusTcpServer& operator=(const ModbusTcpServer&) = delete;

  std::uint16_t port() const;
  ModbusCounters counters() const;
  std::uint64_t rounds() const override { return counters().rounds; }
  std::string problem() const override { return {}; }

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace zeropose
