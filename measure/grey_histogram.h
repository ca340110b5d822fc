// How often each grey level occurs in a window: where the search may cut.
#pragma once

#include <array>

#include "measure/marks.h"
#include "measure/search_image.h"

namespace zeropose {

// Of at most some thousand pixels, which still hit every mark of the search.
class GreyHistogram {
 public:
  GreyHistogram() = default;
  GreyHistogram(const SearchImage& image, const MarkSearch& search);

  // Fewer pixels than a small mark has lie below, or above.
  int low() const;
  int high() const;
  // The level within room that cuts the fewest pixels: one through the noise of a surface falls apart.
  int quietest_near(double level, double room) const;

 private:
  int at(int grey) const { return grey < 0 || grey > 255 ? 0 : count_[static_cast<std::size_t>(grey)]; }

  std::array<int, 256> count_{};
  int few_ = 1;
};

}  // namespace zeropose
