#include "config/robot_link.h"

#include <array>
#include <optional>

#include "config/camera_options.h"
#include "config/ipv4.h"
#include "config/text.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

enum Kind : std::size_t { modbus_tcp, modbus_rtu, modbus_client, can };

// Everything that a link may have; which of it counts is decided by its type.
struct AnyLink {
  std::size_t kind = modbus_tcp;
  bool known = false;  // the kind
  ModbusTcpOptions tcp;
  ModbusRtuOptions rtu;
  ModbusClientOptions client;
  CanOptions can;
  SerialLine line;
};

template <class Number>
void read_whole(JsonObject& object, std::string_view key, int least, int most, Number& value) {
  int number = static_cast<int>(value);
  if (object.read_optional(key, number, least, most)) value = static_cast<Number>(number);
}

void read_time(JsonObject& object, std::string_view key, int least, int most, milliseconds& value) {
  int number = static_cast<int>(value.count());
  if (object.read_optional(key, number, least, most)) value = milliseconds(number);
}

void read_addresses(JsonObject& object, std::string_view key, std::vector<std::string>& addresses) {
  object.read_optional(key, addresses);
  for (std::size_t i = 0; i < addresses.size(); ++i)
    if (!is_ipv4(addresses[i]))
      object.add_mistake(path_of(std::string(key), i), in_quotes(addresses[i]),
                         "an IPv4 address such as 192.168.10.11");
}

void read_line(JsonObject& object, SerialLine& line) {
  constexpr std::array<std::string_view, 3> parities{"none", "even", "odd"};
  std::size_t parity = 1;
  object.read_optional("device", line.device);
  read_whole(object, "baud", 1200, 921600, line.baud);
  object.skip("parity");
  if (object.has("parity")) object.read_word("parity", parities, parity);
  line.parity = "NEO"[parity];
  read_whole(object, "stop_bits", 1, 2, line.stop_bits);
  try {
    check(line);
  } catch (const std::invalid_argument& error) {
    if (object.has("baud")) object.add_mistake("baud", std::to_string(line.baud), error.what());
  }
}

void read_client(JsonObject& object, ModbusClientOptions& client) {
  read_whole(object, "command_address", 0, 65535, client.command_address);
  read_whole(object, "result_address", 0, 65535, client.result_address);
  read_whole(object, "life_address", 0, 65535, client.life_address);
  read_time(object, "poll_ms", 1, 1000, client.poll_period);
  read_time(object, "response_timeout_ms", 1, 1000, client.response_timeout);
  read_whole(object, "max_registers", 10, 123, client.max_registers);
}

void read_can(JsonObject& object, CanOptions& can) {
  object.read_optional("interface", can.interface);
  read_whole(object, "node", 1, 127, can.node);
  object.read_optional("fd", can.fd);
  object.read_optional("length_scale_um", can.length_scale_um, NumberRange{1, 10000});
  object.read_optional("angle_scale_deg", can.angle_scale_deg, NumberRange{1e-4, 1});
  object.read_optional("rotation_vector_scale_rad", can.rotation_vector_scale_rad, NumberRange{1e-6, 1e-3});
  object.read_optional("start_at_once", can.start_at_once);
}

struct LinkKey {
  std::string_view key;
  std::array<bool, 4> of;  // in the order of the kinds
};
constexpr LinkKey link_keys[] = {{"address", {true, false, true, false}},
                                 {"port", {true, false, true, false}},
                                 {"unit", {true, true, true, false}},
                                 {"device", {false, true, true, false}},
                                 {"baud", {false, true, true, false}},
                                 {"parity", {false, true, true, false}},
                                 {"stop_bits", {false, true, true, false}},
                                 {"gap_tolerance_ms", {false, true, false, false}},
                                 {"command_address", {false, false, true, false}},
                                 {"result_address", {false, false, true, false}},
                                 {"life_address", {false, false, true, false}},
                                 {"poll_ms", {false, false, true, false}},
                                 {"response_timeout_ms", {false, false, true, false}},
                                 {"max_registers", {false, false, true, false}},
                                 {"heartbeat_ms", {false, false, true, true}},
                                 {"interface", {false, false, false, true}},
                                 {"node", {false, false, false, true}},
                                 {"fd", {false, false, false, true}},
                                 {"length_scale_um", {false, false, false, true}},
                                 {"angle_scale_deg", {false, false, false, true}},
                                 {"rotation_vector_scale_rad", {false, false, false, true}},
                                 {"start_at_once", {false, false, false, true}}};

