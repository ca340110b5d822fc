#include "drivers/v4l2_format.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

namespace zeropose {
namespace {

constexpr std::chrono::milliseconds slowest_television{40};

std::string size_text(std::uint64_t width_px, std::uint64_t height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

std::uint32_t code_of(const V4l2Handle& handle, PixelFormat format) {
  switch (format) {
    case PixelFormat::mono8:
      return V4L2_PIX_FMT_GREY;
    case PixelFormat::mono10:
      return V4L2_PIX_FMT_Y10;
    case PixelFormat::mono12:
      return V4L2_PIX_FMT_Y12;
    case PixelFormat::mono16:
      return V4L2_PIX_FMT_Y16;
    case PixelFormat::yuyv:
      return V4L2_PIX_FMT_YUYV;
    case PixelFormat::mjpeg:
      return V4L2_PIX_FMT_MJPEG;
    case PixelFormat::mono10_packed:
    case PixelFormat::mono12_packed:
      break;
  }
  handle.fail(
      "packed pixel formats are those of GigE Vision; with driver v4l2 pixel_format is one of mono8, "
      "mono10, mono12, mono16, yuyv and mjpeg");
}

std::string code_text(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>(code >> shift & 0x7f);
  return text;
}

// The part of v4l2_format that single- and multi-planar devices have in common.
struct PixelLayout {
  std::uint32_t width = 0, height = 0, code = 0, field = 0, stride = 0;
};

class FormatCalls {
 public:
  FormatCalls(const V4l2Handle& handle, bool several_planes) : handle_(handle), several_(several_planes) {}

  PixelLayout get() const {
    v4l2_format format = empty();
    handle_.require(handle_.call(VIDIOC_G_FMT, &format), "reading the picture format");
    return read(format);
  }
  PixelLayout set(const PixelLayout& wanted) const {
    v4l2_format format = empty();
    if (several_) {
      format.fmt.pix_mp.width = wanted.width;
      format.fmt.pix_mp.height = wanted.height;
      format.fmt.pix_mp.pixelformat = wanted.code;
      format.fmt.pix_mp.field = wanted.field;
      format.fmt.pix_mp.num_planes = 1;
    } else {
      format.fmt.pix.width = wanted.width;
      format.fmt.pix.height = wanted.height;
      format.fmt.pix.pixelformat = wanted.code;
      format.fmt.pix.field = wanted.field;
    }
    handle_.require(handle_.call(VIDIOC_S_FMT, &format), "setting the picture format");
    return read(format);
  }

 private:
  v4l2_format empty() const {
    v4l2_format format{};
    format.type = several_ ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
    return format;
  }
  PixelLayout read(const v4l2_format& format) const {
    if (!several_) {
      const auto& pix = format.fmt.pix;
      return {pix.width, pix.height, pix.pixelformat, pix.field, pix.bytesperline};
    }
    const auto& pix = format.fmt.pix_mp;
    if (pix.num_planes != 1)
      handle_.fail("spreads its pixels over several planes; choose another pixel_format");
    return {pix.width, pix.height, pix.pixelformat, pix.field, pix.plane_fmt[0].bytesperline};
  }

  const V4l2Handle& handle_;
  bool several_;
};

std::uint32_t choose_input(const V4l2Handle& handle, int wanted) {
  int input = 0;
  if (wanted >= 0) {
    input = wanted;
    if (handle.call(VIDIOC_S_INPUT, &input) == EINVAL)
      handle.fail("has no input " + std::to_string(wanted) +
                  "; v4l2-ctl --list-inputs shows those that it has");
    input = wanted;
    handle.require(handle.call(VIDIOC_S_INPUT, &input), "choosing the input");
  }
  const int error = handle.call(VIDIOC_G_INPUT, &input);
  if (error != ENOTTY) handle.require(error, "asking for the input");
  return static_cast<std::uint32_t>(input);
}

// A digital input takes the timings of what it receives.
void adopt_timings(const V4l2Handle& handle) {
  v4l2_dv_timings received{}, current{};
  switch (const int error = handle.call(VIDIOC_QUERY_DV_TIMINGS, &received)) {
    case ENOLINK:
      handle.fail("no signal at its input; check the camera's power and cable");
    case ENOLCK:
      handle.fail("cannot lock to the signal at its input; check the cable");
    case ERANGE:
      handle.fail("the signal at its input is out of its range; choose a smaller picture or rate");
    case ENOTTY:
    case ENODATA:
      return;
    default:
      handle.require(error, "asking for the timings of the signal");
  }
  const bool known = handle.call(VIDIOC_G_DV_TIMINGS, &current) == 0;
  const bool same = received.bt.width == current.bt.width && received.bt.height == current.bt.height &&
                    received.bt.interlaced == current.bt.interlaced &&
                    received.bt.pixelclock == current.bt.pixelclock;
  if (known && same) return;  // setting them throws the picture format away
  handle.require(handle.call(VIDIOC_S_DV_TIMINGS, &received), "setting the timings of the signal");
}

std::uint32_t first_field_order(std::uint32_t current, Fields fields) {
  if (fields == Fields::both) return V4L2_FIELD_ANY;
  if (current == V4L2_FIELD_NONE || current == V4L2_FIELD_ANY) return V4L2_FIELD_INTERLACED;
  return current;
}

bool one_field_per_buffer(std::uint32_t order) {
  return order == V4L2_FIELD_ALTERNATE || order == V4L2_FIELD_TOP || order == V4L2_FIELD_BOTTOM;
}

// Which buffer rows are the picture's.
void place_fields(const V4l2Handle& handle, const PixelLayout& got, Fields fields, V4l2Layout& layout) {
  const auto stride = static_cast<std::ptrdiff_t>(got.stride);
  const bool bottom = fields == Fields::bottom;
  layout.stride_bytes = stride;
  switch (got.field) {
    case V4L2_FIELD_INTERLACED:
    case V4L2_FIELD_INTERLACED_TB:
    case V4L2_FIELD_INTERLACED_BT:
      if (fields == Fields::both) return;
      layout.offset_bytes = bottom ? stride : 0;
      layout.stride_bytes = 2 * stride;
      return;
    case V4L2_FIELD_SEQ_TB:
    case V4L2_FIELD_SEQ_BT:
      if (fields == Fields::both) break;
      if (bottom == (got.field == V4L2_FIELD_SEQ_TB)) layout.offset_bytes = stride * (got.height / 2);
      return;
    case V4L2_FIELD_ALTERNATE:
    case V4L2_FIELD_TOP:
    case V4L2_FIELD_BOTTOM:
      if (fields == Fields::both) break;
      layout.field = bottom ? V4l2Field::bottom : V4l2Field::top;
      if (got.field == V4L2_FIELD_ALTERNATE || (got.field == V4L2_FIELD_BOTTOM) == bottom) return;
      handle.fail("delivers the other field only; choose the other one of fields top and bottom");
    default:
      if (fields == Fields::both) return;
      handle.fail("its picture is not interlaced; remove fields from the cell file, or set it to both");
  }
  handle.fail("delivers one field after the other; choose fields top or bottom");
}

void set_format(const V4l2Handle& handle, const CameraOptions& options, bool several_planes,
                V4l2Layout& layout) {
  const FormatCalls calls(handle, several_planes);
  const Fields fields = options.v4l2.fields;
  const auto height = static_cast<std::uint32_t>(options.height_px);
  PixelLayout wanted;
  wanted.width = static_cast<std::uint32_t>(options.width_px);
  wanted.code = code_of(handle, options.format);
  wanted.field = first_field_order(calls.get().field, fields);
  const auto rows = [&](std::uint32_t order) {
    return fields == Fields::both || one_field_per_buffer(order) ? height : 2 * height;
  };
  wanted.height = rows(wanted.field);
  PixelLayout got = calls.set(wanted);
  if (rows(got.field) != wanted.height) {  // it chose another order of fields
    wanted.field = got.field;
    wanted.height = rows(got.field);
    got = calls.set(wanted);
  }
  if (got.code != wanted.code)
    handle.fail("does not deliver " + code_text(wanted.code) + " but " + code_text(got.code) +
                    "; choose a pixel_format that v4l2-ctl --list-formats shows",
                DeviceFault::wrong_size);
  place_fields(handle, got, fields, layout);
  if (got.width != wanted.width || got.height != wanted.height)
    handle.fail("set itself to " + size_text(got.width, got.height) + ", the cell file wants " +
                    size_text(wanted.width, wanted.height) +
                    (wanted.height == height ? "" : " for a field of half of it") +
                    "; correct width_px and height_px there, or the signal at its input",
                DeviceFault::wrong_size);
  if (options.format == PixelFormat::mjpeg) return;
  const std::size_t pixel_bytes =
      white_of(options.format) > 255 || options.format == PixelFormat::yuyv ? 2 : 1;
  layout.least_bytes = static_cast<std::size_t>(got.stride) * (got.height - 1) + got.width * pixel_bytes;
}

bool set_crop(const V4l2Handle& handle, v4l2_selection& crop) {
  const int error = handle.call(VIDIOC_S_SELECTION, &crop);
  if (error == EBUSY || error == ENODEV) handle.require(error, "setting where the picture begins");
  return error == 0;
}

// Where the picture begins on the sensor, one pixel of it for one that is handed out. Only where the picture
// is larger than the signal, and begins at 0, 0, the whole signal is scaled to it by the device.
void set_position(const V4l2Handle& handle, const CameraOptions& options) {
  const bool moved = options.x_px != 0 || options.y_px != 0;
  v4l2_selection crop{};
  crop.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  crop.target = V4L2_SEL_TGT_CROP_DEFAULT;
  if (handle.call(VIDIOC_G_SELECTION, &crop) != 0) {
    if (moved) handle.fail("cannot choose where its picture begins; remove x_px and y_px from the cell file");
    return;
  }
  const v4l2_rect whole = crop.r;
  const int lines = options.v4l2.fields == Fields::both ? 1 : 2;
  crop.target = V4L2_SEL_TGT_CROP;
  crop.r = {options.x_px, options.y_px, static_cast<std::uint32_t>(options.width_px),
            static_cast<std::uint32_t>(options.height_px * lines)};
  const v4l2_rect wanted = crop.r;
  const bool set = set_crop(handle, crop) && crop.r.left == wanted.left && crop.r.top == wanted.top &&
                   crop.r.width == wanted.width && crop.r.height == wanted.height;
  if (set) return;
  if (moved)
    handle.fail("cannot begin its picture at " + std::to_string(options.x_px) + "," +
                    std::to_string(options.y_px) + "; correct x_px and y_px in the cell file",
                DeviceFault::wrong_size);
  crop.r = whole;
  (void)set_crop(handle, crop);
}

// The picture fills the buffer, whatever part of it another program had chosen. Devices without a choice fill
// it.
void fill_buffer(const V4l2Handle& handle) {
  v4l2_selection part{};
  part.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  part.target = V4L2_SEL_TGT_COMPOSE_DEFAULT;
  if (handle.call(VIDIOC_G_SELECTION, &part) != 0) return;
  part.target = V4L2_SEL_TGT_COMPOSE;
  (void)handle.call(VIDIOC_S_SELECTION, &part);
}

std::chrono::nanoseconds set_rate(const V4l2Handle& handle, const CameraOptions& options,
                                  bool several_planes) {
  v4l2_streamparm parameters{};
  parameters.type = several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  auto& capture = parameters.parm.capture;
  const bool known = handle.call(VIDIOC_G_PARM, &parameters) == 0;
  const bool settable = known && (capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
  if (options.frame_rate_hz) {
    if (!settable) handle.fail("has no frame rate to set; remove frame_rate_hz from the cell file");
    capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000 * *options.frame_rate_hz))};
    handle.require(handle.call(VIDIOC_S_PARM, &parameters), "setting the frame rate");
  }
  const auto& period = capture.timeperframe;
  if (!known || period.numerator == 0 || period.denominator == 0) return slowest_television;
  const double got_hz = static_cast<double>(period.denominator) / period.numerator;
  if (options.frame_rate_hz && std::abs(got_hz / *options.frame_rate_hz - 1) > 0.02)
    handle.fail("frame_rate_hz " + std::to_string(*options.frame_rate_hz) + " was set, the device says " +
                std::to_string(got_hz) + "; choose one that v4l2-ctl --list-formats-ext shows");
  return std::chrono::nanoseconds(std::llround(1e9 / got_hz));
}

}  // namespace

