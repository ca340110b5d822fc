// One robot on Modbus TCP, the daemon as server (spec 80).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocol/handshake.h"
#include "protocol/robot_link.h"

namespace zeropose {

struct ModbusServerOptions {
  std::string address = "127.0.0.1";  // numeric IPv4
  std::uint16_t port = 1502;          // 0: any free one, port() tells
  std::uint8_t unit = 1;
  // The epoch is drawn at every start; what is set here is not used.
  HandshakeOptions handshake;
  std::uint16_t result_data_id = default_result_data_id;
  std::uint16_t command_data_id = default_command_data_id;
  bool require_command_crc = true;
  std::vector<std::string> allowed_writers;  // numeric IPv4; empty: everybody who is not a reader
  std::vector<std::string> allowed_readers;  // may read, never write
  std::size_t max_clients = 256;
  std::chrono::milliseconds frame_time{1000};  // from a request's first byte to its last; to take an answer
  // Sees every block that is published, in order. Called with the link locked: must be quick and not call it.
  std::function<void(const ResultRegisters&)> tap;
};

struct ModbusCounters {
  std::uint64_t connections = 0, refused_address = 0, refused_full = 0, evicted = 0, closed_slow = 0,
                closed_by_peer = 0;
  std::uint64_t requests = 0, reads = 0, wrong_crc = 0, writes_by_readers = 0;
  std::uint64_t wrong_protocol = 0, wrong_length = 0, wrong_unit = 0, wrong_pdu = 0;  // frames refused
  std::uint64_t exception_1 = 0, exception_2 = 0, exception_3 = 0, exception_6 = 0;
  std::uint64_t rounds = 0;  // of the loop: grows at least twice a second while the link is alive
  std::size_t clients = 0;   // now
  HandshakeCounters handshake;
};

class ModbusTcpLink : public RobotLink {
 public:
  // Listens from here on. The handler is called from the link's thread, without a lock held. Throws
  // std::invalid_argument for an option out of range and std::runtime_error when the address cannot be
  // listened on; both say which and what to do.
  ModbusTcpLink(const ModbusServerOptions& options, RequestHandler handler);
  ~ModbusTcpLink() override;
  ModbusTcpLink(const ModbusTcpLink&) = delete;
  ModbusTcpLink& operator=(const ModbusTcpLink&) = delete;

  void set_cell_state(const CellState& state) override;
  void exposure_done(std::uint32_t request_id) override;
  void publish(const Report& report) override;

  std::uint16_t port() const;
  ModbusCounters counters() const;
  // What a robot would read now.
  ResultBlock block() const;

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace zeropose
