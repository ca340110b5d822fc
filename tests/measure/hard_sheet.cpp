// corpus_sheet FILE.png: the corpus of hard windows for people to look at, one row per fault and strength.
// Green: found, red: wrong, yellow: missed.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "measure/marks.h"
#include "tests/measure/hard_rows.h"

namespace zeropose {
namespace {

using test::HardFrame;
using test::HardRow;

constexpr int columns = 8, gap = 4;

cv::Mat tile_of(const HardFrame& frame) {
  const ImageView view = frame.shot.view();
  cv::Mat tile(view.height_px, view.width_px, CV_8UC3);
  for (int v = 0; v < tile.rows; ++v) {
    for (int u = 0; u < tile.cols; ++u) {
      const auto grey = static_cast<std::uint8_t>(std::lround(view.grey_at(u, v)));
      tile.at<cv::Vec3b>(v, u) = {grey, grey, grey};
    }
  }
  const MarkFinding finding = find_marks(view, {&frame.search, 1}).front();
  const bool found = finding.status == MarkStatus::found;
  const bool wrong = found && (!frame.visible || (finding.u_px - frame.centre_px).norm() > 0.25);
  const cv::Scalar colour = wrong   ? cv::Scalar(0, 0, 255)
                            : found ? cv::Scalar(0, 200, 0)
                                    : cv::Scalar(0, 220, 255);
  cv::rectangle(tile, {0, 0, tile.cols, 4}, colour, cv::FILLED);
  cv::putText(tile, std::string(name_of(finding.status)), {4, tile.rows - 6}, cv::FONT_HERSHEY_PLAIN, 0.9,
              colour);
  return tile;
}

cv::Mat sheet() {
  const int step = 220 + gap, rows = static_cast<int>(test::hard_rows.size());
  cv::Mat whole(rows * step, columns * step, CV_8UC3, cv::Scalar(40, 40, 40));
  for (int r = 0; r < rows; ++r) {
    const HardRow& row = test::hard_rows[static_cast<std::size_t>(r)];
    for (int c = 0; c < std::min(columns, row.frames); ++c) {
      const cv::Mat tile = tile_of(hard_frame(row.given, static_cast<unsigned>(c)));
      tile.copyTo(whole(cv::Rect(c * step, r * step, tile.cols, tile.rows)));
    }
    cv::putText(whole, cv::format("%s %g", name_of(row.given.fault).c_str(), row.given.strength),
                {4, r * step + 20}, cv::FONT_HERSHEY_PLAIN, 1.1, {255, 120, 0});
  }
  return whole;
}

}  // namespace
}  // namespace zeropose

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: corpus_sheet FILE.png\n";
    return 2;
  }
  return cv::imwrite(arguments[1], zeropose::sheet()) ? 0 : 1;
}
