// A robot's endpoint with a cell that is ready, a cycle that the test plays, and a recorder that sees every
// block it publishes; for tests of the wires that it can hang on.
#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <mutex>

#include "protocol/robot_endpoint.h"
#include "tests/support/recorder.h"

namespace zeropose {

inline CellState ready_cell() { return {true, true, true, true, 0x11111111, 0x22222222, 0x33333333}; }

class EndpointTest : public testing::Test {
 protected:
  EndpointTest() : recorder({Convention::kuka, 3, default_result_data_id}) {
    endpoint_options.handshake.convention = Convention::kuka;
    endpoint_options.handshake.frame = 3;
    endpoint_options.handshake.robot_index = 3;
    endpoint_options.tap = recorder.tap();
  }
  ~EndpointTest() override { EXPECT_EQ(recorder.violations(), std::vector<std::string>()); }

  void make_endpoint() {
    make_endpoint([this](const Request& request) {
      const std::scoped_lock lock(mutex);
      requests.push_back(request);
      came.notify_all();
    });
  }
  void make_endpoint(RequestHandler handler) {
    endpoint.emplace(endpoint_options, std::move(handler));
    endpoint->set_cell_state(ready_cell());
  }

  std::optional<Request> next_request() {
    std::unique_lock lock(mutex);
    if (!came.wait_for(lock, std::chrono::seconds(5), [this] { return !requests.empty(); }))
      return std::nullopt;
    const Request request = requests.front();
    requests.pop_front();
    return request;
  }
  std::size_t waiting_requests() {
    const std::scoped_lock lock(mutex);
    return requests.size();
  }

  static Report ok_report(const Request& request) {
    Report report;
    report.request_id = request.id;
    report.ticket = request.ticket;
    report.code = Code::ok;
    report.correction = from_six_numbers({1.5, -2.25, 0.5 + request.id, 0.1, -0.2, 0.3});
    report.effective_marks = 12;
    report.effective_cameras = 4;
    report.largest_deviation_mm = 0.1;
    report.sigma_mm = 0.02;
    return report;
  }
  void publish(const Report& report) {
    recorder.reported(report);
    endpoint->publish(report);
  }

  bool soon(const std::function<bool()>& condition) {
    for (int i = 0; i < 5000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return condition();
  }

  EndpointOptions endpoint_options;
  Recorder recorder;
  std::mutex mutex;
  std::condition_variable came;
  std::deque<Request> requests;
  std::optional<RobotEndpoint> endpoint;
};

}  // namespace zeropose
