// V4L2 cameras for a simulated cell: output devices of the kernel's vivid show pictures from a callback to
// the capture devices behind them.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "sim/v4l2_output.h"

namespace zeropose {

class V4l2Server {
 public:
  // Fills the grey levels of a picture from pixel `first` on, row by row; from one thread for each camera,
  // again and again.
  using Draw = std::function<void(std::size_t camera, std::span<std::uint8_t> pixels, std::size_t first)>;

  struct Served {
    std::string capture;  // device file; its output is that of the same bus
    int width_px = 0, height_px = 0;
  };

  // Throws std::runtime_error: a device has no output beside it, or is none.
  V4l2Server(const std::vector<Served>& cameras, Draw draw);
  ~V4l2Server();
  V4l2Server(const V4l2Server&) = delete;
  V4l2Server& operator=(const V4l2Server&) = delete;

  // Returns when every camera shows what `draw` gives now. Throws std::runtime_error when one does not.
  void picture_changed();

 private:
  struct Slot;
  void keep_showing(Slot& slot, const std::stop_token& stop);

  const Draw draw_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::uint64_t generation_ = 0;  // of the pictures
  std::vector<std::unique_ptr<Slot>> slots_;
};

}  // namespace zeropose
