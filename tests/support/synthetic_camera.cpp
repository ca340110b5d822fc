#include "tests/support/synthetic_camera.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

namespace zeropose::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The rd with rd / (1 + K rd^2) = ru, between 0 and where the left side stops growing.
double distorted_radius(double K, double ru) {
  double low = 0, high = K > 0 ? 1 / std::sqrt(K) : 10;
  if (K < 0) high = std::min(high, (1 - 1e-12) / std::sqrt(-K));
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (middle / (1 + K * middle * middle) < ru ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Vector2d photograph_division(const CameraModel& camera, double K, const Vector3d& p_C) {
  const Vector2d u = p_C.head<2>() / p_C.z();
  const double ru = u.norm();
  const Vector2d d = ru > 0 ? Vector2d(u * distorted_radius(K, ru) / ru) : u;
  return {camera.fx_px * d.x() + camera.cx_px, camera.fy_px * d.y() + camera.cy_px};
}

Vector2d photograph_brown(const CameraModel& camera, const BrownConrady& lens, const Vector3d& p_C) {
  const std::vector<cv::Point3d> points{{p_C.x(), p_C.y(), p_C.z()}};
  const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  const std::vector<double> coefficients{lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), K, coefficients, pixels);
  return {pixels[0].x, pixels[0].y};
}

}  // namespace

Vector2d photograph(const CameraModel& camera, const Pose& X_WC, const Vector3d& p_W_mm) {
  const Vector3d p_C = X_WC.inverse() * p_W_mm;
  if (!(p_C.z() > 0)) throw std::runtime_error("a point behind the synthetic camera");
  if (const auto* lens = std::get_if<Division>(&camera.distortion))
    return photograph_division(camera, lens->K, p_C);
  return photograph_brown(camera, std::get<BrownConrady>(camera.distortion), p_C);
}

std::vector<CalibrationPoint> photograph(const CameraModel& camera, const Pose& X_WC,
                                         const std::vector<Vector3d>& points_W_mm, double sigma_px,
                                         std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, 1);
  std::vector<CalibrationPoint> points(points_W_mm.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_W_mm = points_W_mm[i];
    points[i].u_px = photograph(camera, X_WC, points_W_mm[i]);
    points[i].u_px.x() += sigma_px * noise(random);
    points[i].u_px.y() += sigma_px * noise(random);
  }
  return points;
}

std::vector<Vector3d> grid(int n, int layers, double pitch_mm) {
  std::vector<Vector3d> points;
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        points.push_back(pitch_mm * Vector3d(i - 0.5 * (n - 1), j - 0.5 * (n - 1), k - 0.5 * (layers - 1)));
  return points;
}

CameraModel division_camera(double K) { return {768, 572, 2010, 1995, 401.5, 270.25, Division{K}}; }

CameraModel brown_camera() {
  return {768, 572, 2010, 1995, 401.5, 270.25, BrownConrady{-0.25, 0.3, 0.001, -0.0007, 0.1}};
}

Pose looking_at_origin(double distance_mm, double tilt_deg, double turn_deg) {
  Pose X_WC = from_six_numbers({0, 0, 0, 180 + tilt_deg, 0, turn_deg});
  X_WC.translation() = -distance_mm * X_WC.linear().col(2) + X_WC.linear() * Vector3d(3, -2, 0);
  return X_WC;
}

}  // namespace zeropose::test
