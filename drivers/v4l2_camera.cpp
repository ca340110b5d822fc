#include "drivers/v4l2_camera.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "drivers/v4l2_pixels.h"

namespace zeropose {
namespace {

using std::chrono::steady_clock;

}  // namespace

V4l2Camera::V4l2Camera(CameraOptions options) : options_(std::move(options)), device_(options_) {
  if (options_.trigger == TriggerSource::line)
    device_.fail(
        "V4L2 has no trigger line; set trigger to software or free_run. A device with a line of its "
        "own may have a control for it: choose that under controls, with free_run");
}

void V4l2Camera::start() {
  if (device_.has_buffers()) return;
  device_.open_buffers();
  if (!free_run()) return;
  if (!device_.buffers().monotonic())
    device_.fail(
        "its times are of another clock than this computer's, so an old frame could pass as new; set "
        "trigger to software");
  device_.buffers().start();
  first_ = true;
}

void V4l2Camera::stop() noexcept {
  device_.close_buffers();
  outstanding_ = false;
}

void V4l2Camera::drop_filled() {
  while (const auto old = device_.buffers().take()) {
    ++statistics_.stale;
    device_.buffers().give_back(*old);
    first_ = false;
  }
}

void V4l2Camera::trigger() {
  if (!device_.has_buffers()) throw std::logic_error("trigger() before start()");
  triggered_ = steady_clock::now();
  if (free_run()) {
    drop_filled();
  } else {
    device_.buffers().stop();
    device_.buffers().start();
    first_ = true;
  }
  last_number_.reset();
  outstanding_ = true;
}

// Whether the exposure began after the trigger.
bool V4l2Camera::answers(const FilledBuffer& buffer) {
  const bool first = std::exchange(first_, false);
  if (!buffer.monotonic) return !first;
  std::chrono::nanoseconds back{0};
  if (!buffer.exposure_start) {
    const std::chrono::nanoseconds period = device_.layout().period;
    back = period + (options_.exposure_us
                         ? std::chrono::nanoseconds(static_cast<std::int64_t>(*options_.exposure_us * 1000))
                         : period);
  }
  return buffer.time - back > triggered_.time_since_epoch();
}

// Only while frames are waited for: a stream that nobody asks fills its buffers and then loses frames.
void V4l2Camera::count_gap(const FilledBuffer& buffer) {
  const auto last = std::exchange(last_number_, buffer.sequence);
  if (last && buffer.sequence > *last + 1) statistics_.underruns += buffer.sequence - *last - 1;
}

std::optional<FilledBuffer> V4l2Camera::next_answer(TimePoint deadline) {
  while (auto buffer = device_.next(deadline)) {
    const V4l2Field wanted = device_.layout().field;
    const bool other_field = wanted != V4l2Field::whole && buffer->field != wanted;
    if (!other_field) count_gap(*buffer);
    if (answers(*buffer) && !other_field) return buffer;
    if (!other_field) ++statistics_.stale;
    device_.buffers().give_back(*buffer);
  }
  return std::nullopt;
}

std::optional<Frame> V4l2Camera::grab(TimePoint deadline) {
  if (!outstanding_ && !free_run()) throw std::logic_error("grab() without trigger()");
  const std::optional<FilledBuffer> buffer = next_answer(deadline);
  if (!buffer) {
    device_.require_alive();
    ++statistics_.timeouts;
    return std::nullopt;
  }
  outstanding_ = false;
  device_.require_alive();  // without a signal grabbers go on with pictures of their own
  require_whole(*buffer);
  Frame frame = frame_of(*buffer);
  fill_pixels(*buffer, frame);
  ++statistics_.frames;
  return frame;
}

void V4l2Camera::fail_damaged(const std::string& problem) {
  ++statistics_.damaged;
  device_.fail("a frame came damaged: " + problem + "; check cable and USB port", DeviceFault::damaged_frame);
}

void V4l2Camera::require_whole(const FilledBuffer& buffer) {
  const bool too_short = buffer.bytes.size() < device_.layout().least_bytes;
  if (!buffer.damaged && !too_short) return;
  const std::size_t bytes = buffer.bytes.size();
  device_.buffers().give_back(buffer);
  fail_damaged(too_short && bytes > 0 ? "only " + std::to_string(bytes) + " of " +
                                            std::to_string(device_.layout().least_bytes) + " bytes came"
                                      : "the driver marks it as faulty");
}

Frame V4l2Camera::frame_of(const FilledBuffer& buffer) {
  Frame frame;
  frame.camera = options_.name;
  frame.sequence = ++sequence_;
  frame.device_time_ns = static_cast<std::uint64_t>(buffer.time.count());
  frame.triggered = triggered_;
  frame.received = steady_clock::now();
  frame.width_px = options_.width_px;
  frame.height_px = options_.height_px;
  frame.white = white_of(options_.format);
  return frame;
}

void V4l2Camera::fill_pixels(const FilledBuffer& buffer, Frame& frame) {
  const V4l2Layout& layout = device_.layout();
  switch (options_.format) {
    case PixelFormat::mjpeg:
      decode(buffer, frame);
      break;
    case PixelFormat::yuyv:
      frame.stride_bytes = frame.width_px;
      frame.pixels = own_pixels(
          brightness_of_yuyv(buffer.bytes.subspan(static_cast<std::size_t>(layout.offset_bytes)),
                             frame.width_px, frame.height_px, static_cast<std::size_t>(layout.stride_bytes)));
      device_.buffers().give_back(buffer);
      break;
    default:
      lend_or_copy(buffer, frame);
  }
}

void V4l2Camera::lend_or_copy(const FilledBuffer& buffer, Frame& frame) {
  const V4l2Layout& layout = device_.layout();
  frame.stride_bytes = layout.stride_bytes;
  frame.pixels = device_.buffers().lend(buffer, layout.offset_bytes);
  if (frame.pixels) return;
  const std::size_t row_bytes = frame.row_bytes();
  std::vector<std::uint8_t> copy(row_bytes * static_cast<std::size_t>(frame.height_px));
  for (int v = 0; v < frame.height_px; ++v)
    std::copy_n(buffer.bytes.data() + layout.offset_bytes + v * layout.stride_bytes, row_bytes,
                copy.data() + static_cast<std::size_t>(v) * row_bytes);
  frame.stride_bytes = static_cast<std::ptrdiff_t>(row_bytes);
  frame.pixels = own_pixels(std::move(copy));
  device_.buffers().give_back(buffer);
}

void V4l2Camera::decode(const FilledBuffer& buffer, Frame& frame) {
  std::optional<DecodedJpeg> picture = decode_jpeg(buffer.bytes);
  device_.buffers().give_back(buffer);
  if (!picture) fail_damaged("it is no whole JPEG picture");
  if (picture->width_px != frame.width_px || picture->height_px != frame.height_px) {
    ++statistics_.wrong_size;
    device_.fail("a picture of " + std::to_string(picture->width_px) + "x" +
                     std::to_string(picture->height_px) + " came, expected " +
                     std::to_string(frame.width_px) + "x" + std::to_string(frame.height_px),
                 DeviceFault::wrong_size);
  }
  frame.stride_bytes = frame.width_px;
  frame.pixels = own_pixels(std::move(picture->pixels));
}

void V4l2Camera::check() { device_.require_alive(); }

}  // namespace zeropose
