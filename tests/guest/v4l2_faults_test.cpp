// Old frames, lost devices, lost signals and damaged frames of V4L2 cameras; who holds which buffer.
#include <cstring>
#include <thread>

#include "tests/guest/vivid.h"

namespace zeropose {
namespace {

std::uint64_t number_in(const Frame& frame) {
  std::uint64_t number = 0;
  std::memcpy(&number, frame.row(0).data(), sizeof number);
  return number;
}

// The picture's memory is what the camera looks at: a frame exposed after a change shows the change. So a
// frame that shows less than what stood there at its trigger is a stale one.
class VividStale : public Vivid, public testing::WithParamInterface<TriggerSource> {};

TEST_P(VividStale, NoFrameIsOlderThanItsTrigger) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.trigger = GetParam();
  V4l2Camera camera(options);
  camera.start();
  for (std::uint64_t number = 1; number <= 12; ++number) {
    // Time for old frames, from none to more than the buffers hold.
    std::this_thread::sleep_for(std::chrono::milliseconds(number % 4 * 60));
    std::memcpy(output.shown().data(), &number, sizeof number);
    const auto before = steady_clock::now();
    const Frame frame = grab(camera);
    EXPECT_EQ(number_in(frame), number);
    EXPECT_GE(frame.triggered, before);
    EXPECT_GT(std::chrono::nanoseconds(frame.device_time_ns), frame.triggered.time_since_epoch());
  }
  EXPECT_GT(camera.statistics().stale, 0U) << "nothing was ever dropped, so nothing was proved";
}

INSTANTIATE_TEST_SUITE_P(Triggers, VividStale,
                         testing::Values(TriggerSource::software, TriggerSource::free_run));

TEST_F(Vivid, RunsOnWithoutTriggers) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.trigger = TriggerSource::free_run;
  V4l2Camera camera(options);
  camera.start();
  std::uint64_t last = grab(camera).device_time_ns;
  for (int i = 0; i < 5; ++i) {
    const auto frame = camera.grab(steady_clock::now() + patience);
    ASSERT_TRUE(frame);
    EXPECT_GT(frame->device_time_ns, last);
    last = frame->device_time_ns;
  }
}

TEST_F(Vivid, FourAtOnceGiveEachItsOwnPicture) {
  std::vector<std::unique_ptr<V4l2Output>> outputs;
  std::vector<std::unique_ptr<CameraWorker>> workers;
  for (int i = 0; i < 4; ++i) {
    outputs.push_back(std::make_unique<V4l2Output>(shown_by(i)));
    workers.push_back(std::make_unique<CameraWorker>(options_of(i)));
  }
  for (const auto& worker : workers)
    for (int i = 0; worker->state() != CameraState::alive && i < 200; ++i) std::this_thread::sleep_for(50ms);
  for (unsigned round = 0; round < 4; ++round) {
    std::vector<std::vector<std::uint8_t>> pictures;
    for (unsigned i = 0; i < 4; ++i) {
      pictures.push_back(random_picture(10 * round + i, outputs[i]->shown().size()));
      outputs[i]->show(pictures.back());
    }
    std::vector<CameraWorker::Pending> pending;
    for (const auto& worker : workers) pending.push_back(worker->request(steady_clock::now() + patience));
    for (std::size_t i = 0; i < 4; ++i) {
      const GrabResult result = pending[i].wait();
      ASSERT_EQ(result.status, GrabStatus::ok) << result.reason;
      EXPECT_TRUE(shows(result.frame, pictures[i])) << "camera " << i << ", round " << round;
    }
  }
  for (const auto& worker : workers) worker->request_stop();
}

GrabResult grab(CameraWorker& worker) { return worker.request(steady_clock::now() + patience).wait(); }

// Until the camera is back, or the patience is over.
GrabResult grab_when_back(CameraWorker& worker) {
  GrabResult result;
  for (int i = 0; i < 100 && result.status != GrabStatus::ok; ++i) {
    result = grab(worker);
    if (result.status != GrabStatus::ok) std::this_thread::sleep_for(100ms);
  }
  return result;
}

// Until the camera gives nothing any more.
GrabResult grab_until_lost(CameraWorker& worker) {
  GrabResult result = grab(worker);
  for (int i = 0; i < 50 && result.status == GrabStatus::ok; ++i) result = grab(worker);
  return result;
}

TEST_F(Vivid, ReturnsAfterADisconnect) {
  CameraOptions options = options_of(2, 1280, 720);
  options.v4l2.controls = {{"osd_text_mode", 2}};
  { const V4l2Output timings(shown_by(2, 1280, 720)); }
  CameraWorker worker(options);
  ASSERT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
  set_control(2, "disconnect", 1);
  const GrabResult lost = grab_until_lost(worker);
  EXPECT_EQ(lost.status, GrabStatus::missing);
  EXPECT_NE(lost.reason.find("check its power and cable"), std::string::npos) << lost.reason;
  EXPECT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
}

void write_to(const std::string& file, const std::string& text) { std::ofstream(file) << text << std::flush; }

TEST_F(Vivid, ReturnsAfterItsDriverWasUnbound) {
  CameraOptions options = options_of(3, 1280, 720);
  options.v4l2.controls = {{"osd_text_mode", 2}};
  { const V4l2Output timings(shown_by(3, 1280, 720)); }
  CameraWorker worker(options);
  ASSERT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
  write_to("/sys/bus/platform/drivers/vivid/unbind", "vivid.0");
  EXPECT_EQ(grab_until_lost(worker).status, GrabStatus::missing);
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(grab(worker).status, GrabStatus::missing);
  EXPECT_FALSE(std::filesystem::exists(capture_device(3)));
  write_to("/sys/bus/platform/drivers/vivid/bind", "vivid.0");
  EXPECT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
}

