// One frame of each camera wanted, exposed after now, by the deadline.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/frozen_pictures.h"
#include "drivers/camera_worker.h"
#include "measure/code.h"

namespace zeropose {

Code code_of(GrabStatus status);

// The frames of all cameras wanted, in their order, or none.
struct FrameSet {
  Code code = Code::internal;  // of the first camera that failed
  std::string reason;          // of all that did
  std::vector<Frame> frames;
  std::chrono::nanoseconds trigger_spread{};  // from the earliest to the latest trigger, by this computer
  // From the earliest to the latest frame, by the cameras' clocks; when all of them follow the network's.
  std::optional<std::chrono::nanoseconds> device_spread;
};

// Of frames that were asked for together.
std::chrono::nanoseconds trigger_spread(std::span<const Frame> frames);
std::optional<std::chrono::nanoseconds> device_spread(std::span<const Frame> frames);

class Grabber {
 public:
  explicit Grabber(const std::vector<CameraOptions>& cameras);
  ~Grabber();  // the waits for lost devices run side by side

  // Triggers all at once and waits for all. In the order of the indices; the answer is there at the deadline.
  std::vector<GrabResult> grab(std::span<const std::size_t> cameras, TimePoint deadline);

  // The same; a camera that repeats its picture fails as well.
  FrameSet grab_live(std::span<const std::size_t> cameras, TimePoint deadline);

  std::size_t size() const { return workers_.size(); }
  const CameraWorker& camera(std::size_t index) const { return *workers_[index]; }

 private:
  std::vector<std::unique_ptr<CameraWorker>> workers_;
  FrozenPictures pictures_;
};

}  // namespace zeropose
