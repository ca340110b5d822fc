#include "daemon/grab.h"

#include <gtest/gtest.h>

namespace zeropose {
namespace {

using namespace std::chrono_literals;

std::vector<Frame> three_frames() {
  std::vector<Frame> frames(3);
  frames[0].triggered = TimePoint(5s + 30us);
  frames[1].triggered = TimePoint(5s);
  frames[2].triggered = TimePoint(5s + 20us);
  frames[0].device_time_ns = 9'000'000'100;
  frames[1].device_time_ns = 9'000'000'000;
  frames[2].device_time_ns = 9'000'000'700;
  return frames;
}

TEST(FrameSpread, FromTheEarliestToTheLatest) {
  std::vector<Frame> frames = three_frames();
  EXPECT_EQ(trigger_spread(frames), 30us);
  for (Frame& frame : frames) frame.network_time = true;
  EXPECT_EQ(device_spread(frames), 700ns);
}

// Clocks that run by themselves say nothing about one another.
TEST(FrameSpread, OneClockThatDoesNotFollow) {
  std::vector<Frame> frames = three_frames();
  EXPECT_FALSE(device_spread(frames));
  frames[0].network_time = frames[2].network_time = true;
  EXPECT_FALSE(device_spread(frames));
}

TEST(FrameSpread, NoFrames) {
  EXPECT_EQ(trigger_spread({}), 0ns);
  EXPECT_FALSE(device_spread({}));
}

}  // namespace
}  // namespace zeropose
