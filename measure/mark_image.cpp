#include "measure/mark_image.h"

#include "calib/eccentricity.h"

namespace zeropose {

bool has_image_offset(const Mark& mark) {
  if (!(mark.radius_mm > 0)) return false;
  const bool flat = mark.kind == MarkKind::disc || mark.kind == MarkKind::ring;
  return mark.kind == MarkKind::ball || (flat && !mark.normal_O.isZero());
}

Eigen::Vector2d image_offset(const CameraModel& camera, const Mark& mark, const Eigen::Vector3d& p_CQ_mm,
                             const Eigen::Vector3d& normal_C, double radius_share) {
  if (!has_image_offset(mark)) return Eigen::Vector2d::Zero();
  const double radius_mm = radius_share * mark.radius_mm;
  return mark.kind == MarkKind::ball ? ball_centre_offset(camera, p_CQ_mm, radius_mm)
                                     : ellipse_centre_offset(camera, p_CQ_mm, normal_C, radius_mm);
}

}  // namespace zeropose
