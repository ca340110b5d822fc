#include "measure/verification.h"

#include <cmath>

#include "calib/words.h"

namespace zeropose {

Verification verify(const Pose& X_WO, std::span<const VerificationPoint> points, double max_mm) {
  Verification result;
  double sum = 0;
  std::size_t beyond = 0;
  for (const VerificationPoint& point : points) {
    VerificationError& error = result.errors.emplace_back();
    error.error_W_mm = point.measured_W_mm - X_WO * point.p_O_mm;
    error.compensated_W_mm = error.error_W_mm - X_WO.linear() * point.compensation_O_mm;
    const double length = error.error_W_mm.norm();
    if (length > result.worst_mm) result.worst_mm = length, result.worst = result.errors.size() - 1;
    beyond += length > max_mm ? 1 : 0;
    sum += length * length / double(points.size());
    result.mean_W_mm += error.error_W_mm / double(points.size());
  }
  result.rms_mm = std::sqrt(sum);
  result.ok = beyond == 0;
  if (!result.ok)
    result.reason = number(beyond) + " of " + number(points.size()) + " points are farther than " +
                    number(max_mm) + " mm from where they are expected, the worst is " +
                    points[result.worst].name + " with " + number(result.worst_mm, 3) + " mm";
  return result;
}

}  // namespace zeropose
