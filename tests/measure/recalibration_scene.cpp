#include "tests/measure/recalibration_scene.h"

#include <Eigen/LU>
#include <functional>
#include <map>

#include "tests/support/synthetic_camera.h"

namespace zeropose::test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double focal_px = 4200;
const Vector2d centre_px(383.5, 285.5);

Vector2d pixel(const CameraModel& model, const Pose& X_CoC, const Vector3d& p_Co) {
  return photograph(model, X_CoC, p_Co);
}

// d f / d x by central differences; every unknown has a step of its own.
MatrixXd jacobian(const std::function<VectorXd(const VectorXd&)>& f, const VectorXd& steps) {
  const Eigen::Index n = steps.size();
  MatrixXd J;
  for (Eigen::Index k = 0; k < n; ++k) {
    const VectorXd column =
        (f(VectorXd::Unit(n, k) * steps(k)) - f(-VectorXd::Unit(n, k) * steps(k))) / (2 * steps(k));
    if (k == 0) J.resize(column.size(), n);
    J.col(k) = column;
  }
  return J;
}

VectorXd pose_steps(std::size_t poses) {
  VectorXd steps(6 * static_cast<Eigen::Index>(poses));
  for (Eigen::Index i = 0; i < steps.size(); ++i) steps(i) = i % 6 < 3 ? 1e-2 : 1e-5;
  return steps;
}

// The inverse of J' J with columns scaled to length 1.
MatrixXd inverse_information(const MatrixXd& J, double sigma_px) {
  const VectorXd scale = J.colwise().norm().cwiseInverse().transpose();
  const MatrixXd S = J * scale.asDiagonal();
  return sigma_px * sigma_px * (scale.asDiagonal() * (S.transpose() * S).inverse() * scale.asDiagonal());
}

std::vector<std::string> groups_of(const std::vector<FixedPoint>& layout) {
  std::vector<std::string> names;
  for (const FixedPoint& point : layout)
    if (std::ranges::find(names, point.group) == names.end()) names.push_back(point.group);
  return names;
}

MatrixXd bound_of_groups(const KnockedCamera& camera, double sigma_px) {
  const std::vector<std::string> groups = groups_of(camera.layout);
  // A group moves about one of its points, that is as good as about its frame's origin.
  std::map<std::string, Vector3d> centres;
  for (const FixedPoint& point : camera.layout) centres.try_emplace(point.group, point.p_Co_mm);
  const auto pixels = [&](const VectorXd& x) {
    const Pose X_CoCn = moved(camera.X_CoCn, Vector6(x.head<6>()));
    VectorXd u(4 * static_cast<Eigen::Index>(camera.layout.size()));
    for (std::size_t i = 0; i < camera.layout.size(); ++i) {
      const FixedPoint& point = camera.layout[i];
      const auto g = std::ranges::find(groups, point.group) - groups.begin();
      const Vector6 delta = x.segment<6>(6 + 6 * g);
      const Vector3d c = centres.at(point.group);
      const Vector3d p_Co = c + delta.head<3>() + exp_so3(delta.tail<3>()) * (point.p_Co_mm - c);
      u.segment<2>(4 * static_cast<Eigen::Index>(i)) = pixel(camera.model, Pose::Identity(), p_Co);
      u.segment<2>(4 * static_cast<Eigen::Index>(i) + 2) = pixel(camera.model, X_CoCn, p_Co);
    }
    return u;
  };
  return inverse_information(jacobian(pixels, pose_steps(1 + groups.size())), sigma_px).topLeftCorner<6, 6>();
}

MatrixXd bound_of_known_points(const KnockedCamera& camera, double sigma_px) {
  const auto pixels = [&](const VectorXd& x) {
    VectorXd u(2 * static_cast<Eigen::Index>(camera.layout.size()));
    for (std::size_t i = 0; i < camera.layout.size(); ++i)
      u.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          pixel(camera.model, moved(camera.X_CoCn, Vector6(x)), camera.layout[i].p_Co_mm);
    return u;
  };
  return inverse_information(jacobian(pixels, pose_steps(1)), sigma_px);
}

// Unknown: the rotation and the true direction of every point.
MatrixXd bound_of_arbitrary_points(const KnockedCamera& camera, double sigma_px) {
  const auto count = static_cast<Eigen::Index>(camera.layout.size());
  const auto pixels = [&](const VectorXd& x) {
    Pose turned = camera.X_CoCn;
    turned.linear() = exp_so3(x.head<3>()) * camera.X_CoCn.linear();
    VectorXd u(4 * count);
    for (Eigen::Index i = 0; i < count; ++i) {
      Vector3d d = camera.layout[static_cast<std::size_t>(i)].p_Co_mm;
      d /= d.z();
      d.head<2>() += x.segment<2>(3 + 2 * i);
      u.segment<2>(4 * i) = pixel(camera.model, Pose::Identity(), d);
      u.segment<2>(4 * i + 2) = pixel(camera.model, turned, d);
    }
    return u;
  };
  return inverse_information(jacobian(pixels, VectorXd::Constant(3 + 2 * count, 1e-5)), sigma_px)
      .topLeftCorner<3, 3>();
}

}  // namespace

