// The memory-mapped buffers of a V4L2 stream, and who has each of them.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "drivers/v4l2_handle.h"

namespace zeropose {

enum class V4l2Field { whole, top, bottom };

// A buffer that the driver has filled.
struct FilledBuffer {
  std::uint32_t index = 0;
  std::uint64_t sequence = 0;  // the driver's
  std::chrono::nanoseconds time{};
  bool monotonic = false;       // `time` is of the clock of TimePoint
  bool exposure_start = false;  // `time` is when the exposure began; else when the last byte was there
  bool damaged = false;
  V4l2Field field = V4l2Field::whole;
  std::span<const std::uint8_t> bytes;
};

// All calls but those of lent pixels from one thread.
class V4l2Buffers {
 public:
  // Takes the device for itself and maps the buffers. `handle` must outlive it. Throws DeviceError.
  V4l2Buffers(const V4l2Handle& handle, bool several_planes);
  ~V4l2Buffers();  // ends the stream; lent pixels stay readable
  V4l2Buffers(const V4l2Buffers&) = delete;
  V4l2Buffers& operator=(const V4l2Buffers&) = delete;

  void start();          // queues every buffer that is not lent, then streams; throws DeviceError
  void stop() noexcept;  // frames that were not taken are thrown away
  bool streaming() const;
  bool monotonic() const;                      // as FilledBuffer::monotonic, of all
  std::optional<FilledBuffer> take();          // nullopt: none is filled; throws DeviceError
  void give_back(const FilledBuffer& buffer);  // to the driver, to be filled again; throws DeviceError
  // The bytes from `offset`, without a copy: the buffer goes back to the driver when the last owner lets go,
  // at any time and in any thread. Null, and nothing was done, when too few buffers would stay with the
  // driver.
  std::shared_ptr<const std::uint8_t> lend(const FilledBuffer& buffer, std::ptrdiff_t offset);

 private:
  class Mapping;
  struct Pool;

  const V4l2Handle& handle_;
  bool monotonic_ = false;
  bool may_outlive_ = false;  // the kernel lets buffers be mapped longer than they belong to the stream
  std::shared_ptr<Pool> pool_;
};

}  // namespace zeropose
