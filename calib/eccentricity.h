// Why a round mark is not seen where its centre is: the eccentricity of a disc's image (spec 50 M0).
#pragma once

#include <Eigen/Core>

#include "calib/camera_model.h"

namespace zeropose {

// Centre of the ellipse that the outline of a flat disc forms in the image, minus the projection of the
// disc's centre, px: add it to project(camera, p_CM) to get what find_marks() measures.
//   p_CM_mm    centre of the disc, camera frame
//   normal_C   of its plane, camera frame, any length and either sign; zero: unknown
//   radius_mm  0: unknown
// Zero when normal or radius is unknown, and when the disc has no image as a whole (project() says so for its
// centre, or it reaches behind the camera).
//
// The perspective part is exact: the outline is the conic with the dual r^2 (I - n n^T) - p p^T. The lens
// bends that ellipse; its best fitting ellipse (least squares of distances along the normals, weights by arc
// length, as for an edge of constant contrast) follows from the second derivative of the lens at the centre.
// Neglected: fourth order of the lens across the disc, below 1e-4 px for discs of 20 mm radius at 3 m and |K|
// up to 1.1.
Eigen::Vector2d ellipse_centre_offset(const CameraModel& camera, const Eigen::Vector3d& p_CM_mm,
                                      const Eigen::Vector3d& normal_C, double radius_mm);

// The same for a ball: centre of its outline's image minus the projection of its centre, px. The outline is
// the cone that touches it, with the dual r^2 I - p p^T. Zero when the radius is 0, or the ball has no image
// as a whole.
Eigen::Vector2d ball_centre_offset(const CameraModel& camera, const Eigen::Vector3d& p_CM_mm,
                                   double radius_mm);

}  // namespace zeropose
