// A camera or frame grabber of the kernel's video drivers (V4L2).
#pragma once

#include "drivers/v4l2_device.h"

namespace zeropose {

// How it is made sure that a frame was exposed after its trigger. V4L2 has no trigger: `software` stops the
// stream, which throws away every frame of before, and starts it; `free_run` lets it run and drops what was
// filled meanwhile. In both, only a frame whose exposure began after the trigger is handed out, by the
// driver's time of the frame. That is when the exposure began, or when the last byte was there, which is the
// exposure and one frame period later at most (the exposure counts as one period where it is not known). A
// device whose times are of another clock can only be stopped and started; its first frame is dropped then.
class V4l2Camera final : public Camera {
 public:
  explicit V4l2Camera(CameraOptions options);  // throws DeviceError

  void start() override;
  void trigger() override;
  // With `free_run` it may be called again without a trigger: the next frame. Otherwise precondition: a
  // trigger that has no answer yet (std::logic_error).
  std::optional<Frame> grab(TimePoint deadline) override;
  void stop() noexcept override;
  void check() override;
  CameraStatistics statistics() const override { return statistics_; }

 private:
  bool free_run() const { return options_.trigger == TriggerSource::free_run; }
  void drop_filled();
  bool answers(const FilledBuffer& buffer);
  void count_gap(const FilledBuffer& buffer);
  std::optional<FilledBuffer> next_answer(TimePoint deadline);
  void require_whole(const FilledBuffer& buffer);
  Frame frame_of(const FilledBuffer& buffer);
  void fill_pixels(const FilledBuffer& buffer, Frame& frame);
  void lend_or_copy(const FilledBuffer& buffer, Frame& frame);
  void decode(const FilledBuffer& buffer, Frame& frame);
  [[noreturn]] void fail_damaged(const std::string& problem);

  CameraOptions options_;
  V4l2Device device_;
  CameraStatistics statistics_;
  TimePoint triggered_{};
  bool outstanding_ = false;                  // a trigger was sent and nothing came
  bool first_ = false;                        // nothing came since the stream started
  std::optional<std::uint64_t> last_number_;  // the driver's, since the trigger
  std::uint64_t sequence_ = 0;
};

}  // namespace zeropose
