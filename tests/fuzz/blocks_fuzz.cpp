// Registers of any content as the command block, the position block and the result block: what is decoded is
// what encodes to them again.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "protocol/codec.h"
#include "protocol/crc32.h"

namespace zeropose {
namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void put_crc(std::vector<std::uint16_t>& registers, std::size_t at, std::uint16_t data_id) {
  if (registers.size() < at + 2) return;
  const std::uint32_t crc = crc32_of_registers(data_id, std::span<const std::uint16_t>(registers).first(at));
  registers[at] = static_cast<std::uint16_t>(crc >> 16);
  registers[at + 1] = static_cast<std::uint16_t>(crc & 0xFFFF);
}

void commands(std::vector<std::uint16_t> registers, bool right_crc) {
  if (right_crc) put_crc(registers, command_reg::crc, default_command_data_id);
  if (const auto command = decode_command(registers))
    require(std::ranges::equal(encode_command(*command), registers), "a command is its registers");
  if (right_crc) require(decode_command(registers).has_value() == (registers.size() == 10), "ten registers");
}

void positions(std::vector<std::uint16_t> registers, bool right_crc, Convention convention) {
  if (right_crc) put_crc(registers, position_reg::crc, default_command_data_id);
  const auto position = decode_position(registers);
  if (!position) return;
  require(std::ranges::equal(encode_position(*position), registers), "a position is its registers");
  const auto X_RH = from_wire(convention, position->values);
  if (!X_RH) return;
  require(X_RH->matrix().allFinite(), "a pose is finite");
  require(std::abs(X_RH->linear().determinant() - 1) < 1e-6, "a pose is a rotation");
}

void results(std::vector<std::uint16_t> registers, bool right_crc) {
  if (right_crc && registers.size() == reg::block_size) {
    registers[reg::magic] = block_magic;
    registers[reg::map_version] = block_map_version;
    registers[reg::sequence_end] = registers[reg::sequence_begin];
    put_crc(registers, reg::crc, default_result_data_id);
    require(!decode_result(registers).problem, "a block with its CRC is one");
  }
  const DecodedBlock decoded = decode_result(registers);
  if (decoded.problem) require(decoded.block == ResultBlock{}, "a bad block shows nothing");
}

void take(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 1; i + 1 < bytes.size(); i += 2)
    registers.push_back(static_cast<std::uint16_t>(bytes[i] << 8 | bytes[i + 1]));
  const bool right_crc = (bytes[0] & 1) != 0;
  commands(registers, right_crc);
  positions(registers, right_crc, static_cast<Convention>(1 + (bytes[0] >> 1) % 15));
  results(registers, right_crc);
}

}  // namespace
}  // namespace zeropose

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zeropose::take({data, size});
  return 0;
}
