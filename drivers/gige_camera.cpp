#include "drivers/gige_camera.h"

#include <chrono>
#include <stdexcept>
#include <utility>

namespace zeropose {
namespace {

using std::chrono::steady_clock;

// An acknowledge later than this may be that of a repeated command: the library sends anew after 500 ms.
constexpr std::chrono::milliseconds repeated_command{400};

constexpr int trials = 4;
constexpr std::chrono::milliseconds trial_time{1000};

bool follows(std::uint64_t id, std::uint64_t last) {
  return id == last + 1 || (last == 65535 && id == 1);  // 16-bit ids have no zero
}

}  // namespace

GigeCamera::GigeCamera(CameraOptions options) : options_(std::move(options)), device_(options_) {}

void GigeCamera::fail(const std::string& what, DeviceFault fault) const {
  throw DeviceError(device_.where() + ": " + what, fault);
}

void GigeCamera::start() {
  if (device_.streaming()) return;
  device_.open_stream();
  prove_stream();
  outstanding_ = suspect_ = false;
}

// The first frame of a stream is a trial: the library enlarges the socket's buffer when it comes, mostly too
// late for it, and a trigger that the device kept from before the stream is used up by it.
void GigeCamera::prove_stream() {
  std::string problem;
  for (int attempt = 0; attempt < trials; ++attempt) {
    device_.trigger();
    const auto frame = device_.receive(steady_clock::now() + trial_time);
    if (!frame) break;
    last_id_ = frame->id;
    problem = frame->problem;
    if (problem.empty() && device_.idle()) return;
  }
  device_.close_stream();
  if (problem.empty())
    fail("answers, but its frames do not come; check firewall and network", DeviceFault::missing);
  ++statistics_.damaged;
  fail_damaged(problem);
}

void GigeCamera::stop() noexcept { device_.close_stream(); }

void GigeCamera::renew() {
  ++statistics_.renewals;
  stop();
  start();
}

void GigeCamera::require_heartbeat() const {
  if (device_.lost())
    fail("lost; check its power and cable. It is used again as soon as it answers", DeviceFault::missing);
}

void GigeCamera::trigger() {
  require_heartbeat();
  if (!device_.streaming()) throw std::logic_error("trigger() before start()");
  if (!outstanding_ && !device_.idle()) {
    ++statistics_.stale;
    suspect_ = true;
  }
  if (outstanding_ || suspect_) renew();
  triggered_ = steady_clock::now();
  outstanding_ = true;
  device_.trigger();
  if (steady_clock::now() - triggered_ > repeated_command) suspect_ = true;
}

void GigeCamera::require_whole(const ReceivedFrame& frame) {
  if (frame.problem.empty()) return;
  suspect_ = true;
  ++statistics_.damaged;
  fail_damaged(frame.problem);
}

void GigeCamera::fail_damaged(const std::string& problem) const {
  fail("a frame came damaged: " + problem +
           "; check cable and switch, and that net.core.rmem_max is at least 4 MiB",
       DeviceFault::damaged_frame);
}

void GigeCamera::require_in_sequence(const ReceivedFrame& frame) {
  const std::uint64_t last = std::exchange(last_id_, frame.id);
  if (follows(frame.id, last)) return;
  suspect_ = true;
  ++statistics_.stale;
  fail("frame id " + std::to_string(frame.id) + " came after " + std::to_string(last) +
           ": a frame was lost or repeated; the stream is begun anew",
       DeviceFault::damaged_frame);
}

void GigeCamera::require_size(const ReceivedFrame& frame) {
  const auto bytes =
      static_cast<std::size_t>(options_.width_px) * static_cast<std::size_t>(options_.height_px);
  if (frame.mono8 && frame.width_px == options_.width_px && frame.height_px == options_.height_px &&
      frame.pixels.size() == bytes)
    return;
  suspect_ = true;
  ++statistics_.wrong_size;
  fail("a frame of " + std::to_string(frame.width_px) + "x" + std::to_string(frame.height_px) + " (" +
           std::to_string(frame.pixels.size()) + " bytes) came, expected " +
           std::to_string(options_.width_px) + "x" + std::to_string(options_.height_px) +
           " Mono8; find out what changed its settings",
       DeviceFault::wrong_size);
}

std::optional<Frame> GigeCamera::grab(TimePoint deadline) {
  if (!outstanding_) throw std::logic_error("grab() without trigger()");
  std::optional<ReceivedFrame> received = device_.receive(deadline);
  const TimePoint now = steady_clock::now();
  if (!received) {
    require_heartbeat();
    ++statistics_.timeouts;
    return std::nullopt;
  }
  outstanding_ = false;
  require_whole(*received);
  require_in_sequence(*received);
  require_size(*received);
  ++statistics_.frames;
  Frame frame;
  frame.camera = options_.name;
  frame.sequence = ++sequence_;
  frame.device_time_ns = received->device_time_ns;
  frame.triggered = triggered_;
  frame.received = now;
  frame.width_px = options_.width_px;
  frame.height_px = options_.height_px;
  frame.stride_bytes = options_.width_px;
  frame.pixels = own_pixels(std::move(received->pixels));
  return frame;
}

void GigeCamera::check() {
  require_heartbeat();
  device_.require_control();
  if (!device_.streaming()) return;
  if (!outstanding_ && !device_.idle()) {
    ++statistics_.stale;
    suspect_ = true;
  }
  if (outstanding_ || suspect_) renew();
}

CameraStatistics GigeCamera::statistics() const { return statistics_ + device_.statistics(); }

}  // namespace zeropose
