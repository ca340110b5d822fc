// What is held before a camera while it is calibrated: a ball, or a board or body with round marks.
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "sim/canvas.h"

namespace zeropose {

struct CarriedBall {
  Eigen::Vector3d p_W_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0, grey = 0;
};

// A round mark of a flat side of B, printed where it says, be it half a millimetre before the side.
struct PrintedMark {
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
  Eigen::Vector3d normal_B = -Eigen::Vector3d::UnitZ();  // unit, towards whoever sees it
};

// Marks of one normal lie on one side, which reaches a little beyond them.
struct CarriedBody {
  Pose X_WB = Pose::Identity();
  std::vector<PrintedMark> marks;
};

// The pane before a window opening (sim/gap_object.h); the object's look paints it.
struct CarriedPane {
  Pose X_WT = Pose::Identity();
};

using Carried = std::variant<CarriedBall, CarriedBody, CarriedPane>;

// Asymmetric circles as in OpenCV: ((2 col + row % 2), row) times the pitch, seen from negative z.
std::vector<PrintedMark> printed_board(int rows, int cols, double pitch_mm, double diameter_mm);

// Sides that are seen from behind are dark.
void paint_carried(Canvas& canvas, const Carried& carried, const Pose& X_CW);

}  // namespace zeropose
