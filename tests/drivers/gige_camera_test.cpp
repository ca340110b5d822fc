#include "drivers/gige_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/gige_test.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

class OneCamera : public ::testing::Test {
 protected:
  NumberedCameras simulated_{1};
  GigeCamera camera_{simulated_.options(0)};
};

TEST_F(OneCamera, FrameCarriesPixelsIdentityAndTimes) {
  camera_.start();
  const TimePoint before = steady_clock::now();
  for (std::uint64_t i = 1; i <= 20; ++i) {
    const std::uint64_t scene = simulated_.new_scene();
    const auto frame = triggered_frame(camera_);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->camera, "camera1");
    EXPECT_EQ(frame->sequence, i);
    EXPECT_EQ(frame->width_px, 768);
    EXPECT_EQ(frame->height_px, 572);
    EXPECT_GE(frame->triggered, before);
    EXPECT_GT(frame->received, frame->triggered);
    EXPECT_LE(frame->received, steady_clock::now());
    EXPECT_EQ(number_of(*frame).scene, scene);
    EXPECT_TRUE(all_of_one_scene(*frame));
  }
  EXPECT_EQ(camera_.statistics().frames, 20u);
  EXPECT_EQ(camera_.statistics().renewals, 0u);
}

// The fake camera's ids start near 65400: 200 frames pass 65535 -> 1.
TEST_F(OneCamera, FrameIdsMayWrap) {
  camera_.start();
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(triggered_frame(camera_)) << i;
  EXPECT_EQ(camera_.statistics().stale, 0u);
  EXPECT_EQ(camera_.statistics().renewals, 0u);
}

TEST_F(OneCamera, EveryFrameIsDrawnAnew) {
  camera_.start();
  std::uint64_t last = 0;
  for (int i = 0; i < 30; ++i) {
    const auto frame = triggered_frame(camera_);
    ASSERT_TRUE(frame);
    EXPECT_GT(number_of(*frame).drawn, last);
    last = number_of(*frame).drawn;
  }
}

TEST_F(OneCamera, GrabWithoutTriggerIsOurBug) {
  camera_.start();
  EXPECT_THROW((void)camera_.grab(in(10ms)), std::logic_error);
  ASSERT_TRUE(triggered_frame(camera_));
  EXPECT_THROW((void)camera_.grab(in(10ms)), std::logic_error);
}

// A frame that nobody fetched waits in the queue when the next trigger comes.
TEST_F(OneCamera, QueuedFrameIsNotHandedOut) {
  camera_.start();
  for (int i = 0; i < 5; ++i) {
    camera_.trigger();
    std::this_thread::sleep_for(200ms);  // it has arrived by now, showing the old scene
    const std::uint64_t scene = simulated_.new_scene();
    const auto frame = triggered_frame(camera_);
    ASSERT_TRUE(frame);
    EXPECT_EQ(number_of(*frame).scene, scene);
    EXPECT_TRUE(all_of_one_scene(*frame));
  }
  EXPECT_EQ(camera_.statistics().renewals, 5u);
}

// The deadline passes at a random moment between trigger, exposure, transfer and arrival.
TEST_F(OneCamera, FrameUnderWayIsNotHandedOut) {
  camera_.start();
  int timeouts = 0;
  for (int i = 0; i < 42; ++i) {
    camera_.trigger();
    if (!camera_.grab(in(std::chrono::milliseconds(i / 3)))) ++timeouts;
    const std::uint64_t scene = simulated_.new_scene();
    const auto frame = triggered_frame(camera_);
    ASSERT_TRUE(frame);
    ASSERT_EQ(number_of(*frame).scene, scene) << "after a deadline of " << i / 3 << " ms";
    ASSERT_TRUE(all_of_one_scene(*frame));
  }
  EXPECT_GT(timeouts, 0);
}

// A camera that exposes without being asked: its frames are queued and under way all the time.
TEST_F(OneCamera, FramesOfARunningCameraAreNotHandedOut) {
  camera_.start();
  ASSERT_TRUE(triggered_frame(camera_));
  simulated_.server().run_free(0, 50);
  std::this_thread::sleep_for(150ms);
  try {
    camera_.check();                    // notices frames that nobody asked for and begins a new stream
  } catch (const DeviceError& error) {  // when it finds no quiet moment for that
    EXPECT_THAT(error.what(), AnyOf(HasSubstr("nobody asked for"), HasSubstr("a frame came damaged")));
  }
  EXPECT_GE(camera_.statistics().stale, 1u);
  simulated_.server().run_free(0, 0);
  camera_.start();
  int refused = 0;
  for (int i = 0; i < 5; ++i) {
    const std::uint64_t scene = simulated_.new_scene();
    try {
      const auto frame = triggered_frame(camera_);
      ASSERT_TRUE(frame);
      EXPECT_EQ(number_of(*frame).scene, scene);
    } catch (const DeviceError& error) {  // the last one nobody asked for was still on its way at the start
      EXPECT_EQ(error.fault(), DeviceFault::damaged_frame) << error.what();
      ++refused;
    }
  }
  EXPECT_LE(refused, 1);
}

