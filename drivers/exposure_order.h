// Which frame of a camera that exposes by itself, or by an electric signal, began after a request. Pure.
#pragma once

#include <cstdint>
#include <deque>

#include "drivers/camera.h"

namespace zeropose {

// When the first packet of a frame was seen, and what the camera's clock said in it.
struct FrameArrival {
  TimePoint first_packet;
  std::uint64_t device_time_ns = 0;  // 0: the camera has no clock
};

// A camera cannot send a frame before it has exposed it, and sends it at once unless it is still sending the
// frame before. So the first packet leaves at most exposure + transfer after the exposure began, where
// transfer is the time for the frame before: one period at most of a camera that runs freely, as it could not
// keep its rate otherwise; none where signals are further apart than that. Therefore
//   first packet seen >= request + exposure + transfer + margin   =>   begun after the request,
// unless the packet was seen late: on a busy computer it waits in the socket's buffer, looks younger than it
// is, and the frame may be too old. Nothing makes a packet be seen early, so the smallest difference between
// both clocks over the last frames belongs to a packet that hardly waited. The camera's time plus that
// difference says when a packet should have been seen; the rule is asked about this time, which is never
// later than the one seen. A camera's clock (100 ppm) drifts by less than the margin over the frames
// remembered, a step of it makes frames look older at worst until those are forgotten. Frame ids are not
// needed for it: a frame that was lost or filled anew in between takes nothing away from what holds for the
// next one.
class ExposureOrder {
 public:
  ExposureOrder(std::chrono::nanoseconds exposure, std::chrono::nanoseconds transfer)
      : delay_(exposure + transfer + margin) {}

  // Every frame of the stream, in order.
  void note(const FrameArrival& arrival);
  // Of a noted frame: whether its exposure cannot have begun before the request.
  bool begun_after(const FrameArrival& arrival, TimePoint request) const;

  static constexpr std::chrono::milliseconds margin{3};  // packets on the way and clocks that drift

 private:
  std::chrono::nanoseconds delay_;
  std::deque<std::int64_t> differences_ns_;  // seen minus the camera's time
};

}  // namespace zeropose
