#include "drivers/v4l2_handle.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

namespace zeropose {

V4l2Handle::V4l2Handle(const char* path) : fd_(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC)) {}

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

}  // namespace zeropose
