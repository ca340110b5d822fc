#include "calib/lens_conversion.h"

#include <Eigen/QR>
#include <cmath>
#include <vector>

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

// A pixel and the direction in which the camera sees it.
struct Sample {
  Vector2d u_px;
  Eigen::Vector3d direction;
};

// Pixels on a grid over the whole chip with its borders; empty when one of them has no direction.
std::vector<Sample> samples_of(const CameraModel& camera, int columns, int rows) {
  std::vector<Sample> samples;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Vector2d u_px(-0.5 + camera.width_px * (column / (columns - 1.0)),
                          -0.5 + camera.height_px * (row / (rows - 1.0)));
      const auto direction = ray(camera, u_px);
      if (!direction) return {};
      samples.push_back({u_px, *direction});
    }
  return samples;
}

// The distances between the pixels of `camera` and those of `converted` for the same directions.
LensConversion compared(const CameraModel& camera, const CameraModel& converted) {
  LensConversion conversion;
  const auto samples = samples_of(camera, 65, 49);  // finer than the grid of the fit
  double sum = 0;
  for (const Sample& sample : samples) {
    const auto u_px = project(converted, sample.direction);
    if (!u_px || !ray(converted, *u_px)) return {};
    const double distance_px = (*u_px - sample.u_px).norm();
    sum += distance_px * distance_px;
    if (distance_px <= conversion.worst_px) continue;
    conversion.worst_px = distance_px;
    conversion.worst_at_px = sample.u_px;
  }
  if (samples.empty()) return {};
  conversion.rms_px = std::sqrt(sum / static_cast<double>(samples.size()));
  conversion.model = converted;
  return conversion;
}

constexpr int fit_columns = 33, fit_rows = 25;

}  // namespace

// Linear in k1 k2 k3: focal * (distorted - undistorted) = focal * undistorted * (r2, r4, r6).
LensConversion to_brown(const CameraModel& camera) {
  if (std::holds_alternative<BrownConrady>(camera.distortion)) return compared(camera, camera);
  const auto samples = samples_of(camera, fit_columns, fit_rows);
  if (samples.empty()) return {};
  const Vector2d focal(camera.fx_px, camera.fy_px), origin(camera.cx_px, camera.cy_px);
  MatrixXd A(2 * static_cast<Eigen::Index>(samples.size()), 3);
  VectorXd b(A.rows());
  for (Eigen::Index i = 0; i < A.rows() / 2; ++i) {
    const Sample& sample = samples[static_cast<std::size_t>(i)];
    const Vector2d u = sample.direction.head<2>(), u_px = focal.cwiseProduct(u);
    const double r2 = u.squaredNorm();
    A.middleRows<2>(2 * i) = u_px * Eigen::RowVector3d(r2, r2 * r2, r2 * r2 * r2);
    b.segment<2>(2 * i) = sample.u_px - origin - u_px;
  }
  // Columns of equal length: r6 is tiny where r is.
  const VectorXd scale = A.colwise().norm().transpose().cwiseMax(1e-300);
  const VectorXd k =
      (A * scale.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(b).cwiseQuotient(scale);
  CameraModel converted = camera;
  converted.distortion = BrownConrady{k(0), k(1), 0, 0, k(2)};
  return compared(camera, converted);
}

// Gauss-Newton on the pixels of the directions. dp/dK by a central difference: the model is smooth in K.
LensConversion to_division(const CameraModel& camera) {
  if (std::holds_alternative<Division>(camera.distortion)) return compared(camera, camera);
  const auto samples = samples_of(camera, fit_columns, fit_rows);
  if (samples.empty()) return {};
  CameraModel converted = camera;
  double K = 0;
  for (int step = 0; step < 30; ++step) {
    constexpr double h = 1e-6;
    double jj = 0, jr = 0;
    for (const Sample& sample : samples) {
      const auto at = [&](double value) {
        converted.distortion = Division{value};
        return project(converted, sample.direction);
      };
      const auto here = at(K), more = at(K + h), less = at(K - h);
      if (!here || !more || !less) return {};
      const Vector2d J = (*more - *less) / (2 * h);
      jj += J.squaredNorm();
      jr += J.dot(sample.u_px - *here);
    }
    if (!(jj > 0)) break;
    K += jr / jj;
    if (std::abs(jr / jj) < 1e-14 * (1 + std::abs(K))) break;
  }
  converted.distortion = Division{K};
  return compared(camera, converted);
}

}  // namespace zeropose
