// A Modbus TCP server for a robot's endpoint, with a cell that is ready and a cycle that the test plays,
// watched by a recorder.
#pragma once

#include "protocol/modbus_server.h"
#include "tests/protocol/endpoint_fixture.h"
#include "tests/support/raw_modbus.h"

namespace zeropose {

class LinkTest : public EndpointTest {
 protected:
  LinkTest() { options.port = 0; }
  ~LinkTest() override { stop(); }

  void start() {
    stop();
    make_endpoint();
    serve();
  }
  void start_with_handler(RequestHandler handler) {
    stop();
    make_endpoint(std::move(handler));
    serve();
  }
  void stop() {
    server.reset();
    endpoint.reset();
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
  void wait_until(const std::function<bool()>& condition) { EXPECT_TRUE(soon(condition)); }

  HandshakeOptions& handshake = endpoint_options.handshake;
  ModbusServerOptions options;
  ModbusTcpRobot served;
  std::optional<ModbusTcpServer> server;

 private:
  void serve() { server.emplace(options, std::vector<ModbusTcpServer::Served>{{served, *endpoint}}); }
};

}  // namespace zeropose
