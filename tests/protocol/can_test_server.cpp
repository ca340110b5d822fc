// A robot on a CAN bus with a cell that is always ready and a cycle that answers by the job's number, for
// peers that are no C++ programs: can_test_server INTERFACE [fd]. Prints "ready" and serves until its
// standard input ends; answers each line there with its counters. Fails when a wrong result was published.
//   job 1: the correction below after 100 ms     job 2: not ok, code 301
//   job 3: silence, so the time-out at 2 s       job 4: a correction that an int16 cannot carry
#include <condition_variable>
#include <deque>
#include <iostream>
#include <mutex>
#include <thread>

#include "protocol/can_link.h"
#include "tests/support/recorder.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t node_number = 5;

Report report_for(const Request& request) {
  Report report;
  report.request_id = request.id;
  report.ticket = request.ticket;
  report.code = request.job == 2 ? Code::too_few_marks : Code::ok;
  report.correction =
      from_six_numbers({request.job == 4 ? 400.0 : 12.345, -6.789, 0.001, 0.1234, -0.5678, 30.25});
  report.effective_marks = 11;
  report.effective_cameras = 4;
  report.largest_deviation_mm = 0.25;
  report.sigma_mm = 0.031;
  return report;
}

// One request at a time, as the link promises.
class Cycle {
 public:
  Cycle() : recorder_({Convention::kuka, 2, default_result_data_id}) {}

  void serve(RobotEndpoint& endpoint) {
    endpoint.set_cell_state({true, true, true, true, 0x01020304, 0x05060708, 0x09090909, false});
    thread_ = std::thread([this, &endpoint] { run(endpoint); });
  }
  void stop() {
    take({});
    thread_.join();
  }
  // A request with id 0 ends the thread; a robot cannot send one.
  void take(const Request& request) {
    if (request.kind == CommandKind::measure && request.id != 0) recorder_.requested(request.id);
    const std::scoped_lock lock(mutex_);
    requests_.push_back(request);
    came_.notify_one();
  }
  void see(const ResultBlock& block) { recorder_.see(encode(block), Recorder::Clock::now()); }
  const Recorder& recorder() const { return recorder_; }

 private:
  void run(RobotEndpoint& endpoint) {
    while (true) {
      std::unique_lock lock(mutex_);
      came_.wait(lock, [this] { return !requests_.empty(); });
      const Request request = requests_.front();
      requests_.pop_front();
      lock.unlock();
      if (request.id == 0) return;
      if (request.kind == CommandKind::reset || request.job == 3) continue;
      std::this_thread::sleep_for(milliseconds(100));
      endpoint.exposure_done(request.id);
      const Report report = report_for(request);
      recorder_.reported(report);
      endpoint.publish(report);
    }
  }

  Recorder recorder_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Request> requests_;
  std::thread thread_;
};

void print(const CanLink& link, const RobotEndpoint& endpoint) {
  const CanCounters c = link.counters();
  std::cout << "commands " << c.commands << " refused " << c.refused << " wrong_size " << c.wrong_size
            << " remote " << c.remote << " extended " << c.extended << " foreign " << c.foreign << " bus_off "
            << c.bus_off << " unconfirmed " << c.unconfirmed << " opened " << c.opened << " links_lost "
            << c.links_lost << " results_confirmed " << c.results_confirmed << " fault "
            << static_cast<int>(link.fault()) << " accepted " << endpoint.counters().accepted << std::endl;
}

int serve(const std::string& interface, bool fd) {
  Cycle cycle;
  EndpointOptions options;
  options.handshake.convention = Convention::kuka;
  options.handshake.frame = 3;
  options.handshake.robot_index = 2;
  options.handshake.validity = milliseconds(20000);
  options.handshake.measure_deadline = milliseconds(2000);
  options.tap = [&](const ResultBlock& block) { cycle.see(block); };
  RobotEndpoint endpoint(options, [&](const Request& request) { cycle.take(request); });
  cycle.serve(endpoint);
  {
    CanOptions can;
    can.interface = interface;
    can.node = node_number;
    can.fd = fd;
    const CanLink link(can, endpoint);
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) print(link, endpoint);
  }
  cycle.stop();
  for (const std::string& violation : cycle.recorder().violations()) std::cerr << violation << '\n';
  return cycle.recorder().violations().empty() ? 0 : 1;
}

}  // namespace
}  // namespace zeropose

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: can_test_server INTERFACE [fd]\n";
    return 2;
  }
  try {
    return zeropose::serve(arguments[1], count > 2 && std::string(arguments[2]) == "fd");
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
