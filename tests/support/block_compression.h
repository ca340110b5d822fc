// What compressed pictures lose: blocks of 8 x 8, cosine transform, rounding in steps.
#pragma once

#include <cstdint>
#include <vector>

namespace zeropose::test {

// There and back again, as JPEG does it to a grey picture (ITU-T T.81: A.3.3 and table K.1; quality as in
// libjpeg, 1..100). Blocks that stick out are filled with their last row and column.
void compress_and_expand(std::vector<std::uint8_t>& grey, int width_px, int height_px, int quality);

}  // namespace zeropose::test
