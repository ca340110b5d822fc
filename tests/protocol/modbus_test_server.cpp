// A link with a cell that is always ready and a cycle that answers by the job's number, for peers that are no
// C++ programs. Prints "port N" and serves until its standard input ends.
//   job 1: the correction below after 400 ms, exposed after 200 ms     job 2: not ok, code 301
//   job 3: silence, so the time-out at 2 s                        Zero: done after 400 ms, zero id
//   0x0A0B0C0D
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iostream>
#include <mutex>
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

// One request at a time, as the link promises.
class Cycle {
 public:
  explicit Cycle(const CellState& cell) : cell_(cell), thread_([this] { run(); }) {}
  // To be called while the link is still there; what it hands over afterwards is not answered.
  void stop() {
    take({});
    thread_.join();
  }
  void attach(RobotEndpoint& endpoint) {
    endpoint_ = &endpoint;
    endpoint.set_cell_state(cell_);
  }
  // A request with id 0 ends the thread; a robot cannot send one.
  void take(const Request& request) {
    const std::scoped_lock lock(mutex_);
    requests_.push_back(request);
    came_.notify_one();
  }

 private:
  void run() {
    while (true) {
      std::unique_lock lock(mutex_);
      came_.wait(lock, [this] { return !requests_.empty(); });
      const Request request = requests_.front();
      requests_.pop_front();
      lock.unlock();
      if (request.id == 0) return;
      if (request.kind != CommandKind::reset && request.job != 3) answer(request);
    }
  }
  void answer(const Request& request) {
    std::this_thread::sleep_for(milliseconds(200));
    endpoint_->exposure_done(request.id);
    std::this_thread::sleep_for(milliseconds(200));
    if (request.kind == CommandKind::zero) {
      cell_.zero_id = 0x0A0B0C0D;
      endpoint_->set_cell_state(cell_);
    }
    endpoint_->publish(report_for(request));
  }

  CellState cell_;
  RobotEndpoint* endpoint_ = nullptr;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> requests_;
  std::thread thread_;
};

int serve() {
  EndpointOptions options;
  options.handshake.convention = Convention::kuka;
  options.handshake.frame = 3;
  options.handshake.robot_index = 2;
  options.handshake.validity = milliseconds(2000);
  options.handshake.measure_deadline = milliseconds(2000);
  Cycle cycle(CellState{true, true, true, true, 0x01020304, 0x05060708, 0x09090909});
  RobotEndpoint endpoint(options, [&](const Request& request) { cycle.take(request); });
  cycle.attach(endpoint);
  ModbusServerOptions any_port;
  any_port.port = 0;
  const ModbusTcpServer server(any_port, {{ModbusTcpRobot{}, endpoint}});
  std::cout << "port " << server.port() << std::endl;
  for (std::string line; std::getline(std::cin, line);) continue;
  cycle.stop();
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
