// Frames in: the one interface behind which GigE Vision, V4L2 and image folders stand.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/camera_options.h"

namespace zeropose {

using TimePoint = std::chrono::steady_clock::time_point;

// A frame with its identity and times. Copies share the pixels: nobody may change them.
struct Frame {
  std::string camera;
  std::uint64_t sequence = 0;        // counted by the driver from 1 for each opening of the device
  std::uint64_t device_time_ns = 0;  // the camera's clock; for logs and spread only
  bool network_time = false;         // that clock follows the network's (PTP), as those of others may
  TimePoint triggered;               // host, monotonic: when the trigger was sent
  TimePoint received;                // host, monotonic: when the last byte was there
  int width_px = 0, height_px = 0;
  int white = 255;  // the highest grey value; above 255 each pixel has two bytes in the host's order
  std::ptrdiff_t stride_bytes = 0;             // from one row to the next
  std::shared_ptr<const std::uint8_t> pixels;  // the first one; whoever lets go last gives the memory back

  std::size_t row_bytes() const { return static_cast<std::size_t>(width_px) * (white > 255 ? 2 : 1); }
  std::span<const std::uint8_t> row(int v) const { return {pixels.get() + v * stride_bytes, row_bytes()}; }
};

// Pixels that belong to nobody else, for Frame::pixels.
std::shared_ptr<const std::uint8_t> own_pixels(std::vector<std::uint8_t> pixels);

// What a device did wrong. Missing: it cannot be reached, or no longer; open it anew. In use: by another
// program, or by one that died less than a heartbeat (3 s) ago. After the others it goes on, the frame is
// lost.
enum class DeviceFault { missing, in_use, damaged_frame, wrong_size };

// A device that failed: which, what happened, what to do.
class DeviceError : public std::runtime_error {
 public:
  explicit DeviceError(const std::string& what, DeviceFault fault = DeviceFault::missing)
      : std::runtime_error(what), fault_(fault) {}
  DeviceFault fault() const { return fault_; }

 private:
  DeviceFault fault_;
};

// Counted since the device was opened. Every frame that is not handed out is counted somewhere.
struct CameraStatistics {
  std::uint64_t frames = 0;      // handed out
  std::uint64_t timeouts = 0;    // deadlines without a frame
  std::uint64_t damaged = 0;     // frames that came incomplete or out of sequence
  std::uint64_t wrong_size = 0;  // frames of another size or pixel format
  std::uint64_t stale = 0;       // frames that answered no trigger, or one too old
  std::uint64_t skipped = 0;     // of a camera that is not triggered by us: perhaps begun before the request
  std::uint64_t renewals = 0;    // streams thrown away because a frame could have been stale
  std::uint64_t failures = 0;    // by the library: frames not completed
  std::uint64_t underruns = 0;   // by the library: no buffer was free
  std::uint64_t resent_packets = 0;          // by the library
  std::uint64_t missing_packets = 0;         // by the library
  std::optional<double> temperature_c = {};  // of the camera, where it says it
  std::string ptp_state = {};                // "Slave", "Master", ...; empty: no such clock, or not asked for
};
// The sum; of what is no count, the newer one, b's.
CameraStatistics operator+(const CameraStatistics& a, const CameraStatistics& b);

// One thread per camera: no call may be made from two threads, and each may block while a device is being
// lost.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual void start() = 0;  // throws DeviceError
  // Software trigger. Frames that were under way before are never handed out by the next grab(). Throws
  // DeviceError.
  virtual void trigger() = 0;
  // The first whole frame exposed after the last trigger; nullopt at the deadline. Throws DeviceError when
  // the frame came damaged or the device is lost.
  virtual std::optional<Frame> grab(TimePoint deadline) = 0;
  virtual void stop() noexcept = 0;
  // A sign of life, for the time between requests; also puts right what a failed grab left behind. Throws
  // DeviceError when the device is gone.
  virtual void check() {}
  virtual CameraStatistics statistics() const { return {}; }
};

std::unique_ptr<Camera> open_camera(
    const CameraOptions& options);  // drivers/open_camera.cpp; throws DeviceError

}  // namespace zeropose
