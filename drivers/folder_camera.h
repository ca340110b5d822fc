// Pictures of a folder as a camera: for replay and commissioning.
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/camera.h"

namespace zeropose {

// Software trigger: each trigger takes the next picture, at once. Free run at frame_rate_hz: the clock since
// start() says whose turn it is, as with a live camera that nobody waits for; a frame is the first whose turn
// comes after the trigger. The folder is read again at each pass, and after the last picture also without
// loop: what has been added by then is taken.
//
// A picture that cannot be read is damaged_frame, one of another size wrong_size; both name the file, and the
// next is taken after it. So is a folder whose pictures are used up, which must not begin anew:
// damaged_frame.
class FolderCamera final : public Camera {
 public:
  explicit FolderCamera(CameraOptions options);
  void start() override;  // missing: no such folder, or no pictures in it
  void trigger() override;
  std::optional<Frame> grab(TimePoint deadline) override;
  void stop() noexcept override {}
  void check() override;
  CameraStatistics statistics() const override { return statistics_; }

 private:
  std::optional<TimePoint> next_turn(TimePoint deadline);
  const std::filesystem::path& picture(std::uint64_t turn);
  void begin_pass(std::uint64_t turn);
  Frame load(const std::filesystem::path& path);
  [[noreturn]] void refuse(DeviceFault fault, const std::string& what);

  const CameraOptions options_;
  std::vector<std::filesystem::path> pictures_;  // of the pass under way
  std::uint64_t first_turn_ = 0;                 // of the pass
  std::uint64_t turn_ = 0;                       // of the next frame, counted from start()
  TimePoint started_, triggered_;
  CameraStatistics statistics_;
};

}  // namespace zeropose
