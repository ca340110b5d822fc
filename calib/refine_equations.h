// The normal equations of a calibration from one view. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

// Points column by column, so that the compiler computes several at a time; filled up to whole blocks with
// repetitions of the last point that have no weight.
struct PointColumns {
  Eigen::ArrayXd x_mm, y_mm, z_mm;  // p_W
  Eigen::ArrayXd u_px, v_px;        // found (a disc's less its eccentricity)
  Eigen::ArrayXd wuu, wuv, wvv;     // information of the pixel, px^-2
  bool correlated = false;          // some wuv is not 0
};
PointColumns columns_of(std::span<const CalibrationPoint> points);

// Up to 15 parameters, without a heap.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 15, 15>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 15, 1>;

// For all parameters of the model in the order fx fy cx cy, the lens' (K or k1 k2 p1 p2 k3), then the
// pose's delta of moved(X_WC): translation mm, rotation rad.
struct ViewEquations {
  bool visible = false;  // every point has an image, all numbers are finite
  double cost = 0;       // sum of squared residuals
  SmallMatrix N;         // J' J, both triangles
  SmallVector g;         // J' r, r = found - predicted
};
// What is minimised. robust > 0: Cauchy's loss robust^2 log(1 + r^2 / robust^2) of every point's whitened
// residual r, with the weights of iteratively reweighted least squares.
struct Objective {
  Residual residual = Residual::reprojection;
  double robust = 0;
};
ViewEquations normal_equations(const PointColumns& points, const CameraModel& camera, const Pose& X_WC,
                               const Objective& objective);

// Number of the lens' parameters: 1 or 5.
Eigen::Index lens_size(const CameraModel& camera);

}  // namespace zeropose
