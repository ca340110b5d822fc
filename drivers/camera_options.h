// What an engineer decides about one camera.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace zeropose {

enum class CameraDriver { gige, v4l2, folder };

// As the camera sends them. The packed ones hold two pixels in three bytes (GigE Vision 2.0) and are
// unpacked; of yuyv only the brightness is used.
enum class PixelFormat { mono8, mono10, mono12, mono16, mono10_packed, mono12_packed, yuyv, mjpeg };

enum class TriggerSource {
  software,  // every request exposes one frame
  line,      // an electric signal does; the request only waits for it
  free_run,  // the camera exposes by itself
};

enum class PacketSocket { automatic, never, always };

struct GigeOptions {
  std::string address = {};    // IPv4; or empty, then one of the others finds it
  std::string serial = {};     // as the camera says it; beside an address it must be that camera's
  std::string user_name = {};  // DeviceUserID; likewise
  std::string interface = {};  // the network interface to use; empty: the one that leads there
  int packet_bytes = 0;        // of the stream, IP header included; 0: as large as the interface takes
  PacketSocket packet_socket = PacketSocket::automatic;  // a plain UDP socket where its buffer may be large
  bool resend = true;                                    // missing packets are asked for again
  bool ptp = false;                                      // the camera's clock follows the network's
  std::string trigger_line = "Line1";                    // of TriggerSource::line
};

// Which lines of an interlaced picture are used: one field has half the height and no comb on moving edges.
enum class Fields { both, top, bottom };

struct V4l2Control {
  std::string name;  // as the driver names it, which v4l2-ctl --list-ctrls shows in lower case
  int value = 0;
};

struct V4l2Options {
  std::string device;  // /dev/v4l/by-path/..., /dev/v4l/by-id/... or /dev/videoN
  int input = -1;      // of a frame grabber; below 0: as it is
  Fields fields = Fields::both;
  std::vector<V4l2Control> controls;  // set in this order and read back
};

struct FolderOptions {
  std::filesystem::path path;  // pictures (png, tiff, bmp, pgm) in the order of their names
  bool loop = true;            // from the start again after the last
};

struct CameraOptions {
  std::string name;  // as in the cell
  CameraDriver driver = CameraDriver::gige;
  int width_px = 0, height_px = 0;  // of the frame that is handed out
  int x_px = 0, y_px = 0;           // where it begins on the sensor
  PixelFormat format = PixelFormat::mono8;
  TriggerSource trigger = TriggerSource::software;
  std::optional<double> frame_rate_hz = {};  // of a camera that runs freely
  std::optional<double> exposure_us = {}, gain = {}, black_level = {}, gamma = {};
  GigeOptions gige = {};
  V4l2Options v4l2 = {};
  FolderOptions folder = {};
};

// Where it is, for messages: its address, serial number, device file or folder.
std::string place_of(const CameraOptions& camera);
// "camera NAME (PLACE)": how every message about it begins.
std::string title_of(const CameraOptions& camera);

}  // namespace zeropose
