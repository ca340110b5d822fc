// Where the image of a mark is found beside the projection of its centre.
#pragma once

#include <Eigen/Core>

#include "calib/camera_model.h"
#include "measure/job.h"

namespace zeropose {

// Does the mark's size move its image? Needs its radius, and its normal unless it is a ball.
bool has_image_offset(const Mark& mark);

// What find_marks() measures minus the projection of the mark's centre, px (calib/eccentricity.h).
//   p_CQ_mm       the mark's centre, camera frame
//   normal_C      of its plane, camera frame
//   radius_share  of the circle whose centre was measured: MarkFinding::radius_share
Eigen::Vector2d image_offset(const CameraModel& camera, const Mark& mark, const Eigen::Vector3d& p_CQ_mm,
                             const Eigen::Vector3d& normal_C, double radius_share);

}  // namespace zeropose