int white_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono10:
      return 1023;
    case PixelFormat::mono12:
      return 4095;
    case PixelFormat::mono16:
      return 65535;
    default:
      return 255;
  }
}

void require_v4l2_signal(const V4l2Handle& handle, std::uint32_t input) {
  v4l2_input status{};
  status.index = input;
  const int error = handle.call(VIDIOC_ENUMINPUT, &status);
  if (error == ENODEV) handle.require(error, "");
  if (error != 0) return;  // a camera, not a frame grabber
  const auto has = [&](std::uint32_t flags) { return (status.status & flags) != 0; };
  if (has(V4L2_IN_ST_NO_POWER)) handle.fail("no power at its input; switch the camera on");
  if (has(V4L2_IN_ST_NO_SIGNAL)) handle.fail("no signal at its input; check the camera's power and cable");
  if (has(V4L2_IN_ST_NO_H_LOCK | V4L2_IN_ST_NO_V_LOCK | V4L2_IN_ST_NO_STD_LOCK | V4L2_IN_ST_NO_SYNC))
    handle.fail("no synchronisation with the signal at its input; check cable, standard and timings");
}

V4l2Layout configure_v4l2(const V4l2Handle& handle, const CameraOptions& options, bool several_planes) {
  V4l2Layout layout;
  layout.input = choose_input(handle, options.v4l2.input);
  require_v4l2_signal(handle, layout.input);
  adopt_timings(handle);
  set_format(handle, options, several_planes, layout);
  set_position(handle, options);
  fill_buffer(handle);
  set_format(handle, options, several_planes, layout);  // a new position may have changed it
  layout.period = set_rate(handle, options, several_planes);
  return layout;
}

}  // namespace zeropose
