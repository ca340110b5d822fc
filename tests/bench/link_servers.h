// The servers that bench_link asks, each in a process of its own: this project's and a plain loop of
// libmodbus.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace zeropose {

enum class ServerKind {
  ours,      // ModbusTcpServer; the cycle publishes an ok report at once
  libmodbus  // modbus_receive and modbus_reply with select over the clients, as in its documentation; a valid
             // block stands still in its registers
};

// A server on a free port of the loopback until this object goes. Precondition: the process has one thread.
class ServerProcess {
 public:
  explicit ServerProcess(ServerKind kind);  // throws std::runtime_error when it does not come up
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  std::uint16_t port() const { return port_; }
  double resident_kb() const;

 private:
  pid_t pid_ = -1;
  int stop_ = -1;  // the server ends when this is closed
  std::uint16_t port_ = 0;
};

}  // namespace zeropose
