// CRC-32/AUTOSAR: polynomial 0xF4ACFB13 reflected, init and final xor 0xFFFFFFFF (spec 80).
#pragma once

#include <cstdint>
#include <span>

namespace zeropose {

std::uint32_t crc32_autosar(std::span<const std::uint8_t> bytes);

// Over a data id that is not on the wire, then the registers, each high byte first.
std::uint32_t crc32_of_registers(std::uint16_t data_id, std::span<const std::uint16_t> registers);

}  // namespace zeropose
