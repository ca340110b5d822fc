#include "tests/bench/link_servers.h"

#include <modbus/modbus.h>
#include <sys/prctl.h>
#include <sys/select.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>

#include "protocol/modbus_server.h"
#include "protocol/modbus_socket.h"

namespace zeropose {
namespace {

Report ok_report(const Request& request) {
  Report report;
  report.request_id = request.id;
  report.ticket = request.ticket;
  report.code = Code::ok;
  report.correction = from_six_numbers({1.5, -2.25, 0.5, 0.1, -0.2, 0.3});
  report.effective_marks = 12;
  report.effective_cameras = 4;
  return report;
}

void tell_port(int to, std::uint16_t port) {
  if (::write(to, &port, sizeof port) != sizeof port) ::_exit(1);
}

void serve_ours(int tell, int stop) {
  EndpointOptions options;
  options.handshake.convention = Convention::kuka;
  options.handshake.frame = 3;
  RobotEndpoint* to_publish = nullptr;
  RobotEndpoint endpoint(options, [&](const Request& request) { to_publish->publish(ok_report(request)); });
  to_publish = &endpoint;
  endpoint.set_cell_state({true, true, true, true, 1, 2, 3});
  ModbusServerOptions any_port;
  any_port.port = 0;
  const ModbusTcpServer server(any_port, {{ModbusTcpRobot{}, endpoint}});
  tell_port(tell, server.port());
  char byte = 0;
  while (::read(stop, &byte, 1) > 0) continue;
}

class LibmodbusLoop {
 public:
  LibmodbusLoop()
      : listener_(listen_on("127.0.0.1", 0)),
        context_(modbus_new_tcp("127.0.0.1", 0)),
        registers_(modbus_mapping_new(0, 0, 1200, reg::block_size)) {}
  void run(int tell, int stop) {
    tell_port(tell, port_of(listener_.get()));
    sockets_ = {listener_.get(), stop};
    for (fd_set ready; wait(ready) && !FD_ISSET(stop, &ready);) {
      if (FD_ISSET(listener_.get(), &ready)) accept();
      for (const int client : std::set<int>(sockets_))
        if (client != listener_.get() && FD_ISSET(client, &ready)) answer(client);
    }
  }

 private:
  bool wait(fd_set& ready) const {
    FD_ZERO(&ready);
    for (const int socket : sockets_) FD_SET(socket, &ready);
    return ::select(*sockets_.rbegin() + 1, &ready, nullptr, nullptr, nullptr) > 0;
  }
  void accept() {
    int listener = listener_.get();
    const int client = modbus_tcp_accept(context_, &listener);
    if (client >= 0) sockets_.insert(client);
  }
  void answer(int client) {
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
    modbus_set_socket(context_, client);
    const int size = modbus_receive(context_, request.data());
    if (size > 0) modbus_reply(context_, request.data(), size, registers_);
    if (size >= 0) return;
    sockets_.erase(client);
    ::close(client);
  }

  Descriptor listener_;
  modbus_t* context_;
  modbus_mapping_t* registers_;
  std::set<int> sockets_;
};

[[noreturn]] void serve(ServerKind kind, int tell, int stop) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGPIPE, SIG_IGN);
  try {
    if (kind == ServerKind::ours)
      serve_ours(tell, stop);
    else
      LibmodbusLoop().run(tell, stop);
  } catch (const std::exception&) {
    ::_exit(1);
  }
  ::_exit(0);
}

}  // namespace

ServerProcess::ServerProcess(ServerKind kind) {
  std::array<int, 2> tell{}, stop{};
  if (::pipe(tell.data()) != 0 || ::pipe(stop.data()) != 0) throw std::runtime_error("bench: no pipe");
  pid_ = ::fork();
  if (pid_ == 0) {
    ::close(stop[1]);
    serve(kind, tell[1], stop[0]);
  }
  ::close(tell[1]);
  ::close(stop[0]);
  stop_ = stop[1];
  const bool up = ::read(tell[0], &port_, sizeof port_) == sizeof port_;
  ::close(tell[0]);
  if (!up) throw std::runtime_error("bench: the server does not come up");
}

ServerProcess::~ServerProcess() {
  ::close(stop_);
  ::waitpid(pid_, nullptr, 0);
}

double ServerProcess::resident_kb() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1024;
}

}  // namespace zeropose
