// A link with a cell that is always ready and a cycle that answers by the job's number, for peers that are no
// C++ programs. Prints "port N" and serves until its standard input ends.
//   job 1: the correction below after 40 ms, exposed after 15 ms     job 2: not ok, code 301
//   job 3: silence, so the time-out at 200 ms                        Zero: done after 40 ms, zero id
//   0x0A0B0C0D
#include <chrono>
#include <iostream>
#include <string>
#include <thread>

#include "protocol/modbus_server.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

Report report_for(const Request& request) {
  Report report;
  report.request_id = request.id;
  report.ticket = request.ticket;
  report.code = request.job == 2 ? Code::too_few_marks : Code::ok;
  report.correction = from_six_numbers({12.345, -6.789, 0.001, 0.1234, -0.5678, 30.25});
  report.effective_marks = 11;
  report.effective_cameras = 4;
  report.largest_deviation_mm = 0.25;
  report.sigma_mm = 0.031;
  return report;
}

int serve() {
  ModbusServerOptions options;
  options.port = 0;
  options.handshake.convention = Convention::kuka;
  options.handshake.frame = 3;
  options.handshake.robot_index = 2;
  options.handshake.validity = milliseconds(600);
  options.handshake.measure_deadline = milliseconds(200);
  CellState cell{true, true, true, true, 0x01020304, 0x05060708, 0x09090909};
  ModbusTcpLink* published = nullptr;
  std::vector<std::thread> cycles;
  ModbusTcpLink link(options, [&](const Request& request) {
    if (request.kind == CommandKind::reset || request.job == 3) return;
    cycles.emplace_back([&, request] {
      std::this_thread::sleep_for(milliseconds(15));
      published->exposure_done(request.id);
      std::this_thread::sleep_for(milliseconds(25));
      if (request.kind == CommandKind::zero) cell.zero_id = 0x0A0B0C0D;
      if (request.kind == CommandKind::zero) published->set_cell_state(cell);
      published->publish(report_for(request));
    });
  });
  published = &link;
  link.set_cell_state(cell);
  std::cout << "port " << link.port() << std::endl;
  for (std::string line; std::getline(std::cin, line);) continue;
  for (std::thread& cycle : cycles) cycle.join();
  return 0;
}

}  // namespace
}  // namespace zeropose

int main() {
  try {
    return zeropose::serve();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
