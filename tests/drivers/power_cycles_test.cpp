// Four cameras that are switched off and on at random moments of a grab, again and again.
#include <gtest/gtest.h>

#include <random>

#include "drivers/camera_worker.h"
#include "tests/drivers/numbered_cameras.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto duration = 100s;

class PowerCycles {
 public:
  PowerCycles(NumberedCameras& simulated, std::size_t camera)
      : simulated_(simulated), camera_(camera), generator_(camera), worker_(simulated.options(camera)) {}

  // False: the camera did not come back.
  bool run(TimePoint until) {
    while (steady_clock::now() < until) {
      if (!comes_back()) return false;
      std::this_thread::sleep_for(random_up_to(500ms));  // anywhere within the heartbeat's period
      std::jthread killer([this, after = random_up_to(10ms)] {
        std::this_thread::sleep_for(after);
        simulated_.server().stop_camera(camera_);
      });
      grab();
      killer.join();
      if (generator_() % 2 == 0) grab();
      std::this_thread::sleep_for(random_up_to(600ms));
      simulated_.server().start_camera(camera_);
      for (int i = 0; i < 3; ++i) grab();
    }
    return comes_back();
  }

 private:
  bool comes_back() const {
    for (const TimePoint end = steady_clock::now() + 15s; steady_clock::now() < end;
         std::this_thread::sleep_for(2ms))
      if (worker_.state() == CameraState::alive) return true;
    return false;
  }
  void grab() { (void)worker_.request(steady_clock::now() + 475ms).wait(); }
  milliseconds random_up_to(milliseconds most) {
    return milliseconds(std::uniform_int_distribution<std::int64_t>(0, most.count())(generator_));
  }

  NumberedCameras& simulated_;
  const std::size_t camera_;
  std::mt19937_64 generator_;
  CameraWorker worker_;
};

TEST(PowerCycles, EveryCameraComesBackEveryTime) {
  NumberedCameras simulated(4);
  const TimePoint until = steady_clock::now() + duration;
  std::vector<std::jthread> threads;
  for (std::size_t camera = 0; camera < 4; ++camera)
    threads.emplace_back([&simulated, camera, until] {
      PowerCycles cycles(simulated, camera);
      EXPECT_TRUE(cycles.run(until)) << simulated.options(camera).name;
    });
}

}  // namespace
}  // namespace zeropose
