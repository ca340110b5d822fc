#include "protocol/can_dictionary.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

using S = const CanNodeState&;
using enum CanType;
using enum CanAccess;

constexpr std::uint32_t not_in_use = 0x80000000;  // of a PDO's identifier

// An object in a PDO, as the mapping objects write it.
constexpr std::uint32_t mapped(std::uint32_t index, std::uint32_t sub, std::uint32_t bits) {
  return (index << 16) | (sub << 8) | bits;
}

std::uint32_t tpdo_id(S s, std::uint32_t base) { return (base + s.coding.node) | (s.fd ? not_in_use : 0); }

std::uint32_t value(S s, std::size_t i) {
  return static_cast<std::uint32_t>(s.block.has(status_bit::result_valid) ? s.block.values[i]
                                                                          : invalid_value);
}

std::uint32_t steps(S s, std::size_t i) {
  if (!s.block.has(status_bit::result_valid)) return static_cast<std::uint16_t>(invalid_can_value);
  const auto values = to_can_values(s.block.values, s.coding);
  return static_cast<std::uint16_t>(values ? (*values)[i] : invalid_can_value);
}

std::uint32_t commit(S s, std::size_t at, std::size_t count) {
  return get_le(encode_can_result(s.block, s.coding)[2].data, at, count);
}

std::uint32_t thousand(double scale) { return static_cast<std::uint32_t>(std::lround(1000 * scale)); }

constexpr std::string_view identity = "Identity", session = "Session and answer", values = "32-bit values",
                           hashes = "Hashes", link = "Link", command = "Command", result = "Result",
                           sdo = "SDO server", rpdo = "RPDO1", rpdo_map = "RPDO1 mapping", tpdo1 = "TPDO1",
                           tpdo2 = "TPDO2", tpdo3 = "TPDO3", map1 = "TPDO1 mapping", map2 = "TPDO2 mapping",
                           map3 = "TPDO3 mapping", coding = "Coding";

