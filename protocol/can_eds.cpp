// The files that are made from the object dictionary: EDS (CiA 306) and Markdown.
#include <iomanip>
#include <set>
#include <sstream>

#include "protocol/can_dictionary.h"

namespace zeropose {
namespace {

std::string hex(std::uint32_t number, int digits) {
  std::ostringstream text;
  text << std::uppercase << std::hex << std::setfill('0') << std::setw(digits) << number;
  return text.str();
}

std::string_view access_of(const CanObject& object) {
  switch (object.access) {
    case CanAccess::constant:
      return "const";
    case CanAccess::read_only:
      return "ro";
    case CanAccess::read_write:
      return "rw";
    case CanAccess::pdo_only:
      break;
  }
  return "wo";
}

std::string_view type_of(const CanObject& object) {
  switch (object.type) {
    case CanType::int16:
      return "int16";
    case CanType::int32:
      return "int32";
    case CanType::uint8:
      return "u8";
    case CanType::uint16:
      return "u16";
    case CanType::uint32:
      break;
  }
  return "u32";
}

// What does not change while the node runs, or not by itself.
bool has_default(const CanObject& object) {
  return object.access == CanAccess::constant || object.access == CanAccess::read_write || object.per_node;
}

std::string default_value(const CanObject& object) {
  if (!has_default(object)) return "";
  CanNodeState state;
  state.coding.node = 0;
  const std::string number = "0x" + hex(object.read(state), static_cast<int>(2 * object.size()));
  return object.per_node ? "$NODEID+" + number : number;
}

std::string variable(const CanObject& object) {
  std::ostringstream text;
  text << "ParameterName=" << object.name << "\nObjectType=0x7\nDataType=0x"
       << hex(static_cast<std::uint32_t>(object.type), 4) << "\nAccessType=" << access_of(object)
       << "\nDefaultValue=" << default_value(object) << "\nPDOMapping=" << (object.mappable ? 1 : 0)
       << "\n\n";
  return text.str();
}

std::string record(const CanObject& first, std::uint8_t count) {
  std::ostringstream text;
  const std::string index = hex(first.index, 4);
  text << "[" << index << "]\nParameterName=" << first.record << "\nObjectType=0x9\nSubNumber=0x"
       << hex(count + 1u, 1) << "\n\n[" << index
       << "sub0]\nParameterName=Number of "
          "entries\nObjectType=0x7\nDataType=0x0005\nAccessType=const\nDefaultValue=0x"
       << hex(count, 2) << "\nPDOMapping=0\n\n";
  return text.str();
}

std::string sections() {
  std::ostringstream text;
  std::uint16_t last = 0;
  for (const CanObject& object : can_objects()) {
    if (object.sub == 0) {
      text << "[" << hex(object.index, 4) << "]\n" << variable(object);
      continue;
    }
    if (object.index != last) text << record(object, find_can_object(object.index, 1).sub_count);
    last = object.index;
    text << "[" << hex(object.index, 4) << "sub" << hex(object.sub, 1) << "]\n" << variable(object);
  }
  return text.str();
}

enum class Area { mandatory, optional, manufacturer };

Area area_of(std::uint16_t index) {
  if (index == 0x1000 || index == 0x1001 || index == 0x1018) return Area::mandatory;
  return index < 0x2000 ? Area::optional : Area::manufacturer;
}

std::string list_of(Area area, std::string_view name) {
  std::set<std::uint16_t> indices;
  for (const CanObject& object : can_objects())
    if (area_of(object.index) == area) indices.insert(object.index);
  std::ostringstream text;
  text << "[" << name << "]\nSupportedObjects=" << indices.size() << '\n';
  std::size_t number = 0;
  for (const std::uint16_t index : indices) text << ++number << "=0x" << hex(index, 4) << '\n';
  text << '\n';
  return text.str();
}

constexpr std::string_view head = R"([FileInfo]
FileName=zeropose.eds
FileVersion=1
FileRevision=0
EDSVersion=4.0
Description=Corrections for robots that cameras guide
CreationTime=12:00AM
CreationDate=01-01-2026
CreatedBy=zeropose
ModificationTime=12:00AM
ModificationDate=01-01-2026
ModifiedBy=zeropose

[DeviceInfo]
VendorName=zeropose
VendorNumber=0x00000000
ProductName=zeropose
ProductNumber=0x00005A50
RevisionNumber=0x00000001
OrderCode=
BaudRate_10=1
BaudRate_20=1
BaudRate_50=1
BaudRate_125=1
BaudRate_250=1
BaudRate_500=1
BaudRate_800=1
BaudRate_1000=1
SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=0
DynamicChannelsSupported=0
GroupMessaging=0
NrOfRXPDO=1
NrOfTXPDO=3
LSS_Supported=0

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=0
Dummy0006=0
Dummy0007=0

[Comments]
Lines=2
Line1=Node id and bit rate are set on the computer, see docs/can.md.
Line2=A result counts only whole, with the own request id, within 50 ms and with the CRC right.

)";

}  // namespace

std::string eds_file() {
  return std::string(head) + list_of(Area::mandatory, "MandatoryObjects") +
         list_of(Area::optional, "OptionalObjects") + list_of(Area::manufacturer, "ManufacturerObjects") +
         sections();
}

std::string can_dictionary_markdown() {
  std::ostringstream text;
  text << "| index:sub | name | type | access | meaning |\n|---|---|---|---|---|\n";
  for (const CanObject& object : can_objects()) {
    text << "| " << hex(object.index, 4);
    if (object.sub != 0) text << ':' << static_cast<int>(object.sub);
    text << " | " << object.record << (object.record.empty() ? "" : ": ") << object.name << " | "
         << type_of(object) << " | " << access_of(object) << " | " << object.meaning << " |\n";
  }
  return text.str();
}

}  // namespace zeropose
