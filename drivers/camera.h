// Frames in: the one interface behind which GigE Vision, V4L2 and image folders stand.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace zeropose {

using TimePoint = std::chrono::steady_clock::time_point;

// A frame with its identity and times. Owns its pixels: 8-bit grey, row by row, without padding.
struct Frame {
  std::string camera;
  std::uint64_t sequence = 0;        // counted by the driver from 1 for each opening of the device
  std::uint64_t device_time_ns = 0;  // the camera's clock; for logs and spread only
  TimePoint triggered;               // host, monotonic: when the trigger was sent
  TimePoint received;                // host, monotonic: when the last byte was there
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> pixels;
};

struct CameraOptions {
  std::string name;     // as in the cell
  std::string address;  // IPv4 address of a GigE Vision camera
  int width_px = 0, height_px = 0;
  std::optional<double> exposure_us, gain;
};

// A device that failed: which, what happened, what to do.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

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
};

std::unique_ptr<Camera> open_camera(
    const CameraOptions& options);  // drivers/open_camera.cpp; throws DeviceError

}  // namespace zeropose
