// Not times but errors: find_marks() on pictures whose formation is not the estimator's, with and without
// noise.
#include <benchmark/benchmark.h>

#include <vector>

#include "tests/support/formation.h"

namespace zeropose {
namespace {

using test::Formation;

std::vector<Formation> formations() {
  std::vector<Formation> all;
  for (const double gamma : {1.0, 0.45}) {
    for (const int quality : {0, 90}) {
      for (const double zero_px : {1.2, 1.8, 2.5}) {
        Formation f;
        f.lens.first_zero_px = zero_px;
        f.sensor.gamma = gamma, f.sensor.quality = quality;
        all.push_back(f);
      }
      Formation measured = all[all.size() - 3], corner = measured;
      measured.lens.second_zero_px = 2.5, measured.lens.second_share = 0.3, measured.lens.veil_share = 0.04;
      corner.lens.focal_px = 500, corner.lens.axis_px = {-250, -180};
      all.push_back(measured);
      all.push_back(corner);
    }
  }
  return all;
}

void error_of_formation(benchmark::State& state, const Formation& formation) {
  const auto diameter = static_cast<double>(state.range(0));
  test::FormationFigures quiet, noisy;
  for (auto _ : state) {
    quiet = measure_without_noise(formation, diameter, 400);
    noisy = measure_with_noise(formation, diameter, 100, 20);
  }
  state.counters["bias_px"] = quiet.bias_px.norm();
  state.counters["quiet_mean_px"] = quiet.mean_px;
  state.counters["rms_px"] = noisy.rms_px;
  state.counters["sigma_px"] = noisy.sigma_px;
  state.counters["held_95"] = noisy.held;
  state.counters["found"] = quiet.found + noisy.found;  // of 2400
}

const int registered = [] {
  for (const Formation& formation : formations()) {
    benchmark::RegisterBenchmark(name_of(formation).c_str(), error_of_formation, formation)
        ->Arg(20)
        ->Arg(40)
        ->Iterations(1)
        ->Unit(benchmark::kSecond);
  }
  return 0;
}();

}  // namespace
}  // namespace zeropose
