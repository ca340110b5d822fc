#include "sim/v4l2_output.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <stdexcept>

namespace zeropose {
namespace {

constexpr int patience_ms = 5000;

void require(int result, const std::string& device, const char* doing) {
  if (result < 0)
    throw std::runtime_error("output " + device + ": " + doing + " failed: " + std::strerror(errno));
}

// The smallest progressive one of those that the device lists.
v4l2_dv_timings smallest_timings(int fd, const ShownPicture& picture) {
  std::optional<v4l2_dv_timings> best;
  const auto area = [](const v4l2_dv_timings& timings) {
    return std::uint64_t{timings.bt.width} * timings.bt.height;
  };
  v4l2_enum_dv_timings listed{};
  for (; ::ioctl(fd, VIDIOC_ENUM_DV_TIMINGS, &listed) == 0; ++listed.index) {
    const auto& bt = listed.timings.bt;
    const bool holds = static_cast<int>(bt.width) >= picture.width_px &&
                       static_cast<int>(bt.height) >= picture.height_px && bt.interlaced == 0;
    if (holds && (!best || area(listed.timings) < area(*best))) best = listed.timings;
  }
  if (!best) throw std::runtime_error("output " + picture.output + ": no signal holds the picture");
  return *best;
}

void set_capture_timings(const std::string& device, v4l2_dv_timings timings) {
  const int fd = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  require(fd, device, "opening");
  const int result = ::ioctl(fd, VIDIOC_S_DV_TIMINGS, &timings);
  const int error = errno;
  ::close(fd);
  errno = error;
  require(result, device, "setting the timings");
}

v4l2_buffer output_buffer(std::size_t index) {
  v4l2_buffer buffer{};
  buffer.index = static_cast<std::uint32_t>(index);
  buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

struct Identity {
  std::string bus;
  bool output = false;
};

Identity identify(const std::string& device) {
  Identity identity;
  const int fd = ::open(device.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) return identity;
  v4l2_capability capability{};
  if (::ioctl(fd, VIDIOC_QUERYCAP, &capability) == 0) {
    const auto* bus = &capability.bus_info[0];
    identity.bus.assign(bus, std::find(bus, bus + sizeof capability.bus_info, 0));
    identity.output = (capability.device_caps & V4L2_CAP_VIDEO_OUTPUT) != 0;
  }
  ::close(fd);
  return identity;
}

}  // namespace

std::string output_beside(const std::string& capture) {
  const std::string bus = identify(capture).bus;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (bus.empty() || !entry.path().filename().string().starts_with("video")) continue;
    const Identity other = identify(entry.path().string());
    if (other.output && other.bus == bus) return entry.path().string();
  }
  throw std::runtime_error("camera " + capture +
                           " has no output device beside it; load the kernel's module "
                           "vivid with an output for each capture device");
}

V4l2Output::V4l2Output(const ShownPicture& picture) : device_(picture.output) {
  fd_ = ::open(device_.c_str(), O_RDWR | O_CLOEXEC);
  require(fd_, device_, "opening");
  try {
    set_format(picture);
    map_buffers();
    queue(active_);
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    require(::ioctl(fd_, VIDIOC_STREAMON, &type), device_, "starting the stream");
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

V4l2Output::~V4l2Output() {
  for (const auto& buffer : buffers_) ::munmap(buffer.data(), buffer.size());
  ::close(fd_);
}

void V4l2Output::set_format(const ShownPicture& picture) {
  v4l2_dv_timings timings = smallest_timings(fd_, picture);
  require(::ioctl(fd_, VIDIOC_S_DV_TIMINGS, &timings), device_, "setting the timings");
  set_capture_timings(picture.capture, timings);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<std::uint32_t>(picture.width_px);
  format.fmt.pix.height = static_cast<std::uint32_t>(picture.height_px);
  std::memcpy(&format.fmt.pix.pixelformat, picture.pixels.data(), sizeof format.fmt.pix.pixelformat);
  const std::uint32_t code = format.fmt.pix.pixelformat;
  require(::ioctl(fd_, VIDIOC_S_FMT, &format), device_, "setting the format");
  bytes_ = static_cast<std::size_t>(picture.width_px * picture.pixel_bytes) *
           static_cast<std::size_t>(picture.height_px);
  if (format.fmt.pix.pixelformat != code || format.fmt.pix.sizeimage != bytes_)
    throw std::runtime_error("output " + device_ + ": does not take the picture's format");
  v4l2_selection place{};  // in the signal's corner, not spread over it
  place.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  place.target = V4L2_SEL_TGT_COMPOSE;
  place.r = {0, 0, format.fmt.pix.width, format.fmt.pix.height};
  require(::ioctl(fd_, VIDIOC_S_SELECTION, &place), device_, "placing the picture");
}

void V4l2Output::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = 2;
  request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  request.memory = V4L2_MEMORY_MMAP;
  require(::ioctl(fd_, VIDIOC_REQBUFS, &request), device_, "asking for buffers");
  for (std::size_t i = 0; i < 2; ++i) {
    v4l2_buffer buffer = output_buffer(i);
    require(::ioctl(fd_, VIDIOC_QUERYBUF, &buffer), device_, "asking for a buffer");
    void* data = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, buffer.m.offset);
    if (data == MAP_FAILED) require(-1, device_, "mapping a buffer");
    buffers_.emplace_back(static_cast<std::uint8_t*>(data), bytes_);
    std::ranges::fill(buffers_.back(), std::uint8_t{0});
  }
}

void V4l2Output::queue(std::size_t index) {
  v4l2_buffer buffer = output_buffer(index);
  buffer.bytesused = static_cast<std::uint32_t>(bytes_);
  buffer.field = V4L2_FIELD_NONE;
  require(::ioctl(fd_, VIDIOC_QBUF, &buffer), device_, "queueing a picture");
}

// The device lets go of a picture when it has begun to show the next.
void V4l2Output::take_back() {
  pollfd watched{fd_, POLLOUT, 0};
  if (::poll(&watched, 1, patience_ms) <= 0)
    throw std::runtime_error("output " + device_ + ": does not show its picture");
  v4l2_buffer buffer = output_buffer(0);
  require(::ioctl(fd_, VIDIOC_DQBUF, &buffer), device_, "taking a picture back");
}

void V4l2Output::show(std::span<const std::uint8_t> pixels) {
  const std::size_t next = 1 - active_;
  std::ranges::copy(pixels.first(bytes_), buffers_[next].begin());
  queue(next);
  active_ = next;
  take_back();
}

}  // namespace zeropose