TEST_F(Vivid, GivesNothingWithoutASignal) {
  V4l2Output output(shown_by(1));
  CameraWorker worker(options_of(1));
  ASSERT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
  set_control(1, "dv_timings_signal_mode", 1);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(grab(worker).status, GrabStatus::missing);
  for (int i = 0; i < 50 && worker.last_problem().find("no signal") == std::string::npos; ++i)
    std::this_thread::sleep_for(50ms);
  EXPECT_NE(worker.last_problem().find("no signal"), std::string::npos) << worker.last_problem();
  set_control(1, "dv_timings_signal_mode", 2);
  EXPECT_EQ(grab(worker).status, GrabStatus::missing);
  set_control(1, "dv_timings_signal_mode", 0);
  const auto picture = random_picture(5, output.shown().size());
  std::ranges::copy(picture, output.shown().begin());
  const GrabResult back = grab_when_back(worker);
  ASSERT_EQ(back.status, GrabStatus::ok) << back.reason;
  EXPECT_TRUE(shows(back.frame, picture));
}

TEST_F(Vivid, AChangedSignalIsSetUpAnew) {
  V4l2Output output(shown_by(1));
  V4l2Camera camera(options_of(1));
  camera.start();
  grab(camera);
  EXPECT_NO_THROW(camera.check());
  set_control(1, "dv_timings_signal_mode", 1);
  set_control(1, "dv_timings_signal_mode", 0);
  try {
    camera.check();
    FAIL() << "the change went unnoticed";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.fault(), DeviceFault::missing);
    EXPECT_NE(std::string(error.what()).find("changed"), std::string::npos) << error.what();
  }
}

TEST_F(Vivid, IsNotTakenFromAnother) {
  V4l2Output output(shown_by(1));
  {
    V4l2Camera first(options_of(1));
    first.start();
    EXPECT_EQ(fault_of_opening(options_of(1), "another program uses the device"), DeviceFault::in_use);
    grab(first);
  }
  V4l2Camera next(options_of(1));
  next.start();
  grab(next);
}

// More frames than buffers: the last ones are copies, and the stream goes on.
TEST_F(Vivid, FramesOutliveTheirCamera) {
  V4l2Output output(shown_by(1));
  std::vector<Frame> held;
  std::vector<std::vector<std::uint8_t>> pictures;
  {
    V4l2Camera camera(options_of(1));
    camera.start();
    for (unsigned i = 0; i < 8; ++i) {
      pictures.push_back(random_picture(i, output.shown().size()));
      output.show(pictures.back());
      held.push_back(grab(camera));
    }
    held.erase(held.begin());
    pictures.erase(pictures.begin());
    grab(camera);
  }
  V4l2Camera next(options_of(1));
  next.start();
  for (int i = 0; i < 3; ++i) grab(next);
  for (std::size_t i = 0; i < held.size(); ++i) EXPECT_TRUE(shows(held[i], pictures[i])) << i;
}

TEST_F(Vivid, DamagedFramesAreRefusedAndCounted) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.trigger = TriggerSource::free_run;
  V4l2Camera camera(options);
  camera.start();
  grab(camera);
  bool refused = false;
  for (int i = 0; i < 30 && !refused; ++i) {
    camera.trigger();
    set_control(1, "inject_v4l2_buf_flag_error", 1);
    try {
      for (int k = 0; k < 10; ++k) camera.grab(steady_clock::now() + patience);
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.fault(), DeviceFault::damaged_frame);
      refused = true;
    }
  }
  EXPECT_TRUE(refused);
  EXPECT_EQ(camera.statistics().damaged, 1U);
  grab(camera);
}

TEST_F(Vivid, FramesThatTheDriverDroppedAreCounted) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.trigger = TriggerSource::free_run;
  options.v4l2.controls.push_back({"Percentage of Dropped Buffers", 50});
  V4l2Camera camera(options);
  camera.start();
  grab(camera);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(camera.grab(steady_clock::now() + patience));
  set_control(1, "percentage_of_dropped_buffers", 0);
  EXPECT_GT(camera.statistics().underruns, 0U);
}

TEST_F(Vivid, ABrokenStreamIsOpenedAnew) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.trigger = TriggerSource::free_run;
  CameraWorker worker(options);
  ASSERT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
  set_control(1, "inject_fatal_streaming_error", 1);
  EXPECT_EQ(grab_until_lost(worker).status, GrabStatus::missing);
  EXPECT_EQ(grab_when_back(worker).status, GrabStatus::ok) << worker.last_problem();
}

TEST_F(Vivid, ADeadlineIsKept) {
  V4l2Output output(shown_by(1));
  CameraOptions options = options_of(1);
  options.v4l2.controls.push_back({"Percentage of Dropped Buffers", 100});
  V4l2Camera camera(options);
  camera.start();
  camera.trigger();
  const auto begin = steady_clock::now();
  EXPECT_FALSE(camera.grab(begin + 300ms));
  EXPECT_GE(steady_clock::now() - begin, 300ms);
  EXPECT_LT(steady_clock::now() - begin, 3s);
  EXPECT_EQ(camera.statistics().timeouts, 1U);
  set_control(1, "percentage_of_dropped_buffers", 0);
  grab(camera);
}

}  // namespace
}  // namespace zeropose
