#include "calib/parameters.h"

namespace zeropose {
namespace {

constexpr std::array<std::string_view, parameter_count> names{"fx", "fy", "cx", "cy", "K", "k1", "k2", "p1",
                                                              "p2", "k3", "x",  "y",  "z", "rx", "ry", "rz"};

}  // namespace

std::string_view name_of(Parameter parameter) { return names[static_cast<std::size_t>(parameter)]; }

std::optional<Parameter> parameter_named(std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == name) return static_cast<Parameter>(i);
  return std::nullopt;
}

}  // namespace zeropose
