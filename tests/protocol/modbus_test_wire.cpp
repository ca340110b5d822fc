// A robot's endpoint on one of the other Modbus wires, for peers that are no C++ programs: a cell that is
// always ready, a cycle that answers by the job's number, and a recorder that sees every block. Prints
// "ready", then serves until its standard input ends; fails when the recorder has seen a wrong valid result.
//   modbus_test_wire client PORT [MAX_REGISTERS]   a controller on the loopback is the server
//   modbus_test_wire rtu DEVICE UNIT               on a serial line, 19200 baud, no parity
//   job 1: the correction below after 200 ms, exposed after 100 ms     job 2: not ok, code 301
//   job 3: silence, so the time-out at 1 s
#include <condition_variable>
#include <deque>
#include <iostream>
#include <mutex>
#include <thread>
#include <vector>

#include "protocol/modbus_client_link.h"
#include "protocol/modbus_rtu_server.h"
#include "tests/support/recorder.h"

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
  return report;
}

class TestCell {
 public:
  TestCell()
      : recorder_({Convention::kuka, 2, default_result_data_id}),
        endpoint_(options(), [this](const Request& request) { take(request); }),
        thread_([this] { run(); }) {
    endpoint_.set_cell_state({true, true, true, true, 0x01020304, 0x05060708, 0x09090909});
  }
  RobotEndpoint& endpoint() { return endpoint_; }
  // To be called when nothing brings commands any more. The exit status.
  int finish() {
    take({});
    thread_.join();
    for (const std::string& violation : recorder_.violations()) std::cerr << violation << '\n';
    std::cerr << recorder_.valid_blocks() << " valid blocks published\n";
    return recorder_.violations().empty() ? 0 : 1;
  }

 private:
  EndpointOptions options() {
    EndpointOptions options;
    options.handshake.convention = Convention::kuka;
    options.handshake.frame = 3;
    options.handshake.robot_index = 2;
    options.handshake.validity = milliseconds(3000);
    options.handshake.measure_deadline = milliseconds(1000);
    options.tap = [this](const ResultBlock& block) { recorder_.see(encode(block), Recorder::Clock::now()); };
    return options;
  }
  // A request with id 0 ends the thread; a robot cannot send one.
  void take(const Request& request) {
    if (request.id != 0) recorder_.requested(request.id);
    const std::scoped_lock lock(mutex_);
    requests_.push_back(request);
    came_.notify_one();
  }
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
    std::this_thread::sleep_for(milliseconds(100));
    endpoint_.exposure_done(request.id);
    std::this_thread::sleep_for(milliseconds(100));
    const Report report = report_for(request);
    recorder_.reported(report);
    endpoint_.publish(report);
  }

  Recorder recorder_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> requests_;
  RobotEndpoint endpoint_;
  std::thread thread_;
};

bool is_up(const ModbusRtuServer& server) { return server.counters().open; }
bool is_up(const ModbusClientLink&) { return true; }  // its controller may come later

template <class Wire, class Options>
int serve(const Options& options) {
  TestCell cell;
  {
    const Wire wire(options, cell.endpoint());
    while (!is_up(wire)) std::this_thread::sleep_for(milliseconds(1));
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) continue;
  }
  return cell.finish();
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() >= 2 && arguments[0] == "client") {
    ModbusClientOptions options;
    options.where = ModbusTcpAddress{"127.0.0.1", static_cast<std::uint16_t>(std::stoi(arguments[1]))};
    options.first_pause = milliseconds(20);
    options.longest_pause = milliseconds(100);
    if (arguments.size() > 2) options.max_registers = std::stoul(arguments[2]);
    return serve<ModbusClientLink>(options);
  }
  if (arguments.size() == 3 && arguments[0] == "rtu") {
    ModbusRtuOptions options;
    options.line = {arguments[1], 19200, 'N', 1};
    options.unit.unit = static_cast<std::uint8_t>(std::stoi(arguments[2]));
    options.first_pause = milliseconds(20);
    options.longest_pause = milliseconds(100);
    return serve<ModbusRtuServer>(options);
  }
  std::cerr << "usage: modbus_test_wire client PORT [MAX_REGISTERS] | rtu DEVICE UNIT\n";
  return 2;
}

}  // namespace
}  // namespace zeropose

int main(int argc, char** argv) {
  try {
    return zeropose::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
