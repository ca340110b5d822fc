// A robot controller that is a Modbus TCP server with nothing but holding registers (shown as input registers
// too), and that can be told to misbehave. Framing and unpacking are its own.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

#include "tests/support/raw_modbus.h"

namespace zeropose {

class FakeController {
 public:
  struct Faults {
    std::chrono::milliseconds answer_delay{0};
    bool silent = false, refuses_reads = false, refuses_writes = false, wrong_transaction = false;
    std::size_t max_registers = 125;
    // What is stored instead of this register's value.
    std::function<std::uint16_t(std::size_t address, std::uint16_t value)> store;
  };

  FakeController();  // on a free port of the loopback
  ~FakeController();
  FakeController(const FakeController&) = delete;
  FakeController& operator=(const FakeController&) = delete;

  std::uint16_t port() const { return port_; }
  // The connection is closed and nobody listens; the registers stay. A running one is started again.
  void stop();
  void start();

  void fail(const Faults& faults);
  void set(std::size_t address, std::span<const std::uint16_t> values);
  std::vector<std::uint16_t> get(std::size_t address, std::size_t count) const;
  // Called with every message that was stored, from the controller's thread.
  void after_write(std::function<void()> look);
  int connections() const { return connections_; }

 private:
  void serve();
  void serve_client(int client);
  Bytes answer(const Bytes& request);
  Bytes pdu_for(const Bytes& pdu);
  bool wait_readable(int fd) const;

  mutable std::mutex mutex_;  // guards the next three
  std::array<std::uint16_t, 65536> registers_{};
  Faults faults_;
  std::function<void()> look_;
  Descriptor listener_;
  std::uint16_t port_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<int> connections_{0};
  std::thread thread_;
};

}  // namespace zeropose
