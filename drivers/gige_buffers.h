// The buffers of one stream: being filled, full, or lent to whoever holds a frame.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "drivers/camera.h"
#include "drivers/gige_handles.h"

namespace zeropose {

struct GigeBufferRules {
  int count = 6;
  int kept = 2;             // so many stay with the stream: rather than lend one of them, it is copied
  std::size_t queued = 64;  // full ones that nobody fetched; of more, the oldest is filled again
};

// Shared by the device and the frames that it lent, which may outlive the stream and the device and be let go
// in any thread. The library's thread comes in by started() and done().
class GigeBuffers : public std::enable_shared_from_this<GigeBuffers> {
 public:
  explicit GigeBuffers(GigeBufferRules rules) : rules_(rules) {}
  ~GigeBuffers();
  GigeBuffers(const GigeBuffers&) = delete;
  GigeBuffers& operator=(const GigeBuffers&) = delete;

  // Gives the stream its buffers. The stream must be alive until close().
  void open(_ArvStream* stream, std::size_t bytes);
  // From now on buffers are freed instead of given back. Before the stream goes.
  void close();

  void started();  // the first packet of a frame is there
  void done();     // the library finished a frame, whole or not

  struct Full {
    GigeOwner<_ArvBuffer> buffer;
    TimePoint first_packet, last_packet;
  };
  std::optional<Full> wait_for_full(TimePoint until);
  void give_back(GigeOwner<_ArvBuffer> buffer);
  // The first `bytes` of its memory; a copy of them when too few would stay.
  std::shared_ptr<const std::uint8_t> lend(GigeOwner<_ArvBuffer> buffer, std::size_t bytes);
  // No frame is queued and none is under way. The lent ones count as empty.
  bool idle() const;

 private:
  void take_back(_ArvBuffer* lent);
  void recycle(_ArvBuffer* buffer);

  const GigeBufferRules rules_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  _ArvStream* stream_ = nullptr;  // null: closed
  int lent_ = 0;
  std::deque<TimePoint> started_;  // of the frames under way, in their order
  std::deque<Full> full_;
};

}  // namespace zeropose
