#include "protocol/crc32.h"

#include <array>

namespace zeropose {
namespace {

constexpr std::uint32_t reflected_polynomial = 0xC8DF352F;  // 0xF4ACFB13, bits reversed

constexpr std::array<std::uint32_t, 256> make_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t value = byte;
    for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) ? reflected_polynomial : 0);
    table[byte] = value;
  }
  return table;
}

constexpr auto table = make_table();

constexpr std::uint32_t step(std::uint32_t crc, unsigned byte) {
  return table[(crc ^ byte) & 0xFF] ^ (crc >> 8);
}

constexpr std::uint32_t step_word(std::uint32_t crc, std::uint16_t word) {
  return step(step(crc, word >> 8), word & 0xFFu);
}

}  // namespace

std::uint32_t crc32_autosar(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) crc = step(crc, byte);
  return ~crc;
}

std::uint32_t crc32_of_registers(std::uint16_t data_id, std::span<const std::uint16_t> registers) {
  std::uint32_t crc = step_word(0xFFFFFFFF, data_id);
  for (const std::uint16_t value : registers) crc = step_word(crc, value);
  return ~crc;
}

}  // namespace zeropose
