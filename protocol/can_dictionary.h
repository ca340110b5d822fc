// The object dictionary of the CAN node: one table, which the SDO server, the EDS file and the page for the
// robot programmer are made from. Pure.
#pragma once

#include <string>
#include <string_view>

#include "protocol/can_codec.h"

namespace zeropose {

// Why a result is not let out until somebody has looked (docs/can.md).
enum class CanFault : std::uint8_t { none = 0, foreign_sender = 1, bus_off = 2 };

// What the objects are read from.
struct CanNodeState {
  CanCoding coding;
  bool fd = false;
  ResultBlock block;                 // fitted to CAN
  std::uint16_t heartbeat_ms = 500;  // 0: none
  std::uint8_t error_register = 0;
  CanFault fault = CanFault::none;
  std::uint32_t refused_commands = 0, ignored_frames = 0, unconfirmed_frames = 0;
};

enum class CanType : std::uint8_t { int16 = 3, int32 = 4, uint8 = 5, uint16 = 6, uint32 = 7 };  // CiA 301
enum class CanAccess { constant, read_only, read_write, pdo_only };  // pdo_only: written by RPDO1 alone

struct CanObject {
  std::uint16_t index;
  std::uint8_t sub;
  CanType type;
  CanAccess access;
  std::string_view record;  // name of the index, where it has several sub-indices
  std::string_view name;
  std::string_view meaning;
  std::uint32_t (*read)(const CanNodeState&);
  bool per_node = false;  // its value contains the node id, and is that of node 0 without it
  bool mappable = false;  // stands in a PDO

  std::size_t size() const;  // bytes: 1, 2 or 4
};

// Ascending. Sub-index 0 of a record, which says how many there are, is not in it.
std::span<const CanObject> can_objects();
struct FoundCanObject {
  const CanObject* object = nullptr;
  bool known_index = false;
  std::uint8_t sub_count = 0;  // of a record, else 0
};
FoundCanObject find_can_object(std::uint16_t index, std::uint8_t sub);

// docs/robots/zeropose.eds (CiA 306), for node 1..127, and the table of docs/can.md.
std::string eds_file();
std::string can_dictionary_markdown();

}  // namespace zeropose
