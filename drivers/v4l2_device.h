// One opened V4L2 device, set up and ready to stream: the calls into the kernel's driver.
#pragma once

#include "drivers/v4l2_buffers.h"
#include "drivers/v4l2_format.h"

namespace zeropose {

// All calls throw DeviceError unless they say otherwise. None waits longer than its deadline, as far as the
// kernel's driver keeps to it.
class V4l2Device {
 public:
  // Opens it, proves that nobody else uses it, applies the options and reads them back.
  explicit V4l2Device(const CameraOptions& options);
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  void open_buffers();
  void close_buffers() noexcept { buffers_.reset(); }
  bool has_buffers() const { return buffers_ != nullptr; }
  V4l2Buffers& buffers() { return *buffers_; }
  const V4l2Layout& layout() const { return layout_; }

  // The next filled buffer, old or new; nullopt at the deadline.
  std::optional<FilledBuffer> next(TimePoint deadline);
  // The device is there, its input has a signal, and the signal is the one that was set up.
  void require_alive() const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault = DeviceFault::missing) const {
    handle_.fail(what, fault);
  }

 private:
  void subscribe() const;
  void read_events() const;

  V4l2Handle handle_;
  bool several_planes_ = false;
  V4l2Layout layout_;
  std::unique_ptr<V4l2Buffers> buffers_;
};

}  // namespace zeropose