CameraModel long_lens(const Distortion& distortion) {
  return {768, 572, focal_px, focal_px, centre_px.x(), centre_px.y(), distortion};
}

Pose long_lens_pose() { return from_six_numbers({900, -1500, 2100, -130, 12, 35}); }

FixedPoint point_at(const std::string& name, double u_px, double v_px, double z_mm) {
  const Vector2d xy = (Vector2d(u_px, v_px) - centre_px) / focal_px;
  const Vector3d p_Co = z_mm * Vector3d(xy.x(), xy.y(), 1);
  return {name, "", p_Co, p_Co};
}

std::vector<FixedPoint> plate(const std::string& group, double u_px, double v_px, double z_mm, double size_mm,
                              double tilt_deg, int points) {
  const Pose X_CoG = [&] {
    Pose pose = from_six_numbers({0, 0, 0, tilt_deg, 0.7 * tilt_deg, 20});
    pose.translation() = point_at("", u_px, v_px, z_mm).p_Co_mm;
    return pose;
  }();
  std::vector<FixedPoint> corners;
  for (int k = 0; k < points; ++k) {
    const double angle = 2 * std::numbers::pi * k / points;
    // A radius that gives three points `size_mm` apart.
    const Vector3d p_G = size_mm / std::sqrt(3.0) * Vector3d(std::cos(angle), std::sin(angle), 0);
    corners.push_back({std::string("P").append(std::to_string(k + 1)), group, X_CoG * p_G, p_G});
  }
  return corners;
}

std::vector<RecalibrationPoint> KnockedCamera::see(RecalibrationMethod method, double sigma_px,
                                                   Random& random) const {
  std::vector<RecalibrationPoint> points;
  const auto noise = [&] {
    const double u = normal(random, 1) * sigma_px;
    return Vector2d(u, normal(random, 1) * sigma_px);
  };
  for (const FixedPoint& fixed : layout) {
    RecalibrationPoint& point = points.emplace_back();
    point.name = fixed.name;
    point.group = fixed.group;
    point.p_mm = method == RecalibrationMethod::known_points ? Vector3d(X_WCo * fixed.p_Co_mm) : fixed.p_G_mm;
    point.old_px = pixel(model, Pose::Identity(), fixed.p_Co_mm) + noise();
    point.new_px = pixel(model, X_CoCn, fixed.p_Co_mm) + noise();
  }
  return points;
}

RecalibrationResult recalibrated(const KnockedCamera& camera, RecalibrationMethod method,
                                 std::span<const RecalibrationPoint> points, double sigma_px) {
  RecalibrationProblem problem;
  problem.method = method;
  problem.model = camera.model;
  problem.X_WCo = camera.X_WCo;
  problem.points = points;
  problem.sigma_px = sigma_px;
  return recalibrate(problem);
}

RecalibrationResult KnockedCamera::recalibrated(RecalibrationMethod method, double sigma_px,
                                                Random& random) const {
  return test::recalibrated(*this, method, see(method, sigma_px, random), sigma_px);
}

MatrixXd cramer_rao(const KnockedCamera& camera, RecalibrationMethod method, double sigma_px) {
  if (method == RecalibrationMethod::known_points) return bound_of_known_points(camera, sigma_px);
  if (method == RecalibrationMethod::groups) return bound_of_groups(camera, sigma_px);
  return bound_of_arbitrary_points(camera, sigma_px);
}

std::vector<FixedPoint> three_points() {
  return {point_at("P1", 80, 60, 2100), point_at("P2", 690, 120, 2500), point_at("P3", 330, 510, 2900)};
}

std::vector<FixedPoint> six_points(double near_mm, double far_mm) {
  return {point_at("P1", 60, 60, near_mm),   point_at("P2", 700, 60, far_mm),
          point_at("P3", 700, 510, near_mm), point_at("P4", 60, 510, far_mm),
          point_at("P5", 380, 80, near_mm),  point_at("P6", 380, 490, far_mm)};
}

std::vector<FixedPoint> two_plates() {
  std::vector<FixedPoint> points = plate("near", 220, 240, 2050, 150, 30);
  for (const FixedPoint& point : plate("far", 540, 320, 2950, 220, -35)) points.push_back(point);
  return points;
}

}  // namespace zeropose::test
