// Frames lend the memory into which the library receives.
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "drivers/gige_camera.h"
#include "tests/drivers/gige_test.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;

class Lending : public ::testing::Test {
 protected:
  Frame grab() {
    expected_.push_back(simulated_.new_scene());
    auto frame = triggered_frame(*camera_);
    if (!frame) throw std::runtime_error("no frame");
    return *frame;
  }
  void expect_unchanged(const std::vector<Frame>& held) const {
    for (std::size_t i = 0; i < held.size(); ++i) {
      EXPECT_EQ(number_of(held[i]).scene, expected_[i]) << i;
      EXPECT_TRUE(all_of_one_scene(held[i])) << i;
    }
  }

  NumberedCameras simulated_{1};
  std::unique_ptr<GigeCamera> camera_ = std::make_unique<GigeCamera>(simulated_.options(0));
  std::vector<std::uint64_t> expected_;
};

// Copies would be made anew; what is received into comes round.
TEST_F(Lending, PixelsLieInTheBuffersOfTheStream) {
  camera_->start();
  std::set<const std::uint8_t*> places, first;
  for (int i = 0; i < 40; ++i) {
    const Frame frame = grab();
    places.insert(frame.pixels.get());
    if (i < 6) first.insert(frame.pixels.get());
  }
  EXPECT_EQ(places.size(), 6u);
  EXPECT_EQ(first.size(), 6u);
  EXPECT_EQ(camera_->statistics().renewals, 0u);
}

TEST_F(Lending, HeldFramesNeitherChangeNorStarveTheCamera) {
  camera_->start();
  std::vector<Frame> held;
  for (int i = 0; i < 20; ++i) held.push_back(grab());
  camera_->check();
  EXPECT_EQ(camera_->statistics().underruns, 0u);
  EXPECT_EQ(camera_->statistics().renewals, 0u);
  EXPECT_EQ(camera_->statistics().stale, 0u);
  expect_unchanged(held);
}

TEST_F(Lending, HeldFramesOutliveStreamAndCamera) {
  std::vector<Frame> held;
  for (int opening = 0; opening < 4; ++opening) {
    camera_->start();
    for (int i = 0; i < 3; ++i) held.push_back(grab());
    camera_->trigger();
    (void)camera_->grab(in(0ms));
    held.push_back(grab());  // by a new stream
    if (opening % 2 == 0) camera_->stop();
  }
  EXPECT_GT(camera_->statistics().renewals, 0u);
  camera_.reset();
  expect_unchanged(held);
}

TEST_F(Lending, FramesMayBeLetGoInAnyThreadAtAnyTime) {
  camera_->start();
  for (int round = 0; round < 3; ++round) {
    std::vector<std::jthread> holders;
    for (int i = 0; i < 12; ++i)
      holders.emplace_back([frame = grab(), i] {
        std::this_thread::sleep_for(std::chrono::milliseconds(7 * i));
        EXPECT_TRUE(all_of_one_scene(frame));
      });
    camera_->check();
    camera_->stop();
    camera_->start();
  }
  EXPECT_EQ(camera_->statistics().underruns, 0u);
  EXPECT_EQ(camera_->statistics().stale, 0u);
}

}  // namespace
}  // namespace zeropose
