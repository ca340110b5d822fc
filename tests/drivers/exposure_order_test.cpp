#include "drivers/exposure_order.h"

#include <gtest/gtest.h>

#include <random>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::microseconds;
using std::chrono::nanoseconds;

constexpr TimePoint start = TimePoint(1000s);
constexpr std::uint64_t device_start_ns = 77'000'000'000;

FrameArrival arrival(nanoseconds begun, nanoseconds exposure, nanoseconds waited) {
  return {start + begun + exposure + waited, device_start_ns + static_cast<std::uint64_t>(begun.count())};
}

TEST(ExposureOrder, FrameUnderWayIsNotTaken) {
  ExposureOrder order(10ms, 40ms);
  const FrameArrival frame = arrival(0ms, 10ms, 0ms);
  order.note(frame);
  EXPECT_FALSE(order.begun_after(frame, start + 1ms));
  EXPECT_TRUE(order.begun_after(frame, start - 60ms));
}

// It looks younger by 100 ms than it is.
TEST(ExposureOrder, PacketThatWaitedInTheSocket) {
  ExposureOrder order(10ms, 40ms);
  order.note(arrival(0ms, 10ms, 0ms));
  const FrameArrival late = arrival(40ms, 10ms, 100ms);
  order.note(late);
  EXPECT_FALSE(order.begun_after(late, start + 41ms));
}

TEST(ExposureOrder, CameraWithoutAClock) {
  ExposureOrder order(10ms, 40ms);
  const FrameArrival frame{start + 60ms, 0};
  order.note(frame);
  EXPECT_TRUE(order.begun_after(frame, start));
  EXPECT_FALSE(order.begun_after(frame, start + 10ms));
}

// A camera that drifts by 100 ppm and whose clock is set once, frames late by up to 200 ms now and then, sent
// up to one period late; requests at random moments. Never an older frame, and not much waiting.
TEST(ExposureOrder, NeverAnOlderFrame) {
  std::mt19937_64 generator(7);
  const auto up_to = [&](std::int64_t most_us) {
    return microseconds(std::uniform_int_distribution<std::int64_t>(0, most_us)(generator));
  };
  const nanoseconds period = 40ms, exposure = 12ms;
  ExposureOrder order(exposure, period);
  nanoseconds request = 500ms;
  int taken = 0, late = 0;
  for (int i = 0; i < 20000; ++i) {
    const nanoseconds begun = i * period;
    const nanoseconds waited = generator() % 20 == 0 ? up_to(200'000) : up_to(1'000);
    FrameArrival frame = arrival(begun, exposure, up_to(38'000) / (generator() % 10 == 0 ? 1 : 100) + waited);
    frame.device_time_ns += static_cast<std::uint64_t>(begun.count() / 10'000);
    if (i > 10'000) frame.device_time_ns += 5'000'000'000;
    order.note(frame);
    if (!order.begun_after(frame, start + request)) continue;
    ASSERT_GE(begun, request) << i;
    ++taken;
    if (begun > request + 5 * period) ++late;
    request = begun + exposure + up_to(100'000);
  }
  EXPECT_GT(taken, 3000);
  EXPECT_LT(late, taken / 100);
}

}  // namespace
}  // namespace zeropose
