// A GigE Vision camera with software trigger. One thread per camera: a call into a device that is gone blocks
// for seconds (measured: a read 4.5 s, a trigger 2.5 s, the destructor 10 s).
#pragma once

#include "drivers/camera.h"
#include "drivers/gige_device.h"

namespace zeropose {

// How it is made sure that a frame was exposed after its trigger. The camera exposes only when triggered, so
// a frame is too old only if it answers an earlier trigger. As long as every trigger was answered by exactly
// one whole frame, with consecutive frame ids and nothing else queued or under way, the next frame can only
// be the answer to the next trigger. As soon as that is not certain (a deadline passed, a frame came damaged,
// was not asked for or skipped an id, a trigger command may have been repeated on the way), the whole stream
// is thrown away before the next trigger: acquisition is stopped, and a new stream listens on a new UDP port,
// to which no frame of before was ever sent.
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
  void renew();
  void require_heartbeat() const;
  void require_whole(const ReceivedFrame& frame);
  void require_in_sequence(const ReceivedFrame& frame);
  void require_size(const ReceivedFrame& frame);
  [[noreturn]] void fail_damaged(const std::string& problem) const;
  [[noreturn]] void fail(const std::string& what, DeviceFault fault) const;

  CameraOptions options_;
  GigeDevice device_;
  CameraStatistics statistics_;
  TimePoint triggered_{};
  bool outstanding_ = false;  // a trigger was sent and nothing came
  bool suspect_ = false;      // a frame that answers no trigger, or an old one, may come
  std::uint64_t sequence_ = 0;
  std::uint64_t last_id_ = 0;  // of the last frame of this stream
};

}  // namespace zeropose
