// Cameras that repeat a picture: the noise of a live one is never the same twice to the last bit.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/camera.h"

namespace zeropose {

class FrozenPictures {
 public:
  explicit FrozenPictures(std::size_t cameras) : last_(cameras) {}

  // Whether the camera's frame shows what its frame before showed, in all of every sixteenth row. A picture
  // that is black or white all over repeats by itself and is none. Remembers the frame.
  bool repeats(std::size_t camera, const Frame& frame);

 private:
  std::vector<std::vector<std::uint8_t>> last_;  // the rows looked at, one list per camera
};

}  // namespace zeropose
