#include "drivers/gige_camera.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "drivers/gige_pixels.h"

namespace zeropose {
namespace {

using std::chrono::steady_clock;

// An acknowledge later than this may be that of a repeated command: the library sends anew after 500 ms.
constexpr std::chrono::milliseconds repeated_command{400};

constexpr std::chrono::seconds health_period{10};

constexpr int trials = 8;  // more than there are buffers: all may be full of frames that nobody asked for
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
  using Microseconds = std::chrono::duration<double, std::micro>;
  const auto nanoseconds = [](double us) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Microseconds(us));
  };
  exposure_us_ = options_.exposure_us || !triggered_by_us() ? device_.exposure_us() : 0;
  order_.reset();
  if (!triggered_by_us())
    order_.emplace(nanoseconds(exposure_us_),
                   nanoseconds(options_.trigger == TriggerSource::free_run ? device_.frame_period_us() : 0));
  device_.open_stream();
  prove_stream();
  outstanding_ = suspect_ = false;
}

// The first frame of a stream is a trial: the library enlarges the socket's buffer when it comes, mostly too
// late for it, and a trigger that the device kept from before the stream is used up by it. Nobody can ask for
// an electric signal: there the first frame may come damaged.
void GigeCamera::prove_stream() {
  if (options_.trigger == TriggerSource::software) prove_trigger();
  if (options_.trigger == TriggerSource::free_run) prove_running();
}

void GigeCamera::fail_silent() {
  device_.close_stream();
  fail("answers, but its frames do not come; check firewall and network", DeviceFault::missing);
}

void GigeCamera::prove_trigger() {
  std::string problem;
  for (int attempt = 0; attempt < trials; ++attempt) {
    device_.trigger();
    const auto frame = device_.receive(steady_clock::now() + trial_time);
    if (!frame) fail_silent();
    last_id_ = frame->id;
    problem = frame->problem;
    if (problem.empty() && device_.idle()) return;
  }
  device_.close_stream();
  if (problem.empty())
    fail("sends frames that nobody asked for; find out what changed its trigger", DeviceFault::missing);
  ++statistics_.damaged;
  fail_damaged(problem);
}

void GigeCamera::prove_running() {
  const auto period = std::chrono::duration<double, std::micro>(device_.frame_period_us());
  const TimePoint end =
      steady_clock::now() + trial_time + trials * std::chrono::ceil<std::chrono::milliseconds>(period);
  std::string problem;
  while (const auto frame = device_.receive(end)) {
    order_->note({frame->first_packet, frame->device_time_ns});
    problem = frame->problem;
    if (problem.empty()) return;
  }
  if (problem.empty()) fail_silent();
  device_.close_stream();
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
  if (!triggered_by_us()) {
    triggered_ = steady_clock::now();
    outstanding_ = true;
    return;
  }
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
  if (frame.pixels) return;
  suspect_ = true;
  ++statistics_.wrong_size;
  char format[11];
  std::snprintf(format, sizeof format, "0x%08x", frame.pixel_format);
  fail("a frame of " + std::to_string(frame.width_px) + "x" + std::to_string(frame.height_px) + " (" +
           std::to_string(frame.bytes) + " bytes of pixel format " + format + ") came, expected " +
           std::to_string(options_.width_px) + "x" + std::to_string(options_.height_px) + " " +
           gige_pixels(options_).name + "; find out what changed its settings",
       DeviceFault::wrong_size);
}

// What the camera sends with the frame, where it does.
void GigeCamera::require_exposure(const ReceivedFrame& frame) {
  if (!options_.exposure_us || !frame.chunk_exposure_us) return;
  if (std::abs(*frame.chunk_exposure_us - exposure_us_) <= 0.02 * exposure_us_) return;
  ++statistics_.damaged;
  fail("a frame was exposed for " + std::to_string(*frame.chunk_exposure_us) + " us instead of " +
           std::to_string(exposure_us_) + "; find out what changed its settings",
       DeviceFault::damaged_frame);
}

std::optional<Frame> GigeCamera::grab(TimePoint deadline) {
  if (!outstanding_) throw std::logic_error("grab() without trigger()");
  if (!triggered_by_us()) return grab_running(deadline);
  std::optional<ReceivedFrame> received = device_.receive(deadline);
  if (!received) {
    require_heartbeat();
    ++statistics_.timeouts;
    return std::nullopt;
  }
  outstanding_ = false;
  require_whole(*received);
  require_in_sequence(*received);
  return hand_out(std::move(*received));
}

// A damaged frame of a camera that runs freely is followed by another one soon.
std::optional<ReceivedFrame> GigeCamera::receive_begun_after(TimePoint request, TimePoint deadline) {
  std::string problem;
  while (auto received = device_.receive(deadline)) {
    const FrameArrival arrival{received->first_packet, received->device_time_ns};
    order_->note(arrival);
    const bool wanted = order_->begun_after(arrival, request);
    if (wanted && received->problem.empty()) return received;
    if (received->problem.empty()) {
      ++statistics_.skipped;
      continue;
    }
    ++statistics_.damaged;
    problem = received->problem;
    if (wanted && options_.trigger == TriggerSource::line) break;
  }
  require_heartbeat();
  if (!problem.empty()) fail_damaged(problem);
  return std::nullopt;
}

std::optional<Frame> GigeCamera::grab_running(TimePoint deadline) {
  outstanding_ = false;
  std::optional<ReceivedFrame> received = receive_begun_after(triggered_, deadline);
  if (!received) {
    ++statistics_.timeouts;
    return std::nullopt;
  }
  last_id_ = received->id;
  return hand_out(std::move(*received));
}

Frame GigeCamera::hand_out(ReceivedFrame received) {
  require_size(received);
  require_exposure(received);
  ++statistics_.frames;
  const GigePixels& format = gige_pixels(options_);
  Frame frame;
  frame.camera = options_.name;
  frame.sequence = ++sequence_;
  frame.device_time_ns = received.device_time_ns;
  frame.network_time = statistics_.ptp_state == "Slave" || statistics_.ptp_state == "Master";
  frame.triggered = triggered_;
  frame.received = received.last_packet;
  frame.width_px = options_.width_px;
  frame.height_px = options_.height_px;
  frame.white = format.white;
  frame.stride_bytes = static_cast<std::ptrdiff_t>(frame.row_bytes());
  frame.pixels = std::move(received.pixels);
  return frame;
}

void GigeCamera::look_at_health() {
  if (steady_clock::now() < next_health_) return;
  next_health_ = steady_clock::now() + health_period;
  GigeHealth health = device_.health();
  statistics_.temperature_c = health.temperature_c;
  statistics_.ptp_state = std::move(health.ptp_state);
}

void GigeCamera::check() {
  require_heartbeat();
  device_.require_control();
  look_at_health();
  if (!device_.streaming() || !triggered_by_us()) return;
  if (!outstanding_ && !device_.idle()) {
    ++statistics_.stale;
    suspect_ = true;
  }
  if (outstanding_ || suspect_) renew();
}

CameraStatistics GigeCamera::statistics() const { return statistics_ + device_.statistics(); }

}  // namespace zeropose
