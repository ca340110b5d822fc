// One robot whose controller is itself a Modbus server (spec 80), for instance Universal Robots with its
// general-purpose registers 128..255. The daemon is the client: it looks at the command block there, and
// writes the result block.
//
// What the controller has to know beyond docs/modbus.md:
//  - A command is taken when the block has changed and its CRC is right. What stands there when the daemon
//    connects is never carried out (command_watch.h).
//  - Every write of the result block is read back and compared. When it is split, the sequence number at the
//    end is made wrong first and right last: a block that is half written shows.
//  - The life block of four registers says that the daemon is alive, and what became of the last command: a
//    counter that grows with every heartbeat, the request id (2), and 0 for accepted or the number that a
//    server would answer with (3 refused, 6 busy). A daemon that is gone cannot withdraw its result: when the
//    counter stands still for some heartbeats, no result counts.
//  - The age is that of the moment of writing; it is written again with every heartbeat.
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "protocol/modbus_peer.h"
#include "protocol/robot_endpoint.h"

namespace zeropose {

struct ModbusClientOptions {
  std::variant<ModbusTcpAddress, SerialLine> where = ModbusTcpAddress{"127.0.0.1", 502};
  std::uint8_t unit = 1;
  // Holding registers of the controller: 10 that it writes, 61 and 4 that the daemon writes.
  std::uint16_t command_address = 128;
  std::uint16_t result_address = 140;
  std::uint16_t life_address = 201;
  std::chrono::milliseconds poll_period{20};  // 1..1000
  // The result block is written at least so often; 10..10000.
  std::chrono::milliseconds heartbeat_period{200};
  std::chrono::milliseconds response_timeout{200};  // 1..1000
  // The pause before connecting again; doubles up to the longest.
  std::chrono::milliseconds first_pause{100}, longest_pause{5000};
  std::size_t max_registers = 123;  // that the controller takes or gives in one message, 10..123
  int write_attempts = 3;  // of a block that is not stored as written, then the connection is dropped
  std::uint16_t result_data_id = default_result_data_id;
  std::uint16_t command_data_id = default_command_data_id;
  bool require_command_crc = true;
};

struct ModbusClientCounters {
  std::uint64_t connections = 0, cannot_connect = 0, connection_lost = 0, no_answer = 0, wrong_answer = 0,
                refused_reads = 0, refused_writes = 0, read_back_wrong = 0, dropped_unwritable = 0;
  std::uint64_t polls = 0, blocks_written = 0, commands = 0, refused_commands = 0, wrong_crc = 0;
  bool connected = false;    // now
  std::string last_failure;  // empty: none yet
};

class ModbusClientLink : public Wire {
 public:
  // Connects from here on, in a thread of its own. The endpoint must outlive the link. Throws
  // std::invalid_argument for an option out of range and std::runtime_error when the operating system
  // refuses.
  ModbusClientLink(const ModbusClientOptions& options, RobotEndpoint& endpoint);
  // Withdraws the result first, if the controller still answers.
  ~ModbusClientLink() override;
  ModbusClientLink(const ModbusClientLink&) = delete;
  ModbusClientLink& operator=(const ModbusClientLink&) = delete;

  ModbusClientCounters counters() const;
  // Grows before every question to the controller and at least twice a second: two seconds, on a serial line
  // whose controller is silent, are the longest that it can stand still.
  std::uint64_t rounds() const override;
  std::string problem() const override;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace zeropose