// clang-format off
constexpr CanObject objects[] = {
    {0x1000, 0, uint32, constant, "", "Device type", "no device profile", [](S) { return 0u; }},
    {0x1001, 0, uint8, read_only, "", "Error register", "bit 0 any error, 4 communication (link fault), 7 state Error", [](S s) -> std::uint32_t { return s.error_register; }},
    {0x1014, 0, uint32, constant, "", "EMCY identifier", "0x80 + node", [](S s) { return can_id::emergency + s.coding.node; }, true},
    {0x1017, 0, uint16, read_write, "", "Heartbeat time", "ms; 0: none", [](S s) -> std::uint32_t { return s.heartbeat_ms; }},
    {0x1018, 1, uint32, constant, identity, "Vendor id", "0: none is registered", [](S) { return 0u; }},
    {0x1018, 2, uint32, constant, identity, "Product code", "0x5A50", [](S) { return 0x5A50u; }},
    {0x1018, 3, uint32, constant, identity, "Revision", "of this dictionary: 1", [](S) { return 1u; }},
    {0x1018, 4, uint32, constant, identity, "Serial number", "0: none", [](S) { return 0u; }},
    {0x1200, 1, uint32, constant, sdo, "Identifier of requests", "0x600 + node", [](S s) { return can_id::sdo_request + s.coding.node; }, true},
    {0x1200, 2, uint32, constant, sdo, "Identifier of answers", "0x580 + node", [](S s) { return can_id::sdo_answer + s.coding.node; }, true},
    {0x1400, 1, uint32, constant, rpdo, "Identifier", "0x200 + node", [](S s) { return can_id::rpdo1 + s.coding.node; }, true},
    {0x1400, 2, uint8, constant, rpdo, "Transmission type", "255: at once", [](S) { return 255u; }},
    {0x1600, 1, uint32, constant, rpdo_map, "Request id", "0x2100:1", [](S) { return mapped(0x2100, 1, 16); }},
    {0x1600, 2, uint32, constant, rpdo_map, "Command", "0x2100:2", [](S) { return mapped(0x2100, 2, 8); }},
    {0x1600, 3, uint32, constant, rpdo_map, "Job", "0x2100:3", [](S) { return mapped(0x2100, 3, 8); }},
    {0x1600, 4, uint32, constant, rpdo_map, "Part", "0x2100:4", [](S) { return mapped(0x2100, 4, 32); }},
    {0x1800, 1, uint32, read_only, tpdo1, "Identifier", "0x180 + node; with CAN FD bit 31 says: not in use", [](S s) { return tpdo_id(s, can_id::tpdo1); }, true},
    {0x1800, 2, uint8, constant, tpdo1, "Transmission type", "254: at every change", [](S) { return 254u; }},
    {0x1801, 1, uint32, read_only, tpdo2, "Identifier", "0x280 + node, likewise", [](S s) { return tpdo_id(s, can_id::tpdo2); }, true},
    {0x1801, 2, uint8, constant, tpdo2, "Transmission type", "254: at every change", [](S) { return 254u; }},
    {0x1802, 1, uint32, read_only, tpdo3, "Identifier", "0x380 + node, likewise", [](S s) { return tpdo_id(s, can_id::tpdo3); }, true},
    {0x1802, 2, uint8, constant, tpdo3, "Transmission type", "254: at every change", [](S) { return 254u; }},
    {0x1A00, 1, uint32, constant, map1, "Request id", "0x2200:1", [](S) { return mapped(0x2200, 1, 16); }},
    {0x1A00, 2, uint32, constant, map1, "x", "0x2200:2", [](S) { return mapped(0x2200, 2, 16); }},
    {0x1A00, 3, uint32, constant, map1, "y", "0x2200:3", [](S) { return mapped(0x2200, 3, 16); }},
    {0x1A00, 4, uint32, constant, map1, "z", "0x2200:4", [](S) { return mapped(0x2200, 4, 16); }},
    {0x1A01, 1, uint32, constant, map2, "Request id", "0x2200:1", [](S) { return mapped(0x2200, 1, 16); }},
    {0x1A01, 2, uint32, constant, map2, "rx", "0x2200:5", [](S) { return mapped(0x2200, 5, 16); }},
    {0x1A01, 3, uint32, constant, map2, "ry", "0x2200:6", [](S) { return mapped(0x2200, 6, 16); }},
    {0x1A01, 4, uint32, constant, map2, "rz", "0x2200:7", [](S) { return mapped(0x2200, 7, 16); }},
    {0x1A02, 1, uint32, constant, map3, "Request id", "0x2200:1", [](S) { return mapped(0x2200, 1, 16); }},
    {0x1A02, 2, uint32, constant, map3, "Status and code", "0x2200:8", [](S) { return mapped(0x2200, 8, 16); }},
    {0x1A02, 3, uint32, constant, map3, "CRC-32", "0x2200:9", [](S) { return mapped(0x2200, 9, 32); }},
    {0x2000, 1, uint32, read_only, coding, "Length scale", "nm per step of an int16", [](S s) { return thousand(s.coding.length_scale); }},
    {0x2000, 2, uint32, read_only, coding, "Angle scale", "per step of an int16: 0.0000001 deg, with Universal Robots 0.000000001 rad", [](S s) { return thousand(s.coding.angle_scale); }},
    {0x2000, 3, uint16, read_only, coding, "Convention", "number as in docs/modbus.md", [](S s) -> std::uint32_t { return s.block.convention; }},
    {0x2000, 4, uint16, read_only, coding, "Frame of the values", "1 object zero, 2 world shift, 3 robot-base shift, 4 user frame", [](S s) -> std::uint32_t { return s.block.frame; }},
    {0x2000, 5, uint16, read_only, coding, "Robot index", "1.. in the order of the config", [](S s) -> std::uint32_t { return s.block.robot_index; }},
    {0x2001, 1, uint32, read_only, session, "Session epoch", "goes into the CRC; changes at start-up and when the link is lost; never 0", [](S s) { return s.block.epoch; }},
    {0x2001, 2, uint16, read_only, session, "Sequence", "counts the published answers: equal before and after, then what was read belongs together", [](S s) -> std::uint32_t { return s.block.sequence; }},
    {0x2001, 3, uint16, read_only, session, "State", "0 Preoperational, 1 Initialized, 2 Ready, 3 SingleExecution, 4 Halted, 5 Error", [](S s) { return static_cast<std::uint32_t>(s.block.state); }},
    {0x2001, 4, uint16, read_only, session, "Status bits", "as in docs/modbus.md", [](S s) -> std::uint32_t { return s.block.status; }},
    {0x2001, 5, uint16, read_only, session, "Code", "0 ok, else why not (docs/codes.md)", [](S s) -> std::uint32_t { return s.block.code; }},
    {0x2001, 6, uint32, read_only, session, "Request id", "of the request under way or of the answer; 0: neither", [](S s) { return s.block.request_id; }},
    {0x2001, 7, uint16, read_only, session, "Job", "as in the command", [](S s) -> std::uint32_t { return s.block.job; }},
    {0x2001, 8, uint32, read_only, session, "Part id", "as in the command", [](S s) { return s.block.part; }},
    {0x2001, 9, uint16, read_only, session, "Age", "ms since the answer was published; 65535: none, or older", [](S s) -> std::uint32_t { return s.block.age_ms; }},
    {0x2001, 10, uint16, read_only, session, "Validity", "ms from publication until the result is withdrawn", [](S s) -> std::uint32_t { return s.block.validity_ms; }},
    {0x2001, 11, uint16, read_only, session, "Effective marks", "that took part in the estimate", [](S s) -> std::uint32_t { return s.block.effective_marks; }},
    {0x2001, 12, uint16, read_only, session, "Effective cameras", "that took part in the estimate", [](S s) -> std::uint32_t { return s.block.effective_cameras; }},
    {0x2001, 13, uint16, read_only, session, "Largest deviation", "um, rounded up; 65535: none, or beyond", [](S s) -> std::uint32_t { return s.block.largest_deviation_um; }},
    {0x2001, 14, uint16, read_only, session, "Sigma", "um at the worst application point, rounded up; 65535: none, or beyond", [](S s) -> std::uint32_t { return s.block.sigma_um; }},
    {0x2002, 1, int32, read_only, values, "x", "um; like all of these 0x80000000 without a valid result", [](S s) { return value(s, 0); }},
    {0x2002, 2, int32, read_only, values, "y", "um", [](S s) { return value(s, 1); }},
    {0x2002, 3, int32, read_only, values, "z", "um", [](S s) { return value(s, 2); }},
    {0x2002, 4, int32, read_only, values, "rx", "0.0001 deg, with Universal Robots 0.000001 rad", [](S s) { return value(s, 3); }},
    {0x2002, 5, int32, read_only, values, "ry", "likewise", [](S s) { return value(s, 4); }},
    {0x2002, 6, int32, read_only, values, "rz", "likewise", [](S s) { return value(s, 5); }},
    {0x2003, 1, uint32, read_only, hashes, "Config hash", "first four bytes of the file's SHA-256", [](S s) { return s.block.config_hash; }},
    {0x2003, 2, uint32, read_only, hashes, "Calibration hash", "first four bytes of the file's SHA-256", [](S s) { return s.block.calibration_hash; }},
    {0x2003, 3, uint32, read_only, hashes, "Zero id", "of the zero measurement in use", [](S s) { return s.block.zero_id; }},
    {0x2004, 1, uint8, read_only, link, "Latched fault", "0 none, 1 foreign sender, 2 bus-off", [](S s) { return static_cast<std::uint32_t>(s.fault); }},
    {0x2004, 2, uint32, read_only, link, "Refused commands", "since the start", [](S s) { return s.refused_commands; }},
    {0x2004, 3, uint32, read_only, link, "Ignored frames", "of wrong form, since the start", [](S s) { return s.ignored_frames; }},
    {0x2004, 4, uint32, read_only, link, "Unconfirmed frames", "sent and never seen on the bus, since the start", [](S s) { return s.unconfirmed_frames; }},
    {0x2100, 1, uint16, pdo_only, command, "Request id", "chosen by the robot; not 0, not the last one again", nullptr, false, true},
    {0x2100, 2, uint8, pdo_only, command, "Command", "number", nullptr, false, true},
    {0x2100, 3, uint8, pdo_only, command, "Job", "number as in the cell file", nullptr, false, true},
    {0x2100, 4, uint32, pdo_only, command, "Part", "free; with Zero the guard 0x5A45524F", nullptr, false, true},
    {0x2200, 1, uint16, read_only, result, "Request id", "of the request under way or of the answer; 0: neither", [](S s) { return s.block.request_id; }, false, true},
    {0x2200, 2, int16, read_only, result, "x", "steps of the length scale; like all of these 0x8000 without a valid result", [](S s) { return steps(s, 0); }, false, true},
    {0x2200, 3, int16, read_only, result, "y", "likewise", [](S s) { return steps(s, 1); }, false, true},
    {0x2200, 4, int16, read_only, result, "z", "likewise", [](S s) { return steps(s, 2); }, false, true},
    {0x2200, 5, int16, read_only, result, "rx", "steps of the angle scale", [](S s) { return steps(s, 3); }, false, true},
    {0x2200, 6, int16, read_only, result, "ry", "likewise", [](S s) { return steps(s, 4); }, false, true},
    {0x2200, 7, int16, read_only, result, "rz", "likewise", [](S s) { return steps(s, 5); }, false, true},
    {0x2200, 8, uint16, read_only, result, "Status and code", "upper 6 bits status, lower 10 code", [](S s) { return commit(s, 2, 2); }, false, true},
    {0x2200, 9, uint32, read_only, result, "CRC-32", "of the three frames and the epoch", [](S s) { return commit(s, 4, 4); }, false, true},
};
// clang-format on

}  // namespace

std::size_t CanObject::size() const {
  if (type == uint8) return 1;
  return type == uint16 || type == int16 ? 2 : 4;
}

std::span<const CanObject> can_objects() { return objects; }

FoundCanObject find_can_object(std::uint16_t index, std::uint8_t sub) {
  FoundCanObject found;
  for (const CanObject& object : objects) {
    if (object.index != index) continue;
    found.known_index = true;
    found.sub_count = std::max(found.sub_count, object.sub);
    if (object.sub == sub) found.object = &object;
  }
  return found;
}

}  // namespace zeropose
