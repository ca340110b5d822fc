// What a frame costs from request to pixels: the camera, the network and the library (the simulated camera
// looks for triggers every 5 ms), and what this project adds to them.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "drivers/camera_worker.h"
#include "sim/gige_server.h"
#include "tests/support/netns.h"

namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using namespace zeropose;

double milliseconds(steady_clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double cpu_ms() {  // of the calling thread
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  const auto ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * 4096 / 1e6;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// range(0) x range(1) pixels; through a CameraWorker as in the daemon.
void request_to_pixels(benchmark::State& state) {
  CameraOptions options;
  options.name = "camera";
  options.gige.address = "127.0.0.11";
  options.width_px = static_cast<int>(state.range(0));
  options.height_px = static_cast<int>(state.range(1));
  ServedCamera served;
  served.name = options.name;
  served.address = options.gige.address;
  served.width_px = options.width_px;
  served.height_px = options.height_px;
  GigeServer server({served}, [](std::size_t, std::span<std::uint8_t> pixels) {
    std::fill(pixels.begin(), pixels.end(), 100);
  });
  const double before_mb = resident_mb();
  CameraWorker worker(options);
  while (worker.state() != CameraState::alive) std::this_thread::sleep_for(10ms);
  std::vector<double> latency_ms, added_ms;
  int refused = 0;
  const double cpu = cpu_ms();
  for (auto _ : state) {
    const TimePoint requested = steady_clock::now();
    const GrabResult result = worker.request(requested + 2s).wait();
    const TimePoint there = steady_clock::now();
    if (result.status != GrabStatus::ok) {
      ++refused;
      continue;
    }
    latency_ms.push_back(milliseconds(there - requested));
    added_ms.push_back(milliseconds((result.frame.triggered - requested) + (there - result.frame.received)));
  }
  if (latency_ms.empty()) return;
  state.counters["latency_median_ms"] = quantile(latency_ms, 0.5);
  state.counters["latency_p99_ms"] = quantile(latency_ms, 0.99);
  state.counters["added_median_ms"] = quantile(added_ms, 0.5);
  state.counters["added_p99_ms"] = quantile(added_ms, 0.99);
  state.counters["asking_cpu_ms"] = (cpu_ms() - cpu) / static_cast<double>(latency_ms.size());
  state.counters["refused"] = refused;
  state.counters["camera_mb"] = resident_mb() - before_mb;
}
BENCHMARK(request_to_pixels)
    ->Args({768, 572})
    ->Args({1280, 1024})
    ->Args({2448, 2048})
    ->UseRealTime()
    ->Iterations(300)
    ->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> addresses = {"127.0.0.11"};
  const std::string impossible = enter_private_network(addresses);
  if (!impossible.empty()) {
    std::printf("not run: %s\n", impossible.c_str());
    return 0;
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
