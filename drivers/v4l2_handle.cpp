#include "drivers/v4l2_handle.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

namespace zeropose {

V4l2Handle::V4l2Handle(const std::string& path, std::string where)
    : fd_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)), where_(std::move(where)) {}

void V4l2Handle::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

int V4l2Handle::call(unsigned long request, void* argument) const {
  int result = 0;
  do result = ::ioctl(fd_, request, argument);
  while (result < 0 && errno == EINTR);
  return result < 0 ? errno : 0;
}

V4l2Handle::Ready V4l2Handle::wait(TimePoint deadline) const {
  while (true) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd watched{fd_, POLLIN | POLLPRI, 0};
    const int ready = ::poll(&watched, 1, static_cast<int>(std::clamp<long>(left.count(), 0, 60'000)));
    if (ready < 0 && errno != EINTR) return Ready::error;
    if (ready > 0 && (watched.revents & POLLPRI) != 0) return Ready::event;
    if (ready > 0 && (watched.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return Ready::error;
    if (ready > 0) return Ready::frame;
    if (std::chrono::steady_clock::now() >= deadline) return Ready::deadline;
  }
}

void V4l2Handle::fail(const std::string& what, DeviceFault fault) const {
  throw DeviceError(where_ + ": " + what, fault);
}

void V4l2Handle::require(int error, const std::string& doing) const {
  if (error == 0) return;
  if (error == EBUSY)
    fail(doing + " failed: another program uses the device; stop that program", DeviceFault::in_use);
  if (error == ENODEV || error == ENXIO)
    fail("is gone; check its power and cable. It is used again as soon as it is back");
  fail(doing + " failed: " + std::strerror(error) + "; check the device with v4l2-ctl --all");
}

}  // namespace zeropose
