// Pictures of calibration boards with known truth, made without any code or model of the estimators: every
// pixel looks along its rays at the plane of the board; areas by samples finer than the pixels, lens blur as
// a sum.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/camera_model.h"
#include "measure/board.h"
#include "tests/support/mark_picture.h"

namespace zeropose::test {

struct BoardScene {
  CameraModel camera{768, 572, 1200, 1200, 380, 290, Division{0}};
  Pose X_CB = Pose::Identity();
  BoardKind kind = BoardKind::circles;
  int rows = 11, cols = 11;
  double pitch_mm = 10, diameter_mm = 5;
  double margin_mm = 10;                                 // of the board's surface beyond the outermost points
  double surface = 180, print = 50, surroundings = 110;  // grey levels
  double blur_sigma_px = 0.7;
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();  // relative, about the picture's middle

  std::vector<BoardIndex> unprinted;
  struct Spot {  // on the plane, also beside the board
    Eigen::Vector2d centre_mm;
    double diameter_mm;
  };
  std::vector<Spot> spots;
  struct Cover {  // in front of everything: convex, corners in pixels, clockwise on the screen
    std::vector<Eigen::Vector2d> corners_px;
    double grey = 90;
  };
  std::vector<Cover> covers;

  Eigen::Vector3d p_B_mm(const BoardIndex& at) const;
  // Where the circle's centre or the corner is seen; no value behind the camera.
  Eigen::Vector2d centre_px(const BoardIndex& at) const;
  // Where the centre of the circle's outline is seen (the same for a chessboard).
  Eigen::Vector2d seen_px(const BoardIndex& at) const;
  BoardProblem problem() const;
};

// The board's middle on the optical axis at a distance, turned by roll in the image and then tilted about an
// axis that lies at an angle to the image's rows.
Pose board_pose(const BoardScene& scene, double distance_mm, double tilt_rad, double axis_rad,
                double roll_rad);

// Linear light that falls from the picture's one corner to the opposite one by this ratio.
Eigen::Vector2d shading_of_ratio(const CameraModel& camera, double ratio);

Picture paint(const BoardScene& scene);

}  // namespace zeropose::test