void check_keys(JsonObject& object, const AnyLink& link) {
  const std::string type(link_names[link.kind]);
  for (const auto& [key, of] : link_keys)
    if (object.has(key) && !of[link.kind])
      object.add_mistake(key, "a key of another type of link", concat({"no such key with type ", type}));
  const auto demand = [&](std::string_view key, const std::string& what) {
    if (!object.has(key)) object.add_mistake(key, "nothing", what);
  };
  const bool serial_client = link.kind == modbus_client && object.has("device");
  if (serial_client && object.has("address"))
    object.add_mistake("device", "a device beside an address", "one of the two");
  if (link.kind == modbus_rtu) demand("device", "a serial device such as /dev/serial/by-id/...");
  if (link.kind == modbus_tcp || (link.kind == modbus_client && !serial_client)) {
    demand("address", "an IPv4 address such as 192.168.10.11");
    demand("port", "an integer from 1 to 65535");
  }
  if (link.kind == can) demand("interface", "a CAN interface such as can0");
}

void read_members(JsonObject& object, AnyLink& link) {
  link.known = object.read_word("type", link_names, link.kind);
  std::string address;
  int port = 0, unit = 1;
  object.skip("address");
  if (object.has("address")) read_address(object, "address", address);
  object.read_optional("port", port, 1, 65535);
  object.read_optional("unit", unit, link.kind == modbus_rtu ? 1 : 0, link.kind == modbus_tcp ? 255 : 247);
  read_line(object, link.line);
  read_time(object, "gap_tolerance_ms", 0, 100, link.rtu.gap_tolerance);
  read_client(object, link.client);
  read_can(object, link.can);
  // A robot takes a life that stands still for a second for a dead one.
  read_time(object, "heartbeat_ms", link.kind == can ? 0 : 10, link.kind == can ? 65535 : 300,
            link.kind == can ? link.can.heartbeat : link.client.heartbeat_period);
  if (link.known) check_keys(object, link);
  link.tcp.address = address;
  link.tcp.port = static_cast<std::uint16_t>(port);
  link.tcp.robot.unit.unit = link.rtu.unit.unit = link.client.unit = static_cast<std::uint8_t>(unit);
  link.rtu.line = link.line;
  if (object.has("device"))
    link.client.where = link.line;
  else
    link.client.where = ModbusTcpAddress{address, static_cast<std::uint16_t>(port)};
}

}  // namespace

LinkOptions read_link_options(JsonObject& robot) {
  AnyLink link;
  ModbusUnit unit;
  robot.read("link", [&link](JsonObject& object) { read_members(object, link); });
  robot.read_optional("require_command_crc", unit.require_command_crc);
  read_whole(robot, "result_data_id", 0, 65535, unit.result_data_id);
  read_whole(robot, "command_data_id", 0, 65535, unit.command_data_id);
  read_addresses(robot, "allowed_writers", link.tcp.robot.allowed_writers);
  read_addresses(robot, "allowed_readers", link.tcp.robot.allowed_readers);
  for (const std::string_view key : {"allowed_writers", "allowed_readers"})
    if (link.known && link.kind != modbus_tcp && robot.has(key))
      robot.add_mistake(key, "a list of addresses", "no such key with a link that is not modbus-tcp");
  unit.unit = link.tcp.robot.unit.unit;
  link.tcp.robot.unit = link.rtu.unit = unit;
  link.client.result_data_id = link.can.result_data_id = unit.result_data_id;
  link.client.command_data_id = unit.command_data_id;
  link.client.require_command_crc = unit.require_command_crc;
  switch (link.kind) {
    case modbus_rtu:
      return link.rtu;
    case modbus_client:
      return link.client;
    case can:
      return link.can;
    default:
      return link.tcp;
  }
}

}  // namespace zeropose
