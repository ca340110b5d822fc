#include "measure/wheel_axis.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/rigid.h"
#include "measure/profile_spline.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

constexpr double radius_scale_mm = 300;  // turns count as mm at this radius
constexpr int most_steps = 25;
constexpr double settled_mm = 1e-4;
constexpr double least_pivot = 1e-9;

struct Stage {
  double spacing_mm, loss_mm;
};
constexpr Stage stages[] = {{25, 5}, {10, 1}, {3, 0.2}};

struct Step {
  WheelAxis axis;
  double size_mm = 0;
};

// Turns about two axes across, then shifts along them.
WheelAxis moved(const WheelAxis& axis, const Eigen::Vector4d& delta) {
  const Vector3d a = axis.n_W.unitOrthogonal(), b = axis.n_W.cross(a);
  const Vector3d turn = (delta[0] * a + delta[1] * b) / radius_scale_mm;
  return {axis.p_W_mm + delta[2] * a + delta[3] * b, (exp_so3(turn) * axis.n_W).normalized()};
}

SplineKnots knots_about(std::span<const SideLine> lines, const WheelAxis& axis, double spacing_mm) {
  double least = 1e9, most = 0;
  for (const SideLine& line : lines) {
    for (const SidePoint& point : line) {
      const double radius_mm = axis.place(point.p_W_mm).radius_mm;
      least = std::min(least, radius_mm), most = std::max(most, radius_mm);
    }
  }
  return {least, std::max(most, least + 1), spacing_mm};
}

// One step of Gauss-Newton: the coefficients of the section are solved together with the axis. They are
// linear, so that no start of theirs is needed but for the loss: without it (first) all weigh alike.
class Equations {
 public:
  Equations(std::span<const SideLine> lines, const WheelAxis& axis, const Stage& stage)
      : lines_(lines), axis_(axis), stage_(stage), knots_(knots_about(lines, axis, stage.spacing_mm)) {}

  std::optional<Step> step() {
    solve_section();
    for (int round = 0; round < 3; ++round) solve_section();  // the loss settles on the section
    const Eigen::Index n = 4 + knots_.coefficients();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    each([&](const SidePoint& point, const WheelAxis::Place& place, const SplineWeights& w) {
      Eigen::Vector4d J;  // of height - section(radius) by the axis
      const double slope = w.slope.dot(section_.segment<4>(w.first));
      for (int k = 0; k < 4; ++k) {
        const auto changed = moved(axis_, 1e-3 * Eigen::Vector4d::Unit(k)).place(point.p_W_mm);
        J[k] = ((changed.height_mm - place.height_mm) - slope * (changed.radius_mm - place.radius_mm)) / 1e-3;
      }
      const double off = place.height_mm - w.value.dot(section_.segment<4>(w.first));
      const double weight = weight_of(off);
      normal.topLeftCorner<4, 4>() += weight * J * J.transpose();
      normal.block<4, 4>(0, 4 + w.first) -= weight * J * w.value.transpose();
      normal.block<4, 4>(4 + w.first, 4 + w.first) += weight * w.value * w.value.transpose();
      right.head<4>() -= weight * off * J;
      right.segment<4>(4 + w.first) += weight * off * w.value;
    });
    normal.bottomLeftCorner(n - 4, 4) = normal.topRightCorner(4, n - 4).transpose();
    even_out(normal, n - 4);
    return solved(normal, right);
  }

 private:
  double weight_of(double off) const {
    return section_.size() == 0 ? 1 : 1 / (1 + off * off / (stage_.loss_mm * stage_.loss_mm));
  }

  template <typename Act>
  void each(const Act& act) const {
    for (const SideLine& line : lines_) {
      for (const SidePoint& point : line) {
        const WheelAxis::Place place = axis_.place(point.p_W_mm);
        act(point, place, knots_.at(place.radius_mm));
      }
    }
  }

  void solve_section() {
    const Eigen::Index n = knots_.coefficients();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    each([&](const SidePoint&, const WheelAxis::Place& place, const SplineWeights& w) {
      const double off =
          section_.size() == 0 ? 0 : place.height_mm - w.value.dot(section_.segment<4>(w.first));
      const double weight = weight_of(off);
      normal.block<4, 4>(w.first, w.first) += weight * w.value * w.value.transpose();
      right.segment<4>(w.first) += weight * place.height_mm * w.value;
    });
    even_out(normal, n);
    section_ = normal.ldlt().solve(right);
  }

  std::optional<Step> solved(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right) const {
    const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
    const auto pivots = solver.vectorD().array();
    if (!(pivots.minCoeff() > least_pivot * pivots.maxCoeff())) return std::nullopt;
    const Eigen::Vector4d delta = solver.solve(right).head<4>();
    if (!delta.allFinite()) return std::nullopt;
    return Step{moved(axis_, delta), delta.norm()};
  }

  std::span<const SideLine> lines_;
  WheelAxis axis_;
  Stage stage_;
  SplineKnots knots_;
  Eigen::VectorXd section_;
};

}  // namespace

WheelAxis::Place WheelAxis::place(const Vector3d& p_W) const {
  const Vector3d off = p_W - p_W_mm;
  const double height_mm = n_W.dot(off);
  const Vector3d across = off - height_mm * n_W;
  return {across.norm(), height_mm, across.normalized()};
}

double SidePoint::sigma_along(const Vector3d& n) const {
  return std::hypot(n.dot(by_left_mm), n.dot(by_right_mm));
}

std::optional<WheelAxis> fit_axis(std::span<const SideLine> lines, const WheelAxis& start) {
  WheelAxis axis = start;
  for (const Stage& stage : stages) {
    bool settled = false;
    for (int count = 0; count < most_steps && !settled; ++count) {
      const auto step = Equations(lines, axis, stage).step();
      if (!step) return std::nullopt;
      axis = step->axis;
      settled = step->size_mm < (&stage == std::end(stages) - 1 ? settled_mm : 100 * settled_mm);
    }
    if (!settled && &stage == std::end(stages) - 1) return std::nullopt;
  }
  return axis;
}

}  // namespace zeropose
