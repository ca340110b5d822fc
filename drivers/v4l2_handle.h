// An opened V4L2 device file: the owner of its descriptor and of the calls into the driver.
#pragma once

#include <string>
#include <utility>

#include "drivers/camera.h"

namespace zeropose {

// Move-only. Closed when it goes. Calls of the driver block only where the driver itself does; waiting for
// frames is done by wait().
class V4l2Handle {
 public:
  V4l2Handle() = default;
  // Opens it for reading and writing, without blocking calls; not is_open() on failure, errno says why.
  // `where` is how messages begin.
  explicit V4l2Handle(const std::string& path, std::string where = {});
  ~V4l2Handle() { close(); }
  V4l2Handle(V4l2Handle&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), where_(std::move(other.where_)) {}
  V4l2Handle& operator=(V4l2Handle&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(where_, other.where_);
    return *this;
  }

  bool is_open() const { return fd_ >= 0; }
  int fd() const { return fd_; }
  // 0, or the error number. Repeats a call that a signal broke off.
  int call(unsigned long request, void* argument) const;

  enum class Ready { frame, event, error, deadline };
  // Until a buffer is filled, an event has come or the device reports an error; an event comes first.
  Ready wait(TimePoint deadline) const;

  [[noreturn]] void fail(const std::string& what, DeviceFault fault = DeviceFault::missing) const;
  // Throws DeviceError for an error number: another program has it, it is gone, or what the system says.
  void require(int error, const std::string& doing) const;

 private:
  void close() noexcept;
  int fd_ = -1;
  std::string where_;
};

}  // namespace zeropose
