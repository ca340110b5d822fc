// Marks that carry their number (AprilTag, ArUco), for calibration bodies and boards. Found by OpenCV, which
// the room does not see.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "measure/image.h"

namespace zeropose {

struct CodedMark {
  int id = -1;
  // Of the black square, seen from the front: top left, top right, bottom right, bottom left of the mark as
  // it is printed upright.
  std::array<Eigen::Vector2d, 4> corners_px{};
  Eigen::Vector2d centre_px =
      Eigen::Vector2d::Zero();  // where the diagonals meet: the square's middle, also tilted
};

// Names as "tag36h11", "tag25h9", "tag16h5", "4x4_50" .. "7x7_1000", "original".
bool is_code_dictionary(std::string_view name);

// By ascending number, then by place; a number may occur twice. Corners are where straight lines through the
// four edges meet. Empty for an unknown dictionary or an image below 16 x 16 px.
std::vector<CodedMark> coded_marks(const ImageView& image, std::string_view dictionary);

}  // namespace zeropose
