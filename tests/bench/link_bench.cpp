// From a robot's command to the valid answer in its hands over Modbus TCP, the cycle taking no time: what the
// link costs alone, with others on it, and beside a plain server loop of libmodbus.
#include <benchmark/benchmark.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "tests/bench/link_load.h"
#include "tests/bench/link_servers.h"

namespace {

using namespace zeropose;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

double microseconds(steady_clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

// Command, reads until the result is valid, acknowledgement. The time to the valid result, in us.
double cycle_us(RawModbus& robot, ServerKind kind, std::uint32_t id) {
  const auto start = steady_clock::now();
  if (robot.command({id, 1, 1, 77, 0}) != 0) throw std::runtime_error("bench: the command is refused");
  if (kind == ServerKind::libmodbus) {
    if (!robot.read_registers()) throw std::runtime_error("bench: no block");
  } else {
    for (ResultBlock block = robot.block(); !block.has(status_bit::result_valid) || block.request_id != id;)
      block = robot.block();
  }
  const double time_us = microseconds(steady_clock::now() - start);
  if (robot.command({id, 2, 0, 0, 0}) != 0) throw std::runtime_error("bench: not acknowledged");
  return time_us;
}

// With a pause of 1 ms after each, as often as the argument says.
void measure_cycles(benchmark::State& state, ServerKind kind, std::uint16_t port, std::size_t count) {
  RawModbus robot(port);
  std::vector<double> times_us;
  for (std::uint32_t id = 1; times_us.size() < count; ++id) {
    times_us.push_back(cycle_us(robot, kind, id));
    std::this_thread::sleep_for(milliseconds(1));
  }
  std::sort(times_us.begin(), times_us.end());
  state.counters["p50_us"] = quantile(times_us, 0.5);
  state.counters["p99_us"] = quantile(times_us, 0.99);
  state.counters["p999_us"] = quantile(times_us, 0.999);
  state.counters["max_us"] = times_us.back();
}

// The same while a load is played, and what the others got.
void measure_beside(benchmark::State& state, ServerKind kind, std::uint16_t port, Load& others,
                    std::size_t cycles = 5000) {
  const PlayedLoad played(others);
  measure_cycles(state, kind, port, cycles);
  state.counters["answers_per_s"] = static_cast<double>(others.answers) / played.seconds();
  state.counters["connections_per_s"] = static_cast<double>(others.connections) / played.seconds();
}

template <class Others>
void with_others(benchmark::State& state, ServerKind kind) {
  for (auto _ : state) {
    const ServerProcess server(kind);
    Others others(server.port(), static_cast<std::size_t>(state.range(0)) - 1);
    measure_beside(state, kind, server.port(), others);
  }
}

void idle(benchmark::State& state, ServerKind kind) { with_others<IdleClients>(state, kind); }
void reading(benchmark::State& state, ServerKind kind) { with_others<ReadingClients>(state, kind); }

void slow_clients(benchmark::State& state) {
  for (auto _ : state) {
    const ServerProcess server(ServerKind::ours);
    SlowClients others(server.port(), 100);
    measure_beside(state, ServerKind::ours, server.port(), others);
  }
}

void flood(benchmark::State& state) {
  for (auto _ : state) {
    const ServerProcess server(ServerKind::ours);
    measure_cycles(state, ServerKind::ours, server.port(), 100);
    const double before_kb = server.resident_kb();
    Flood others(server.port());
    measure_beside(state, ServerKind::ours, server.port(), others,
                   25000);  // half a minute: memory must not grow
    state.counters["growth_kb"] = server.resident_kb() - before_kb;
  }
}

void memory(benchmark::State& state, ServerKind kind) {
  for (auto _ : state) {
    const ServerProcess server(kind);
    RawModbus first(server.port());
    if (!first.read_registers()) throw std::runtime_error("bench: no block");
    std::vector<double> resident_kb = {server.resident_kb()};
    std::vector<RawModbus> clients;
    while (clients.size() < 200) {
      clients.emplace_back(server.port());
      if (!clients.back().read_registers()) throw std::runtime_error("bench: no block");
      if (clients.size() % 100 == 0) resident_kb.push_back(server.resident_kb());
    }
    state.counters["server_kb"] = resident_kb[0];
    state.counters["first_100_kb"] = resident_kb[1] - resident_kb[0];
    state.counters["next_100_kb"] = resident_kb[2] - resident_kb[1];
  }
}

// How long a robot waits for one read, in us; at most half a minute.
double patient_read_us(RawModbus& robot) {
  const auto start = steady_clock::now();
  robot.send(adu(1, read_pdu(4, 0, reg::block_size)));
  pollfd ready{robot.descriptor(), POLLIN, 0};
  ::poll(&ready, 1, 30000);
  const double time_us = microseconds(steady_clock::now() - start);
  if (robot.receive().empty()) throw std::runtime_error("bench: no answer");
  return time_us;
}

// Somebody sends half a request just before the robot asks; then somebody else a byte every 400 ms.
void broken_frame(benchmark::State& state, ServerKind kind) {
  const Bytes whole = adu(1, command_pdu({5, 1, 1, 0, 0}));
  for (auto _ : state) {
    const ServerProcess server(kind);
    RawModbus robot(server.port()), half(server.port());
    patient_read_us(robot);
    half.send({whole.begin(), whole.begin() + 6});
    std::this_thread::sleep_for(milliseconds(5));
    state.counters["half_us"] = patient_read_us(robot);
    RawModbus slow(server.port());
    patient_read_us(robot);
    std::thread sender([&] {
      for (const std::uint8_t byte : whole) {
        slow.send({byte});
        std::this_thread::sleep_for(milliseconds(400));
      }
    });
    std::this_thread::sleep_for(milliseconds(100));
    state.counters["slow_us"] = patient_read_us(robot);
    sender.join();
  }
}

constexpr auto ours = ServerKind::ours, peer = ServerKind::libmodbus;
#define ONCE Iterations(1)->Unit(benchmark::kMillisecond)
BENCHMARK_CAPTURE(idle, ours, ours)->Arg(1)->Arg(10)->Arg(100)->ONCE;
BENCHMARK_CAPTURE(idle, libmodbus, peer)->Arg(1)->Arg(10)->Arg(100)->ONCE;
BENCHMARK_CAPTURE(reading, ours, ours)->Arg(10)->Arg(100)->ONCE;
BENCHMARK_CAPTURE(reading, libmodbus, peer)->Arg(10)->Arg(100)->ONCE;
BENCHMARK(slow_clients)->ONCE;
BENCHMARK(flood)->ONCE;
BENCHMARK_CAPTURE(memory, ours, ours)->ONCE;
BENCHMARK_CAPTURE(memory, libmodbus, peer)->ONCE;
BENCHMARK_CAPTURE(broken_frame, ours, ours)->ONCE;
BENCHMARK_CAPTURE(broken_frame, libmodbus, peer)->ONCE;

}  // namespace