TEST_F(OneCamera, LostPacketsAreDamageNotAFrame) {
  camera_.start();
  ASSERT_TRUE(triggered_frame(camera_));
  simulated_.server().lose_packets(0, 0.1);
  const auto [fault, text] = failure([&] {
    for (int i = 0; i < 50; ++i) (void)triggered_frame(camera_);
  });
  EXPECT_EQ(fault, DeviceFault::damaged_frame);
  EXPECT_THAT(text, HasSubstr("camera1 (127.0.0.11)"));
  EXPECT_EQ(camera_.statistics().damaged, 1u);
  simulated_.server().lose_packets(0, 0);
  const std::uint64_t scene = simulated_.new_scene();
  const auto frame = triggered_frame(camera_);
  ASSERT_TRUE(frame);
  EXPECT_EQ(number_of(*frame).scene, scene);
}

TEST_F(OneCamera, FrameOfAnotherSizeIsRefused) {
  camera_.start();
  ASSERT_TRUE(triggered_frame(camera_));
  simulated_.server().send_narrower(0, 700);
  const auto [fault, text] = failure([&] { (void)triggered_frame(camera_); });
  EXPECT_EQ(fault, DeviceFault::wrong_size);
  EXPECT_THAT(text, HasSubstr("700x572"));
}

TEST_F(OneCamera, CheckNoticesACameraThatWasSwitchedOffInBetween) {
  camera_.start();
  camera_.check();
  simulated_.server().stop_camera(0);
  simulated_.server().start_camera(0);
  const auto [fault, text] = failure([&] { camera_.check(); });
  EXPECT_EQ(fault, DeviceFault::missing);
  EXPECT_THAT(text, HasSubstr("no longer knows us"));
}

TEST(OpenCamera, SensorTooSmall) {
  NumberedCameras simulated(1, 640, 480);
  CameraOptions options = simulated.options(0);
  options.width_px = 768;
  options.height_px = 572;
  const auto [fault, text] = failure([&] { const GigeCamera camera(options); });
  EXPECT_EQ(fault, DeviceFault::wrong_size);
  EXPECT_THAT(text, HasSubstr("sensor has 640x480, the cell file wants 768x572"));
}

TEST(OpenCamera, AppliesExposureAndGain) {
  NumberedCameras simulated(1);
  CameraOptions options = simulated.options(0);
  options.exposure_us = 5000;
  options.gain = 3;
  GigeCamera camera(options);
  camera.start();
  EXPECT_TRUE(triggered_frame(camera));
}

TEST(OpenCamera, NothingThere) {
  const auto [fault, text] = failure([] { const GigeCamera camera(NumberedCameras::options_for(1)[0]); });
  EXPECT_EQ(fault, DeviceFault::missing);
  EXPECT_THAT(text, HasSubstr("camera1 (127.0.0.11): does not answer"));
}

TEST(OpenCamera, NotAnAddress) {
  CameraOptions options{.name = "camera1", .width_px = 768, .height_px = 572, .gige = {.address = "127.0.0"}};
  EXPECT_THAT(failure([&] { const GigeCamera camera(options); }).second, HasSubstr("not an IPv4 address"));
}

TEST(OpenCamera, SecondController) {
  NumberedCameras simulated(1);
  const GigeCamera first(simulated.options(0));
  const auto [fault, text] = failure([&] { const GigeCamera second(simulated.options(0)); });
  EXPECT_EQ(fault, DeviceFault::in_use);
  EXPECT_THAT(text, HasSubstr("another program controls it"));
}

TEST(GigeServer, AddressesThatCannotBeServed) {
  const auto message = [](const std::string& address) -> std::string {
    try {
      const GigeServer server({{"camera9", address, 64, 48}}, [](std::size_t, std::span<std::uint8_t>) {});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "served";
  };
  EXPECT_THAT(message("127.0.0.99"), HasSubstr("ip addr add 127.0.0.99/8 dev lo"));
  EXPECT_THAT(message("192.0.2.1"), HasSubstr("ip addr add 192.0.2.1/8 dev lo"));
  EXPECT_THAT(message("lo"), HasSubstr("not an IPv4 address"));
  NumberedCameras simulated(1);
  EXPECT_THAT(message("127.0.0.11"), HasSubstr("already served"));
}

}  // namespace
}  // namespace zeropose
