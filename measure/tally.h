// How often each of a few values occurs. Internal to the room.
#pragma once

#include <array>
#include <cstddef>

namespace zeropose {

// Neighbouring pixels are alike, and one counter that is raised again and again waits for itself each time:
// so four take turns.
template <std::size_t values>
class Tally {
 public:
  using Counts = std::array<int, values>;

  // turn: any number that goes on by one from pixel to pixel.
  void add(std::size_t turn, int value) { ++counts_[turn % counts_.size()][static_cast<std::size_t>(value)]; }

  Counts counts() const {
    Counts sum{};
    for (const Counts& counts : counts_)
      for (std::size_t value = 0; value < values; ++value) sum[value] += counts[value];
    return sum;
  }

 private:
  std::array<Counts, 4> counts_{};
};

}  // namespace zeropose
