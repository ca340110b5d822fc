// One robot on Modbus RTU, the daemon as server on a serial line (spec 80). Several devices may share the
// line.
//
// The PDUs are libmodbus's, behind framing of our own as with TCP. modbus_receive() is not used: it knows no
// silence and no late answer (rtu_framing.h).
//
// A line has no connections. Its stand-in lasts from opening the device until the device is lost or the
// master has asked nothing for `master_timeout`; then its result is withdrawn and the session epoch is new.
#pragma once

#include <memory>
#include <string>

#include "protocol/modbus_unit.h"
#include "protocol/serial_line.h"

namespace zeropose {

struct ModbusRtuOptions {
  SerialLine line;
  ModbusUnit unit;  // 1..247
  // An answer is never sent later than this after the request's last byte: the master may have asked
  // something else meanwhile. 10..10000.
  std::chrono::milliseconds answer_within{500};
  std::chrono::milliseconds master_timeout{2000};  // 100..600000
  // For USB adapters that deliver a frame in pieces: the longest gap inside a frame, 0..100. 0: only the
  // silence of 3.5 characters counts.
  std::chrono::milliseconds gap_tolerance{0};
  // The pause before opening a lost device again; doubles up to the longest.
  std::chrono::milliseconds first_pause{100}, longest_pause{2000};
};

struct ModbusRtuCounters : ModbusUnitCounters {
  std::uint64_t opened = 0, lost = 0, cannot_open = 0, masters_lost = 0;
  std::uint64_t answers = 0, late = 0, overtaken = 0;
  std::uint64_t wrong_length = 0, wrong_crc = 0, broadcasts = 0, other_units = 0, wrong_pdu = 0;
  bool open = false;         // now
  std::string last_failure;  // of the device; empty: none yet
};

class ModbusRtuServer : public Wire {
 public:
  // Serves from here on, in a thread of its own; a device that is not there is waited for. The endpoint must
  // outlive the server. Throws std::invalid_argument for an option out of range and std::runtime_error when
  // the operating system refuses.
  ModbusRtuServer(const ModbusRtuOptions& options, RobotEndpoint& endpoint);
  ~ModbusRtuServer() override;
  ModbusRtuServer(const ModbusRtuServer&) = delete;
  ModbusRtuServer& operator=(const ModbusRtuServer&) = delete;

  ModbusRtuCounters counters() const;
  std::uint64_t rounds() const override;
  std::string problem() const override;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace zeropose
