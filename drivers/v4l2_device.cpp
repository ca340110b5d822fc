#include "drivers/v4l2_device.h"

#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>

#include "drivers/v4l2_controls.h"

namespace zeropose {
namespace {

V4l2Handle open_device(const CameraOptions& options) {
  V4l2Handle handle(options.v4l2.device, title_of(options));
  const int error = errno;
  if (handle.is_open()) return handle;
  if (error == EBUSY) handle.require(error, "opening");
  if (error == EACCES || error == EPERM) handle.fail("may not be opened; give this user the group 'video'");
  if (error == ENOENT || error == ENODEV || error == ENXIO)
    handle.fail("is not there; check its power and cable. It is used as soon as it is there");
  handle.fail(std::string("opening failed: ") + std::strerror(error) + "; check device in the cell file");
}

// Whether the device is of the kind that describes its pixels by planes.
bool has_several_planes(const V4l2Handle& handle) {
  const std::string advice = "; zeropose cameras list shows the devices of this computer";
  v4l2_capability capability{};
  const int error = handle.call(VIDIOC_QUERYCAP, &capability);
  if (error == ENOTTY || error == EINVAL) handle.fail("is no V4L2 device" + advice);
  handle.require(error, "asking what it can");
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t can = own ? capability.device_caps : capability.capabilities;
  const bool several = (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
  if (!several && (can & V4L2_CAP_VIDEO_CAPTURE) == 0) handle.fail("is no capture device" + advice);
  if ((can & V4L2_CAP_STREAMING) == 0) handle.fail("cannot stream into memory; choose another device");
  return several;
}

// Asks for no buffers: changes nothing, but is refused while another program has some.
void require_unused(const V4l2Handle& handle, bool several_planes) {
  v4l2_requestbuffers none{};
  none.memory = V4L2_MEMORY_MMAP;
  none.type = several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  handle.require(handle.call(VIDIOC_REQBUFS, &none), "taking the device");
}

}  // namespace

V4l2Device::V4l2Device(const CameraOptions& options)
    : handle_(open_device(options)), several_planes_(has_several_planes(handle_)) {
  require_unused(handle_, several_planes_);
  layout_ = configure_v4l2(handle_, options, several_planes_);
  set_v4l2_controls(handle_, options);
  subscribe();
  require_v4l2_signal(handle_, layout_.input);
}

// Devices without these events refuse them, and never change by themselves.
void V4l2Device::subscribe() const {
  v4l2_event_subscription change{};
  change.type = V4L2_EVENT_SOURCE_CHANGE;
  change.id = layout_.input;
  (void)handle_.call(VIDIOC_SUBSCRIBE_EVENT, &change);
  v4l2_event_subscription end{};
  end.type = V4L2_EVENT_EOS;
  (void)handle_.call(VIDIOC_SUBSCRIBE_EVENT, &end);
}

void V4l2Device::open_buffers() { buffers_ = std::make_unique<V4l2Buffers>(handle_, several_planes_); }

void V4l2Device::read_events() const {
  v4l2_event event{};
  while (true) {
    const int error = handle_.call(VIDIOC_DQEVENT, &event);
    if (error == ENOENT || error == EAGAIN || error == ENOTTY) return;
    handle_.require(error, "reading its events");
    if (event.type == V4L2_EVENT_SOURCE_CHANGE)
      handle_.fail("the signal at its input changed; it is set up anew");
    if (event.type == V4L2_EVENT_EOS) handle_.fail("its stream has ended; it is opened again");
  }
}

std::optional<FilledBuffer> V4l2Device::next(TimePoint deadline) {
  while (true) {
    switch (handle_.wait(deadline)) {
      case V4l2Handle::Ready::deadline:
        return std::nullopt;
      case V4l2Handle::Ready::event:
        read_events();
        break;
      case V4l2Handle::Ready::error:
        require_alive();
        handle_.fail("its stream broke off; it is opened again");
      case V4l2Handle::Ready::frame:
        if (auto filled = buffers_->take()) return filled;
    }
  }
}

void V4l2Device::require_alive() const {
  v4l2_capability capability{};
  handle_.require(handle_.call(VIDIOC_QUERYCAP, &capability), "a sign of life");
  read_events();
  require_v4l2_signal(handle_, layout_.input);
}

}  // namespace zeropose
