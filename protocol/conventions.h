// How robot makers write a pose, and how it goes over the wire (spec 10, 80). The only place that knows.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// Numbers as on the wire.
enum class Convention : std::uint16_t {
  generic = 1,
  kuka,
  fanuc,
  yaskawa,
  mitsubishi,
  epson,
  kawasaki,
  comau,
  staubli,
  abb,
  universal_robots,
  denso,
  techman,
  adept,
  doosan,
  matrix = 100,  // 4x4 row by row, files only: never on the wire
};

std::string_view name_of(Convention convention);  // "kuka", "universal-robots", ...
std::optional<Convention> convention_named(std::string_view name);
std::span<const Convention> all_conventions();
std::vector<std::string_view> field_names(Convention convention);  // "X", "Y", "Z", "A", "B", "C"

// The maker's numbers in the maker's units and order (spec 10): 6, 7 (ABB) or 16 (matrix).
std::vector<double> to_maker(Convention convention, const Pose& X_AB);
// nullopt: wrong count, not finite, quaternion or matrix that is no rotation.
std::optional<Pose> from_maker(Convention convention, std::span<const double> values);

}  // namespace zeropose
