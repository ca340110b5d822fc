// A frame as a PNG with what was looked for and found drawn in.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "measure/board.h"
#include "measure/body.h"
#include "measure/gap.h"
#include "measure/image.h"
#include "measure/line_array.h"
#include "measure/marks.h"

namespace zeropose {

struct MarkOverlay {
  std::string name;
  MarkSearch search;
  MarkFinding finding;
};

// PNG bytes: search areas in blue, found outlines and centres in green, what was not found in red with its
// reason.
std::vector<std::uint8_t> overlay_png(const ImageView& image, std::span<const MarkOverlay> marks);

struct GapOverlay {
  std::string name;
  GapSearch search;
  GapResult found;
};

// PNG bytes: the windows in blue, the edges of frame and pane in green as long as they are seen, with the gap
// in mm between them; what was not measured in red with its reason.
std::vector<std::uint8_t> overlay_png(const ImageView& image, std::span<const GapOverlay> gaps);

// PNG bytes: radial lines in green, those across in blue, crossings in orange; the reason in red where they
// are not in order, with all lines that were found.
std::vector<std::uint8_t> overlay_png(const ImageView& image, const LineArrayResult& lines);

// PNG bytes: the points of a board in green, each with row.column, joined in their order by blue lines (red
// from one row to the next), and the reason, if there is one.
std::vector<std::uint8_t> overlay_png(const ImageView& image, const BoardResult& board);

// PNG bytes: the marks of a calibration body in green, each with its name.
std::vector<std::uint8_t> overlay_png(const ImageView& image, const BodyResult& body,
                                      std::span<const BodyMark> marks);

}  // namespace zeropose
