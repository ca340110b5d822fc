// How a robot takes a result from the bus: only whole, only its own, only once (spec 80, CAN). Pure.
#pragma once

#include "protocol/can_codec.h"

namespace zeropose {

inline constexpr std::chrono::milliseconds can_result_window{50};

class CanResultCollector {
 public:
  explicit CanResultCollector(const CanCoding& coding) : coding_(coding) {}

  // From now on only answers to this request count. The epoch is read by SDO before the command is sent.
  void expect(std::uint16_t request_id, std::uint32_t epoch);
  // The answer, at the first commit that ends it: valid, not ok, or done, but not busy. nullopt: not yet, or
  // not for us. The three frames come in order and within 50 ms.
  std::optional<CanResult> take(const CanFrame& frame, TimePoint now);

 private:
  struct Received {
    CanFrame frame;
    TimePoint at;
  };
  std::optional<CanResult> commit(const CanFrame& frame, TimePoint now);

  CanCoding coding_;
  std::optional<std::uint16_t> outstanding_;
  std::uint32_t epoch_ = 0;
  std::optional<Received> lengths_, angles_;
};

}  // namespace zeropose
