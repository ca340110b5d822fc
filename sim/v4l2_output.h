// A V4L2 output device that shows pictures of ours to a capture device behind it: those of the kernel's
// vivid, with its loop.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace zeropose {

struct ShownPicture {
  std::string output, capture;  // device files
  int width_px = 0, height_px = 0;
  std::string pixels = "GREY";  // four letters, as V4L2 names the format
  int pixel_bytes = 1;
};

// The output device on the same bus as a capture device. Throws std::runtime_error: there is none.
std::string output_beside(const std::string& capture);

class V4l2Output {
 public:
  // Sets both ends to the smallest digital signal that holds the picture, then shows black. The capture end
  // still needs its control "loop video". Throws std::runtime_error.
  explicit V4l2Output(const ShownPicture& picture);
  ~V4l2Output();
  V4l2Output(const V4l2Output&) = delete;
  V4l2Output& operator=(const V4l2Output&) = delete;

  // What is shown at the moment: a change of it is seen by every frame that is exposed afterwards.
  std::span<std::uint8_t> shown() { return buffers_[active_]; }
  // Shows another picture as a whole; returns when it is there, after a few frames. Throws
  // std::runtime_error.
  void show(std::span<const std::uint8_t> pixels);

 private:
  void set_format(const ShownPicture& picture);
  void map_buffers();
  void queue(std::size_t index);
  void take_back();

  std::string device_;
  int fd_ = -1;
  std::size_t bytes_ = 0;
  std::size_t active_ = 0;
  std::vector<std::span<std::uint8_t>> buffers_;
};

}  // namespace zeropose
