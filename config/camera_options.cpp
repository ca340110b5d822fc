#include "config/camera_options.h"

#include <array>

#include "config/ipv4.h"
#include "config/text.h"

namespace zeropose {
namespace {

// In the order of the enumerations.
constexpr std::array<std::string_view, 3> driver_names{"gige", "v4l2", "folder"};
constexpr std::array<std::string_view, 8> format_names{"mono8",         "mono10",        "mono12", "mono16",
                                                       "mono10_packed", "mono12_packed", "yuyv",   "mjpeg"};
constexpr std::array<std::string_view, 3> trigger_names{"software", "line", "free_run"};
constexpr std::array<std::string_view, 3> packet_socket_names{"automatic", "never", "always"};
constexpr std::array<std::string_view, 3> fields_names{"both", "top", "bottom"};

template <class Enumeration, std::size_t Count>
void read_choice(JsonObject& object, std::string_view key, const std::array<std::string_view, Count>& names,
                 Enumeration& value) {
  std::size_t index = static_cast<std::size_t>(value);
  object.skip(key);
  if (object.has(key) && object.read_word(key, names, index)) value = static_cast<Enumeration>(index);
}

void read_number(JsonObject& object, std::string_view key, NumberRange range, std::optional<double>& number) {
  double value = 0;
  if (object.read_optional(key, value, range)) number = value;
}

void read_network(JsonObject& object, GigeOptions& gige) {
  object.read_optional("interface", gige.interface);
  object.read_optional("packet_bytes", gige.packet_bytes, 576, 16384);
  read_choice(object, "packet_socket", packet_socket_names, gige.packet_socket);
  object.read_optional("resend", gige.resend);
  object.read_optional("ptp", gige.ptp);
}

void read_gige(JsonObject& object, GigeOptions& gige) {
  object.skip("address");
  if (object.has("address")) read_address(object, "address", gige.address);
  object.read_optional("serial", gige.serial);
  object.read_optional("user_name", gige.user_name);
  object.read_optional("trigger_line", gige.trigger_line);
  object.read_optional("network", [&gige](JsonObject& network) { read_network(network, gige); });
}

void read_v4l2(JsonObject& object, V4l2Options& v4l2) {
  object.read_optional("device", v4l2.device);
  object.read_optional("input", v4l2.input, 0, 255);
  read_choice(object, "fields", fields_names, v4l2.fields);
  object.read_each_optional("controls", [&v4l2](JsonObject& control) {
    V4l2Control read;
    control.read("name", read.name);
    control.read("value", read.value, -2147483647, 2147483647);
    v4l2.controls.push_back(read);
  });
}

void read_folder(JsonObject& object, FolderOptions& folder) {
  std::string path;
  if (object.read_optional("path", path)) folder.path = path;
  object.read_optional("loop", folder.loop);
}

struct DriverKey {
  std::string_view key;
  CameraDriver driver;
};
constexpr std::array<DriverKey, 11> driver_keys{{{"address", CameraDriver::gige},
                                                 {"serial", CameraDriver::gige},
                                                 {"user_name", CameraDriver::gige},
                                                 {"trigger_line", CameraDriver::gige},
                                                 {"network", CameraDriver::gige},
                                                 {"device", CameraDriver::v4l2},
                                                 {"input", CameraDriver::v4l2},
                                                 {"fields", CameraDriver::v4l2},
                                                 {"controls", CameraDriver::v4l2},
                                                 {"path", CameraDriver::folder},
                                                 {"loop", CameraDriver::folder}}};

void check_keys(JsonObject& object, const CameraOptions& camera) {
  const auto name = [](CameraDriver driver) {
    return std::string(driver_names[static_cast<std::size_t>(driver)]);
  };
  for (const auto& [key, driver] : driver_keys)
    if (object.has(key) && driver != camera.driver)
      object.add_mistake(key, concat({"a key of driver ", name(driver)}),
                         concat({"no such key with driver ", name(camera.driver)}));
  if (camera.driver == CameraDriver::gige && !object.has("address") && !object.has("serial") &&
      !object.has("user_name"))
    object.add_mistake("address", "nothing", "an IPv4 address such as 192.168.10.11, or serial or user_name");
  if (camera.driver == CameraDriver::v4l2 && !object.has("device"))
    object.add_mistake("device", "nothing", "a device file such as /dev/v4l/by-path/...");
  if (camera.driver == CameraDriver::folder && !object.has("path"))
    object.add_mistake("path", "nothing", "a folder of pictures, relative to this file");
}

}  // namespace

void read_address(JsonObject& object, std::string_view key, std::string& address) {
  std::string text;
  if (!object.read(key, text)) return;
  if (is_ipv4(text))
    address = text;
  else
    object.add_mistake(key, in_quotes(text), "an IPv4 address such as 192.168.10.11");
}

CameraOptions read_camera_options(JsonObject& object) {
  CameraOptions camera;
  std::size_t driver = 0;
  object.read("name", camera.name);
  const bool known = object.read_word("driver", driver_names, driver);
  camera.driver = static_cast<CameraDriver>(driver);
  object.read("width_px", camera.width_px, 1, 65535);
  object.read("height_px", camera.height_px, 1, 65535);
  object.read_optional("x_px", camera.x_px, 0, 65535);
  object.read_optional("y_px", camera.y_px, 0, 65535);
  read_choice(object, "pixel_format", format_names, camera.format);
  read_choice(object, "trigger", trigger_names, camera.trigger);
  read_number(object, "frame_rate_hz", NumberRange{0, 10000, true}, camera.frame_rate_hz);
  read_number(object, "exposure_us", NumberRange{0, 1e7, true}, camera.exposure_us);
  read_number(object, "gain", NumberRange{0, 1000}, camera.gain);
  read_number(object, "black_level", NumberRange{0, 65535}, camera.black_level);
  read_number(object, "gamma", NumberRange{0, 10, true}, camera.gamma);
  read_gige(object, camera.gige);
  read_v4l2(object, camera.v4l2);
  read_folder(object, camera.folder);
  if (known) check_keys(object, camera);
  return camera;
}

}  // namespace zeropose
