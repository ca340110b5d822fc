// The parameters of a calibrated camera by name, and sets of them.
#pragma once

#include <array>
#include <bitset>
#include <initializer_list>
#include <optional>
#include <string_view>

namespace zeropose {

// x .. rz: the six numbers of X_WC.
enum class Parameter { fx, fy, cx, cy, K, k1, k2, p1, p2, k3, x, y, z, rx, ry, rz };
inline constexpr std::size_t parameter_count = 16;

std::string_view name_of(Parameter parameter);  // "fx", "K", ...
std::optional<Parameter> parameter_named(std::string_view name);

class ParameterSet {
 public:
  ParameterSet() = default;
  ParameterSet(std::initializer_list<Parameter> parameters) {
    for (const Parameter parameter : parameters) add(parameter);
  }
  void add(Parameter parameter) { bits_.set(static_cast<std::size_t>(parameter)); }
  void add(const ParameterSet& others) { bits_ |= others.bits_; }
  void remove(Parameter parameter) { bits_.reset(static_cast<std::size_t>(parameter)); }
  bool has(Parameter parameter) const { return bits_.test(static_cast<std::size_t>(parameter)); }
  bool has_all(const ParameterSet& others) const { return (bits_ & others.bits_) == others.bits_; }
  std::size_t size() const { return bits_.count(); }
  bool operator==(const ParameterSet&) const = default;

 private:
  std::bitset<parameter_count> bits_;
};

inline const ParameterSet pose_parameters{Parameter::x,  Parameter::y,  Parameter::z,
                                          Parameter::rx, Parameter::ry, Parameter::rz};
inline const ParameterSet lens_parameters{Parameter::K,  Parameter::k1, Parameter::k2,
                                          Parameter::p1, Parameter::p2, Parameter::k3};

}  // namespace zeropose
