#include "measure/wheel_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

constexpr double false_alarm = 1e-3;
constexpr int most_steps = 20;
constexpr double settled_mm = 1e-7;
constexpr double least_determined = 0.05;  // smallest over largest eigenvalue of the points' spread

bool makes_sense(const WheelPlaneProblem& problem) {
  const auto point = [](const WheelPlanePoint& p) {
    return p.p_W_mm.allFinite() && p.sigma_mm > 0 && p.sigma_radius_mm > 0 && std::isfinite(p.sigma_mm) &&
           std::isfinite(p.sigma_radius_mm);
  };
  return problem.points.size() >= 4 && std::ranges::all_of(problem.points, point) &&
         problem.towards_W.allFinite() && problem.towards_W.norm() > 0 && problem.unevenness_mm >= 0 &&
         problem.out_of_round_mm >= 0;
}

// y = J x with independent errors of y.
struct Fit {
  Eigen::Vector3d x;
  Eigen::Matrix3d gain;        // inverse of J^T W J
  Eigen::VectorXd residuals;   // y - J x
  Eigen::VectorXd normalised;  // by the residual's own sigma
};

Fit fit(const Eigen::MatrixX3d& J, const Eigen::VectorXd& y, const Eigen::VectorXd& sigma) {
  const Eigen::VectorXd w = sigma.array().square().inverse();
  const Eigen::Matrix3d normal = J.transpose() * w.asDiagonal() * J;
  Fit fit;
  fit.gain = normal.inverse();
  fit.x = fit.gain * (J.transpose() * (w.array() * y.array()).matrix());
  fit.residuals = y - J * fit.x;
  const Eigen::VectorXd own = sigma.array().square() - (J * fit.gain).cwiseProduct(J).rowwise().sum().array();
  fit.normalised = fit.residuals.array() / own.array().max(1e-12).sqrt();
  return fit;
}

// The plane first, then the circle in it.
class WheelFit {
 public:
  explicit WheelFit(const WheelPlaneProblem& problem) : problem_(problem), n_(std::ssize(problem.points)) {}

