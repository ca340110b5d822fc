// A Modbus link with a cell that is ready and a cycle that the test plays, watched by a recorder.
#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <mutex>

#include "protocol/modbus_server.h"
#include "tests/support/raw_modbus.h"
#include "tests/support/recorder.h"

namespace zeropose {

inline CellState ready_cell() { return {true, true, true, true, 0x11111111, 0x22222222, 0x33333333}; }

class LinkTest : public testing::Test {
 protected:
  LinkTest() : recorder({Convention::kuka, 3, default_result_data_id}) {
    options.port = 0;
    handshake.convention = Convention::kuka;
    handshake.frame = 3;
    handshake.robot_index = 3;
  }
  ~LinkTest() override {
    stop();
    EXPECT_EQ(recorder.violations(), std::vector<std::string>());
  }

  void start() {
    start_with_handler([this](const Request& request) {
      const std::scoped_lock lock(mutex);
      requests.push_back(request);
      came.notify_all();
    });
  }
  void start_with_handler(RequestHandler handler) {
    stop();
    endpoint.emplace(EndpointOptions{handshake, watched ? recorder.tap() : nullptr}, std::move(handler));
    endpoint->set_cell_state(ready_cell());
    server.emplace(options, std::vector<ModbusTcpServer::Served>{{served, *endpoint}});
  }
  void stop() {
    server.reset();
    endpoint.reset();
  }

  std::optional<Request> next_request() {
    std::unique_lock lock(mutex);
    if (!came.wait_for(lock, std::chrono::seconds(5), [this] { return !requests.empty(); }))
      return std::nullopt;
    const Request request = requests.front();
    requests.pop_front();
    return request;
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

  int measure(RawModbus& client, std::uint32_t id) {
    recorder.requested(id);
    return client.command({id, 1, 1, 77, 0});
  }
  // A whole clean cycle; the last word of every fault test.
  void expect_clean_cycle(RawModbus& client, std::uint32_t id) {
    ASSERT_EQ(measure(client, id), 0);
    const auto request = next_request();
    ASSERT_TRUE(request);
    endpoint->exposure_done(id);
    publish(ok_report(*request));
    const ResultBlock block = client.block();
    EXPECT_EQ(block.request_id, id);
    EXPECT_TRUE(block.has(status_bit::result_valid));
    EXPECT_EQ(block.values, to_wire(Convention::kuka, ok_report(*request).correction));
    EXPECT_EQ(client.command({id, 2, 0, 0, 0}), 0);
    recorder.withdrawn(id);
    EXPECT_FALSE(client.block().has(status_bit::result_valid));
  }
  void wait_until(const std::function<bool()>& condition) {
    for (int i = 0; i < 5000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(condition());
  }

  ModbusServerOptions options;
  ModbusTcpRobot served;
  HandshakeOptions handshake;
  bool watched = true;
  Recorder recorder;
  std::mutex mutex;
  std::condition_variable came;
  std::deque<Request> requests;
  std::optional<RobotEndpoint> endpoint;
  std::optional<ModbusTcpServer> server;
};

}  // namespace zeropose
