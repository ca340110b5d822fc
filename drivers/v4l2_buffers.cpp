#include "drivers/v4l2_buffers.h"

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <mutex>
#include <vector>

namespace zeropose {
namespace {

constexpr std::uint32_t wanted_buffers = 6;
// With fewer a driver may stop or lose frames.
constexpr std::ptrdiff_t stay_queued = 2;

// A v4l2_buffer for one or several planes, of which we use the first.
struct BufferCall {
  BufferCall(std::uint32_t index, bool several_planes) {
    buffer.index = index;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.type = several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (several_planes) {
      buffer.m.planes = &plane;
      buffer.length = 1;
    }
  }
  BufferCall(const BufferCall&) = delete;
  BufferCall& operator=(const BufferCall&) = delete;

  bool several_planes() const { return buffer.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  std::size_t length() const { return several_planes() ? plane.length : buffer.length; }
  off_t offset() const { return several_planes() ? plane.m.mem_offset : buffer.m.offset; }
  std::size_t used() const { return several_planes() ? plane.bytesused : buffer.bytesused; }
  std::size_t begin() const { return several_planes() ? plane.data_offset : 0; }

  v4l2_buffer buffer{};
  v4l2_plane plane{};
};

V4l2Field field_of(std::uint32_t field) {
  if (field == V4L2_FIELD_TOP) return V4l2Field::top;
  return field == V4L2_FIELD_BOTTOM ? V4l2Field::bottom : V4l2Field::whole;
}

bool is_monotonic(std::uint32_t flags) {
  return (flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
}

}  // namespace

class V4l2Buffers::Mapping {
 public:
  Mapping(const V4l2Handle& handle, std::size_t length, off_t offset)
      : length_(length), data_(::mmap(nullptr, length, PROT_READ, MAP_SHARED, handle.fd(), offset)) {
    if (data_ == MAP_FAILED) handle.require(errno, "mapping a buffer");
  }
  ~Mapping() { ::munmap(data_, length_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  std::span<const std::uint8_t> bytes() const { return {static_cast<const std::uint8_t*>(data_), length_}; }

 private:
  std::size_t length_;
  void* data_;
};

// Shared with the lent pixels, which may live longer than the stream.
struct V4l2Buffers::Pool {
  enum class Place { ours, driver, lent };

  int queue(std::uint32_t index) {
    BufferCall call(index, several_planes);
    const int error = handle->call(VIDIOC_QBUF, &call.buffer);
    if (error == 0) places[index] = Place::driver;
    return error;
  }
  void return_lent(std::uint32_t index) noexcept {
    const std::lock_guard lock(mutex);
    if (handle == nullptr) return;
    places[index] = Place::ours;
    if (streaming) (void)queue(index);  // a lost device is noticed by who waits for it
  }

  std::mutex mutex;
  const V4l2Handle* handle = nullptr;  // null: the stream is gone
  bool several_planes = false;
  bool streaming = false;
  std::vector<Place> places;
  std::vector<std::shared_ptr<const Mapping>> mappings;
};

V4l2Buffers::V4l2Buffers(const V4l2Handle& handle, bool several_planes)
    : handle_(handle), pool_(std::make_shared<Pool>()) {
  pool_->handle = &handle;
  pool_->several_planes = several_planes;
  v4l2_requestbuffers request{};
  request.count = wanted_buffers;
  request.memory = V4L2_MEMORY_MMAP;
  request.type = several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  handle.require(handle.call(VIDIOC_REQBUFS, &request), "asking for buffers");
  may_outlive_ = (request.capabilities & V4L2_BUF_CAP_SUPPORTS_ORPHANED_BUFS) != 0;
  for (std::uint32_t i = 0; i < request.count; ++i) {
    BufferCall call(i, several_planes);
    handle.require(handle.call(VIDIOC_QUERYBUF, &call.buffer), "asking for a buffer's place");
    monotonic_ = is_monotonic(call.buffer.flags);
    pool_->mappings.push_back(std::make_shared<const Mapping>(handle, call.length(), call.offset()));
    pool_->places.push_back(Pool::Place::ours);
  }
}

V4l2Buffers::~V4l2Buffers() {
  stop();
  const std::lock_guard lock(pool_->mutex);
  pool_->mappings.clear();
  // Lent pixels keep the file open, so the device is given free for others by hand.
  v4l2_requestbuffers none{};
  none.memory = V4L2_MEMORY_MMAP;
  none.type = pool_->several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)handle_.call(VIDIOC_REQBUFS, &none);
  pool_->handle = nullptr;
}

bool V4l2Buffers::streaming() const { return pool_->streaming; }

bool V4l2Buffers::monotonic() const { return monotonic_; }

void V4l2Buffers::start() {
  const std::lock_guard lock(pool_->mutex);
  for (std::uint32_t i = 0; i < pool_->places.size(); ++i)
    if (pool_->places[i] == Pool::Place::ours) handle_.require(pool_->queue(i), "queueing a buffer");
  int type = pool_->several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  handle_.require(handle_.call(VIDIOC_STREAMON, &type), "starting the stream");
  pool_->streaming = true;
}

void V4l2Buffers::stop() noexcept {
  const std::lock_guard lock(pool_->mutex);
  if (!std::exchange(pool_->streaming, false)) return;
  int type = pool_->several_planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)handle_.call(VIDIOC_STREAMOFF, &type);
  std::ranges::replace(pool_->places, Pool::Place::driver, Pool::Place::ours);
}

std::optional<FilledBuffer> V4l2Buffers::take() {
  const std::lock_guard lock(pool_->mutex);
  BufferCall call(0, pool_->several_planes);
  const int error = handle_.call(VIDIOC_DQBUF, &call.buffer);
  if (error == EAGAIN) return std::nullopt;
  if (error == EPIPE) handle_.fail("its stream has ended; it is opened again");
  handle_.require(error, "taking a frame");
  pool_->places[call.buffer.index] = Pool::Place::ours;
  FilledBuffer filled;
  filled.index = call.buffer.index;
  filled.sequence = call.buffer.sequence;
  filled.time = std::chrono::seconds(call.buffer.timestamp.tv_sec) +
                std::chrono::microseconds(call.buffer.timestamp.tv_usec);
  filled.monotonic = is_monotonic(call.buffer.flags);
  filled.exposure_start = (call.buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  filled.damaged = (call.buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  filled.field = field_of(call.buffer.field);
  const auto all = pool_->mappings[filled.index]->bytes();
  const std::size_t begin = std::min(call.begin(), all.size());
  filled.bytes = all.first(std::clamp(call.used(), begin, all.size())).subspan(begin);
  return filled;
}

void V4l2Buffers::give_back(const FilledBuffer& buffer) {
  const std::lock_guard lock(pool_->mutex);
  handle_.require(pool_->queue(buffer.index), "queueing a buffer");
}

std::shared_ptr<const std::uint8_t> V4l2Buffers::lend(const FilledBuffer& buffer, std::ptrdiff_t offset) {
  const std::lock_guard lock(pool_->mutex);
  if (!may_outlive_ || std::ranges::count(pool_->places, Pool::Place::driver) < stay_queued) return nullptr;
  pool_->places[buffer.index] = Pool::Place::lent;
  const auto give_back = [pool = pool_, mapping = pool_->mappings[buffer.index],
                          index = buffer.index](const std::uint8_t*) { pool->return_lent(index); };
  return {buffer.bytes.data() + offset, give_back};
}

}  // namespace zeropose
