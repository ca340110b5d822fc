#include "daemon/frozen_pictures.h"

#include <algorithm>

namespace zeropose {
namespace {

constexpr int row_step = 16;  // the rows between cost time and tell nothing new

std::vector<std::uint8_t> rows_of(const Frame& frame) {
  std::vector<std::uint8_t> rows;
  for (int v = 0; v < frame.height_px; v += row_step) {
    const auto row = frame.row(v);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  return rows;
}

bool shows_something(const std::vector<std::uint8_t>& rows) {
  constexpr std::uint8_t black = 12, white = 254;
  return std::any_of(rows.begin(), rows.end(),
                     [](std::uint8_t grey) { return grey > black && grey < white; });
}

}  // namespace

bool FrozenPictures::repeats(std::size_t camera, const Frame& frame) {
  std::vector<std::uint8_t> rows = rows_of(frame);
  const bool repeated = rows == last_[camera] && shows_something(rows);
  last_[camera] = std::move(rows);
  return repeated;
}

}  // namespace zeropose
