#include "daemon/grab.h"

#include <algorithm>

namespace zeropose {

namespace {

// Of a folder the same picture may come again.
bool is_live(const CameraOptions& camera) { return camera.driver != CameraDriver::folder; }

}  // namespace

Code code_of(GrabStatus status) {
  switch (status) {
    case GrabStatus::ok:
      return Code::ok;
    case GrabStatus::missing:
      return Code::camera_missing;
    case GrabStatus::timeout:
      return Code::frame_timeout;
    case GrabStatus::damaged:
      return Code::frame_damaged;
    case GrabStatus::wrong_size:
      return Code::frame_wrong_size;
  }
  return Code::internal;
}

std::chrono::nanoseconds trigger_spread(std::span<const Frame> frames) {
  if (frames.empty()) return {};
  const auto [first, last] = std::ranges::minmax(frames, {}, &Frame::triggered);
  return last.triggered - first.triggered;
}

std::optional<std::chrono::nanoseconds> device_spread(std::span<const Frame> frames) {
  if (frames.empty() || !std::ranges::all_of(frames, &Frame::network_time)) return std::nullopt;
  const auto [first, last] = std::ranges::minmax(frames, {}, &Frame::device_time_ns);
  return std::chrono::nanoseconds(last.device_time_ns - first.device_time_ns);
}

Grabber::Grabber(const std::vector<CameraOptions>& cameras) : pictures_(cameras.size()) {
  for (const auto& camera : cameras) workers_.push_back(std::make_unique<CameraWorker>(camera));
}

Grabber::~Grabber() {
  for (const auto& worker : workers_) worker->request_stop();
}

std::vector<GrabResult> Grabber::grab(std::span<const std::size_t> cameras, TimePoint deadline) {
  std::vector<CameraWorker::Pending> pending;
  for (const std::size_t camera : cameras) pending.push_back(workers_[camera]->request(deadline));
  std::vector<GrabResult> results;
  for (auto& request : pending) results.push_back(request.wait());
  return results;
}

FrameSet Grabber::grab_live(std::span<const std::size_t> cameras, TimePoint deadline) {
  FrameSet set;
  set.code = Code::ok;
  const auto fail = [&set](Code code, const std::string& reason) {
    if (set.code == Code::ok) set.code = code;
    set.reason += (set.reason.empty() ? "" : "; ") + reason;
  };
  for (GrabResult& result : grab(cameras, deadline)) {
    if (result.status != GrabStatus::ok) fail(code_of(result.status), result.reason);
    set.frames.push_back(std::move(result.frame));
  }
  if (set.code == Code::ok)
    for (std::size_t i = 0; i < cameras.size(); ++i)
      if (is_live(workers_[cameras[i]]->camera()) && pictures_.repeats(cameras[i], set.frames[i]))
        fail(Code::frame_frozen, set.frames[i].camera + " delivered the same picture as before, bit for bit");
  if (set.code != Code::ok) set.frames.clear();
  set.trigger_spread = trigger_spread(set.frames);
  set.device_spread = device_spread(set.frames);
  return set;
}

}  // namespace zeropose