  bool determined() {
    for (const WheelPlanePoint& point : problem_.points) middle_ += point.p_W_mm / static_cast<double>(n_);
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const WheelPlanePoint& point : problem_.points)
      spread += (point.p_W_mm - middle_) * (point.p_W_mm - middle_).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
    axis_ = eigen.eigenvectors().col(0);
    if (axis_.dot(problem_.towards_W) < 0) axis_ = -axis_;
    return eigen.eigenvalues()[1] > least_determined * eigen.eigenvalues()[2];
  }

  // Turns the axis until the heights do not ask for more.
  void fit_plane() {
    for (int step = 0; step < most_steps; ++step) {
      const Vector3d a = axis_.unitOrthogonal(), b = axis_.cross(a);
      Eigen::MatrixX3d J(n_, 3);
      Eigen::VectorXd y(n_), sigma(n_);
      each([&](Eigen::Index i, const WheelPlanePoint& point) {
        const Vector3d off = point.p_W_mm - middle_;
        J.row(i) << off.dot(a), off.dot(b), 1;
        y[i] = off.dot(axis_);
        sigma[i] = std::hypot(point.sigma_mm, problem_.unevenness_mm);
      });
      plane_ = fit(J, y, sigma);
      middle_ += plane_.x[2] * axis_;
      axis_ = (axis_ - plane_.x[0] * a - plane_.x[1] * b).normalized();
      if (plane_.x.norm() < settled_mm) return;
    }
  }

  // 2 c . q + (r^2 - c^2) = q^2 (Kasa), then Gauss-Newton on the distances.
  bool fit_circle() {
    const Vector3d a = axis_.unitOrthogonal(), b = axis_.cross(a);
    Eigen::MatrixX2d q(n_, 2);
    Eigen::VectorXd sigma(n_);
    each([&](Eigen::Index i, const WheelPlanePoint& point) {
      q.row(i) << (point.p_W_mm - middle_).dot(a), (point.p_W_mm - middle_).dot(b);
      sigma[i] = std::hypot(point.sigma_radius_mm, problem_.out_of_round_mm);
    });
    Eigen::MatrixX3d J(n_, 3);
    J << 2 * q, Eigen::VectorXd::Ones(n_);
    const Eigen::Vector3d start = fit(J, q.rowwise().squaredNorm(), sigma).x;
    Eigen::RowVector2d centre = start.head<2>().transpose();
    radius_mm_ = std::sqrt(std::max(0.0, start[2] + centre.squaredNorm()));
    for (int step = 0; step < most_steps; ++step) {
      const Eigen::VectorXd away = (q.rowwise() - centre).rowwise().norm();
      J << (q.rowwise() - centre).array().colwise() / away.array(), Eigen::VectorXd::Ones(n_);
      circle_ = fit(J, away.array() - radius_mm_, sigma);
      centre += circle_.x.head<2>().transpose();
      radius_mm_ += circle_.x[2];
      if (circle_.x.norm() < settled_mm) break;
    }
    centre_ = middle_ + centre.x() * a + centre.y() * b;
    return std::isfinite(radius_mm_) && centre_.allFinite();
  }

  WheelPlaneResult result() const {
    WheelPlaneResult result;
    result.X_WO = wheel_frame(centre_, axis_);
    result.radius_mm = radius_mm_;
    result.off_plane_mm.assign(plane_.residuals.begin(), plane_.residuals.end());
    result.off_circle_mm.assign(circle_.residuals.begin(), circle_.residuals.end());
    result.total_covariance_rad2 = turns(plane_.gain);
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();  // the points' sigmas carried through the same weights
    const Vector3d a = axis_.unitOrthogonal(), b = axis_.cross(a);
    each([&](Eigen::Index, const WheelPlanePoint& point) {
      const Vector3d off = point.p_W_mm - middle_;
      const Vector3d j = plane_.gain * Vector3d(off.dot(a), off.dot(b), 1) /
                         (std::pow(point.sigma_mm, 2) + std::pow(problem_.unevenness_mm, 2));
      own += std::pow(point.sigma_mm, 2) * j * j.transpose();
    });
    result.covariance_rad2 = turns(own);
    judge(result);
    return result;
  }

 private:
  template <typename Act>
  void each(const Act& act) const {
    for (Eigen::Index i = 0; i < n_; ++i) act(i, problem_.points[static_cast<std::size_t>(i)]);
  }

  // Slopes along a and b to turns about x and y of O: height rises by x ry' ... along x with -ry, y with rx.
  Eigen::Matrix2d turns(const Eigen::Matrix3d& gain) const {
    const Vector3d a = axis_.unitOrthogonal(), b = axis_.cross(a);
    const Eigen::Matrix3d R_WO = wheel_frame(centre_, axis_).linear();
    Eigen::Matrix2d J;  // slopes along x and y of O by those along a and b
    J << R_WO.col(0).dot(a), R_WO.col(0).dot(b), R_WO.col(1).dot(a), R_WO.col(1).dot(b);
    Eigen::Matrix2d turn;
    turn << 0, 1, -1, 0;
    const Eigen::Matrix2d all = turn * J;
    return all * gain.topLeftCorner<2, 2>() * all.transpose();
  }

  void judge(WheelPlaneResult& result) const {
    double worst = 0;
    bool in_plane = true;
    for (const Fit* fit : {&plane_, &circle_}) {
      for (Eigen::Index i = 0; i < n_; ++i) {
        const double size = std::abs(fit->normalised[i]);
        if (size <= worst) continue;
        worst = size, in_plane = fit == &plane_;
        result.wrong_point = static_cast<std::size_t>(i);
      }
    }
    if (chi_square_tail(worst * worst, 1) * static_cast<double>(2 * n_) >= false_alarm) {
      result.wrong_point.reset();
      result.status = WheelPlaneStatus::ok;
      return;
    }
    const auto& off = in_plane ? result.off_plane_mm : result.off_circle_mm;
    result.status = WheelPlaneStatus::contradiction;
    result.reason = "point " + number(*result.wrong_point + 1) + " is " +
                    number(std::abs(off[*result.wrong_point])) + " mm off the " +
                    (in_plane ? "plane" : "circle") + " of all points, " + number(worst, 1) + " sigmas";
  }

  const WheelPlaneProblem& problem_;
  Eigen::Index n_;
  Vector3d middle_ = Vector3d::Zero(), axis_ = Vector3d::UnitZ(), centre_ = Vector3d::Zero();
  double radius_mm_ = 0;
  Fit plane_, circle_;
};

}  // namespace

Pose wheel_frame(const Vector3d& centre_W_mm, const Vector3d& axis_W) {
  const Vector3d n = axis_W.normalized();
  const double rx = -std::asin(std::clamp(n.y(), -1.0, 1.0)), ry = std::atan2(n.x(), n.z());
  Pose X_WO = Pose::Identity();
  X_WO.linear() =
      (Eigen::AngleAxisd(ry, Vector3d::UnitY()) * Eigen::AngleAxisd(rx, Vector3d::UnitX())).matrix();
  X_WO.translation() = centre_W_mm;
  return X_WO;
}

WheelAngles wheel_angles(const Pose& X_WO0, const Pose& X_WO) {
  const Vector3d n = X_WO0.linear().transpose() * X_WO.linear().col(2);
  return {-std::asin(std::clamp(n.y(), -1.0, 1.0)), std::atan2(n.x(), n.z())};
}

std::string_view name_of(WheelPlaneStatus status) {
  switch (status) {
    case WheelPlaneStatus::failed:
      return "failed";
    case WheelPlaneStatus::ok:
      return "ok";
    case WheelPlaneStatus::wrong_problem:
      return "wrong_problem";
    case WheelPlaneStatus::not_determined:
      return "not_determined";
    case WheelPlaneStatus::contradiction:
      return "contradiction";
  }
  return "?";
}

WheelPlaneResult fit_wheel_plane(const WheelPlaneProblem& problem) {
  WheelPlaneResult result;
  if (!makes_sense(problem)) {
    result.status = WheelPlaneStatus::wrong_problem;
    result.reason = "fewer than four points, a number that is none, or a sigma that is not positive";
    return result;
  }
  WheelFit fit(problem);
  const bool determined = fit.determined();
  if (determined) fit.fit_plane();
  if (!determined || !fit.fit_circle()) {
    result.status = WheelPlaneStatus::not_determined;
    result.reason = "the points lie on a line or a short arc: no plane and circle through them";
    return result;
  }
  return fit.result();
}

}  // namespace zeropose
