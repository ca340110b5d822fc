// What else hangs on the link while bench_link asks: one thread that plays it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "tests/support/raw_modbus.h"

namespace zeropose {

class Load {
 public:
  virtual ~Load() = default;
  virtual void step(std::uint64_t millisecond) = 0;  // called once for each millisecond, late ones too

  std::atomic<std::uint64_t> answers = 0;      // whole blocks that came back
  std::atomic<std::uint64_t> connections = 0;  // made after the first ones
};

// Connected and silent.
class IdleClients : public Load {
 public:
  IdleClients(std::uint16_t port, std::size_t count);
  void step(std::uint64_t) override {}

 protected:
  // Counts what has come and throws it away. False: the server has closed.
  bool drain(const RawModbus& client);

  std::vector<RawModbus> clients_;
};

// Each reads the block a hundred times a second.
class ReadingClients : public IdleClients {
 public:
  using IdleClients::IdleClients;
  void step(std::uint64_t millisecond) override;
};

// Each sends a byte of a command every 400 ms, and comes again when it is closed.
class SlowClients : public IdleClients {
 public:
  SlowClients(std::uint16_t port, std::size_t count) : IdleClients(port, count), port_(port) {}
  void step(std::uint64_t millisecond) override;

 private:
  const std::uint16_t port_;
  std::size_t sent_ = 0;
};

// 10 000 requests and 1000 connections a second; every other connection asks something.
class Flood : public IdleClients {
 public:
  explicit Flood(std::uint16_t port) : IdleClients(port, 10), port_(port) {}
  void step(std::uint64_t millisecond) override;

 private:
  const std::uint16_t port_;
};

// Plays a load in a thread of its own until it goes.
class PlayedLoad {
 public:
  explicit PlayedLoad(Load& load);
  ~PlayedLoad();
  PlayedLoad(const PlayedLoad&) = delete;
  PlayedLoad& operator=(const PlayedLoad&) = delete;
  double seconds() const;

 private:
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace zeropose
