// Input, signal, size, pixel format, fields, position and rate of a V4L2 device.
#pragma once

#include "drivers/v4l2_buffers.h"

namespace zeropose {

// Where the picture that is handed out lies in a buffer.
struct V4l2Layout {
  std::ptrdiff_t offset_bytes = 0;     // of its first pixel
  std::ptrdiff_t stride_bytes = 0;     // from one of its rows to the next
  std::size_t least_bytes = 0;         // that a whole buffer holds
  V4l2Field field = V4l2Field::whole;  // the only one to use, where every field has its own buffer
  std::chrono::nanoseconds period{};   // from frame to frame
  std::uint32_t input = 0;
};

// Sets what the options want and reads it back. Throws DeviceError: wrong_size with both sizes, in_use, or
// what to change in the cell file.
V4l2Layout configure_v4l2(const V4l2Handle& handle, const CameraOptions& options, bool several_planes);

// Throws DeviceError where the input says that it has no power, signal or synchronisation.
void require_v4l2_signal(const V4l2Handle& handle, std::uint32_t input);

// The highest grey value of pixels as they are handed out.
int white_of(PixelFormat format);

}  // namespace zeropose
