// A GigE Vision camera. One thread per camera: a call into a device that is gone blocks
// for seconds (measured: a read 4.5 s, a trigger 2.5 s, the destructor 10 s).
#pragma once

#include "drivers/camera.h"
#include "drivers/exposure_order.h"
#include "drivers/gige_device.h"

namespace zeropose {

// How it is made sure that a frame was exposed after its trigger. With the software trigger the camera
// exposes only when triggered, so a frame is too old only if it answers an earlier trigger. As long as every
// trigger was answered by exactly one whole frame, with consecutive frame ids and nothing else queued or
// under way, the next frame can only be the answer to the next trigger. As soon as that is not certain (a
// deadline passed, a frame came damaged, was not asked for or skipped an id, a trigger command may have been
// repeated on the way), the whole stream is thrown away before the next trigger: acquisition is stopped, and
// a new stream listens on a new UDP port, to which no frame of before was ever sent. A camera that runs
// freely or waits for an electric signal sends frames that nobody asked for: there trigger() only notes the
// time, and grab() passes over those that may have begun before it (ExposureOrder); they are counted as
// skipped. Those that come while nobody asks are filled anew by themselves, uncounted. An electric signal
// must come at least ExposureOrder::margin after the request, and the next one not before the frame is sent.
class GigeCamera final : public Camera {
 public:
  // 0.05..0.2 s, and 0.3 s for start(); 1 s for a dead address. Throws DeviceError.
  explicit GigeCamera(CameraOptions options);

  void start() override;
  void trigger() override;
  // Precondition: a trigger that has no answer yet (std::logic_error).
  std::optional<Frame> grab(TimePoint deadline) override;
  void stop() noexcept override;
  void check() override;
  CameraStatistics statistics() const override;

 private:
  void prove_stream();
  void prove_trigger();
  void prove_running();
  [[noreturn]] void fail_silent();
  void renew();
  void require_heartbeat() const;
  void require_whole(const ReceivedFrame& frame);
  void require_in_sequence(const ReceivedFrame& frame);
  void require_exposure(const ReceivedFrame& frame);
  bool triggered_by_us() const { return options_.trigger == TriggerSource::software; }
  std::optional<ReceivedFrame> receive_begun_after(TimePoint request, TimePoint deadline);
  std::optional<Frame> grab_running(TimePoint deadline);
  Frame hand_out(ReceivedFrame received);
  void look_at_health();
  void require_size(const ReceivedFrame& frame);
  [[noreturn]] void fail_damaged(const std::string& problem) const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault) const;

  CameraOptions options_;
  GigeDevice device_;
  double exposure_us_ = 0;              // as read back
  std::optional<ExposureOrder> order_;  // of a camera that is not triggered by us
  TimePoint next_health_ = TimePoint::min();
  CameraStatistics statistics_;
  TimePoint triggered_{};
  bool outstanding_ = false;  // a trigger was sent and nothing came
  bool suspect_ = false;      // a frame that answers no trigger, or an old one, may come
  std::uint64_t sequence_ = 0;
  std::uint64_t last_id_ = 0;  // of the last frame of this stream
};

}  // namespace zeropose
