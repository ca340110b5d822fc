// One frame as it is on the bus, before it is a struct of the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace zeropose {

struct CanFrame {
  std::uint32_t id = 0;   // 11 or 29 bits; of an error frame its class, as in linux/can/error.h
  bool extended = false;  // 29 bits
  bool remote = false;
  bool error = false;  // told by the controller, never on the bus
  bool fd = false;
  std::uint8_t size = 0;  // bytes: up to 8, with fd up to 64
  std::array<std::uint8_t, 64> data{};

  std::span<const std::uint8_t> bytes() const {
    return std::span<const std::uint8_t>(data).first(size < data.size() ? size : data.size());
  }
  friend bool operator==(const CanFrame&, const CanFrame&) = default;
};

// Little-endian, as in CANopen.
constexpr void put_le(std::span<std::uint8_t> bytes, std::size_t at, std::size_t count, std::uint64_t value) {
  for (std::size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

constexpr std::uint32_t get_le(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value |= std::uint32_t{bytes[at + i]} << (8 * i);
  return value;
}

}  // namespace zeropose
