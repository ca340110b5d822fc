// An opened V4L2 device file: the owner of its descriptor and of the calls into the driver.
#pragma once

#include <cerrno>
#include <utility>

#include "drivers/camera.h"

namespace zeropose {

// Move-only. Closed when it goes. Calls of the driver block only where the driver itself does; waiting for
// frames is done by wait().
class V4l2Handle {
 public:
  V4l2Handle() = default;
  // Opens it for reading and writing, without blocking calls; not open() afterwards on failure, see errno.
  explicit V4l2Handle(const char* path);
  ~V4l2Handle() { close(); }
  V4l2Handle(V4l2Handle&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  V4l2Handle& operator=(V4l2Handle&& other) noexcept {
    if (this != &other) {
      close();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }

  bool is_open() const { return fd_ >= 0; }
  int fd() const { return fd_; }
  // 0, or the error number. Repeats a call that a signal broke off.
  int call(unsigned long request, void* argument) const;

  enum class Ready { frame, event, error, deadline };
  // Until a buffer is filled, an event has come or the device reports an error; an event comes first.
  Ready wait(TimePoint deadline) const;

 private:
  void close() noexcept;
  int fd_ = -1;
};

}  // namespace zeropose
