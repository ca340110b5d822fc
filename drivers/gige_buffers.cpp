#include "drivers/gige_buffers.h"

#include <arv.h>

#include <utility>

namespace zeropose {

using std::chrono::steady_clock;

GigeBuffers::~GigeBuffers() = default;

void GigeBuffers::open(_ArvStream* stream, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  stream_ = stream;
  for (int i = 0; i < rules_.count; ++i) arv_stream_push_buffer(stream, arv_buffer_new(bytes, nullptr));
}

void GigeBuffers::close() {
  const std::lock_guard lock(mutex_);
  stream_ = nullptr;
  full_.clear();
}

void GigeBuffers::started() {
  const std::lock_guard lock(mutex_);
  started_.push_back(steady_clock::now());
}

// The library finishes frames in the order in which they began, so that the times can be told apart.
void GigeBuffers::done() {
  const std::lock_guard lock(mutex_);
  if (stream_ == nullptr) return;  // the stream is being destroyed and frees it
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_)) {
    const TimePoint now = steady_clock::now();
    const TimePoint first_packet = started_.empty() ? now : started_.front();
    if (!started_.empty()) started_.pop_front();
    full_.push_back({GigeOwner<_ArvBuffer>(buffer), first_packet, now});
  }
  for (; full_.size() > rules_.queued; full_.pop_front()) recycle(full_.front().buffer.release());
  filled_.notify_all();
}

std::optional<GigeBuffers::Full> GigeBuffers::wait_for_full(TimePoint until) {
  std::unique_lock lock(mutex_);
  if (!filled_.wait_until(lock, until, [this] { return !full_.empty(); })) return std::nullopt;
  Full full = std::move(full_.front());
  full_.pop_front();
  return full;
}

void GigeBuffers::recycle(_ArvBuffer* buffer) {
  if (stream_ != nullptr)
    arv_stream_push_buffer(stream_, buffer);
  else
    g_object_unref(buffer);
}

void GigeBuffers::give_back(GigeOwner<_ArvBuffer> buffer) {
  const std::lock_guard lock(mutex_);
  recycle(buffer.release());
}

void GigeBuffers::take_back(_ArvBuffer* lent) {
  const std::lock_guard lock(mutex_);
  --lent_;
  recycle(lent);
}

std::shared_ptr<const std::uint8_t> GigeBuffers::lend(GigeOwner<_ArvBuffer> buffer, std::size_t bytes) {
  std::size_t all_bytes = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &all_bytes));
  bool enough_stay = false;
  {
    const std::lock_guard lock(mutex_);
    enough_stay = rules_.count - lent_ > rules_.kept;
    if (enough_stay) ++lent_;
  }
  if (enough_stay) {
    ArvBuffer* lent = buffer.release();
    return {data, [self = shared_from_this(), lent](const std::uint8_t*) { self->take_back(lent); }};
  }
  auto copy = own_pixels({data, data + bytes});
  give_back(std::move(buffer));
  return copy;
}

bool GigeBuffers::idle() const {
  const std::lock_guard lock(mutex_);
  int empty = 0, done = 0;
  arv_stream_get_n_buffers(stream_, &empty, &done);
  return full_.empty() && done == 0 && empty + lent_ == rules_.count;
}

}  // namespace zeropose
