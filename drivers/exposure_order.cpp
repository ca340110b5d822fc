#include "drivers/exposure_order.h"

#include <algorithm>

namespace zeropose {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t frames_remembered = 64;

std::int64_t seen_ns(const FrameArrival& arrival) {
  return std::chrono::duration_cast<nanoseconds>(arrival.first_packet.time_since_epoch()).count();
}

std::int64_t difference_ns(const FrameArrival& arrival) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(seen_ns(arrival)) - arrival.device_time_ns);
}

}  // namespace

void ExposureOrder::note(const FrameArrival& arrival) {
  if (arrival.device_time_ns == 0) return;
  differences_ns_.push_back(difference_ns(arrival));
  if (differences_ns_.size() > frames_remembered) differences_ns_.pop_front();
}

bool ExposureOrder::begun_after(const FrameArrival& arrival, TimePoint request) const {
  nanoseconds waited{0};
  if (arrival.device_time_ns != 0 && !differences_ns_.empty())
    waited = nanoseconds(
        std::max<std::int64_t>(0, difference_ns(arrival) - *std::ranges::min_element(differences_ns_)));
  return arrival.first_packet - waited >= request + delay_;
}

}  // namespace zeropose
