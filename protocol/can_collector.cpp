#include "protocol/can_collector.h"

#include <utility>

namespace zeropose {

void CanResultCollector::expect(std::uint16_t request_id, std::uint32_t epoch) {
  outstanding_ = request_id;
  epoch_ = epoch;
  lengths_.reset();
  angles_.reset();
}

std::optional<CanResult> CanResultCollector::take(const CanFrame& frame, TimePoint now) {
  if (!outstanding_ || frame.extended || frame.remote || frame.error || frame.fd) return std::nullopt;
  if (frame.id == can_id::tpdo1 + coding_.node) {
    lengths_ = Received{frame, now};
    angles_.reset();
  } else if (frame.id == can_id::tpdo2 + coding_.node) {
    angles_ = Received{frame, now};
  } else if (frame.id == can_id::tpdo3 + coding_.node) {
    return commit(frame, now);
  }
  return std::nullopt;
}

// Whatever comes of it, the frames before it are used up: no later commit may count them again.
std::optional<CanResult> CanResultCollector::commit(const CanFrame& frame, TimePoint now) {
  const auto lengths = std::exchange(lengths_, std::nullopt);
  const auto angles = std::exchange(angles_, std::nullopt);
  if (!lengths || !angles || now - lengths->at > can_result_window) return std::nullopt;
  const std::array<CanFrame, 3> frames = {lengths->frame, angles->frame, frame};
  const auto result = decode_can_result(frames, epoch_, coding_);
  if (!result || outstanding_ != result->request_id || result->has(can_status::busy)) return std::nullopt;
  outstanding_.reset();
  return result;
}

}  // namespace zeropose
