// Cameras that expose by themselves or by an electric signal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "drivers/gige_camera.h"
#include "tests/drivers/gige_test.h"
#include "tests/drivers/numbered_cameras.h"
#include "tests/drivers/rich_camera.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class Running : public ::testing::Test {
 protected:
  CameraOptions options(TriggerSource trigger) {
    CameraOptions options = simulated_.options(0);
    options.trigger = trigger;
    options.exposure_us = 2000;
    return options;
  }
  // What an electric signal does to this camera.
  void signal() {
    simulated_.server().write_register(0, rich::trigger_source, rich::trigger_source_software);
    simulated_.server().write_register(0, rich::trigger_software, 1);
  }

  RichDescription description_;
  NumberedCameras simulated_{1, 320, 240, description_.path()};
};

TEST_F(Running, SetsWhatItNeeds) {
  CameraOptions free = options(TriggerSource::free_run);
  free.frame_rate_hz = 50;
  { const GigeCamera camera(free); }
  EXPECT_EQ(simulated_.server().read_register(0, rich::trigger_mode), 0u);
  EXPECT_EQ(simulated_.server().read_register(0, rich::frame_period_us), 20000u);
  { const GigeCamera camera(options(TriggerSource::line)); }
  EXPECT_EQ(simulated_.server().read_register(0, rich::trigger_mode), 1u);
  EXPECT_EQ(simulated_.server().read_register(0, rich::trigger_source), rich::trigger_source_line1);
}

// The scene changes at random moments: between frames, while one is drawn, exposed or sent.
TEST_F(Running, FreeRunNeverShowsAnOldScene) {
  CameraOptions free = options(TriggerSource::free_run);
  free.frame_rate_hz = 100;
  GigeCamera camera(free);
  camera.start();
  std::mt19937_64 generator(3);
  std::uniform_int_distribution<int> pause_us(0, 12'000);
  for (int i = 0; i < 200; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(pause_us(generator)));
    const std::uint64_t scene = simulated_.new_scene();
    const auto frame = triggered_frame(camera);
    ASSERT_TRUE(frame) << i;
    ASSERT_EQ(number_of(*frame).scene, scene) << i;
    ASSERT_TRUE(all_of_one_scene(*frame)) << i;
  }
  EXPECT_EQ(camera.statistics().frames, 200u);
  EXPECT_GT(camera.statistics().skipped, 0u);
}

TEST_F(Running, FramesThatNobodyFetchesCauseNoUnderrun) {
  CameraOptions free = options(TriggerSource::free_run);
  free.frame_rate_hz = 100;
  GigeCamera camera(free);
  camera.start();
  std::vector<Frame> held;
  for (int i = 0; i < 20; ++i) {
    const auto frame = triggered_frame(camera);
    ASSERT_TRUE(frame);
    held.push_back(*frame);
  }
  std::this_thread::sleep_for(500ms);
  camera.check();
  const std::uint64_t scene = simulated_.new_scene();
  const auto frame = triggered_frame(camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(number_of(*frame).scene, scene);
  EXPECT_EQ(camera.statistics().underruns, 0u);
  EXPECT_EQ(camera.statistics().renewals, 0u);
  for (const Frame& old : held) EXPECT_TRUE(all_of_one_scene(old));
}

TEST_F(Running, LineTriggerWaitsForTheSignal) {
  GigeCamera camera(options(TriggerSource::line));
  camera.start();
  camera.trigger();
  EXPECT_FALSE(camera.grab(in(100ms)));
  for (int i = 0; i < 20; ++i) {
    signal();  // before the request: its frame is not wanted
    std::this_thread::sleep_for(std::chrono::milliseconds(2 * i));
    const std::uint64_t scene = simulated_.new_scene();
    camera.trigger();
    std::this_thread::sleep_for(30ms);
    signal();
    const auto frame = camera.grab(in(3s));
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(number_of(*frame).scene, scene) << i;
  }
  EXPECT_GT(camera.statistics().skipped, 0u);
}

TEST_F(Running, DamagedFramesAreNeverHandedOut) {
  CameraOptions free = options(TriggerSource::free_run);
  free.frame_rate_hz = 50;
  GigeCamera camera(free);
  camera.start();
  simulated_.server().lose_packets(0, 0.3);
  for (int i = 0; i < 10; ++i) {
    try {
      camera.trigger();
      const auto frame = camera.grab(in(200ms));
      EXPECT_TRUE(!frame || all_of_one_scene(*frame));
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.fault(), DeviceFault::damaged_frame);
    }
  }
  EXPECT_GT(camera.statistics().damaged, 0u);
  simulated_.server().lose_packets(0, 0);
  std::this_thread::sleep_for(300ms);
  EXPECT_TRUE(triggered_frame(camera));
}

}  // namespace
}  // namespace zeropose
