#include "calib/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/eccentricity.h"
#include "calib/refine_equations.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double worst_condition = 1e13;
constexpr double last_step = 1e-10;  // of the cost
constexpr double first_damping = 1e-9, largest_damping = 1e12;
constexpr int disc_rounds = 10;

struct State {
  CameraModel model;
  Pose X_WC = Pose::Identity();
};

// The angles (rx, ry, rz) of R = Rz Ry Rx as axes of rotation in the world: column i turns the i-th alone.
Eigen::Matrix3d axes_of_angles(const Pose& X_WC) {
  const SixNumbers six = to_six_numbers(X_WC);
  const double ry = six.ry_deg / degrees_per_radian, rz = six.rz_deg / degrees_per_radian;
  Eigen::Matrix3d axes;
  axes << std::cos(ry) * std::cos(rz), -std::sin(rz), 0, std::cos(ry) * std::sin(rz), std::cos(rz), 0,
      -std::sin(ry), 0, 1;
  return axes;
}

Vector3d centroid_of(std::span<const CalibrationPoint> points) {
  Vector3d sum = Vector3d::Zero();
  for (const CalibrationPoint& point : points) sum += point.p_W_mm;
  return sum / static_cast<double>(points.size());
}

// From the steps of the free parameters to those of all: fixed ones have no column. A pose that is free as a
// whole steps along the camera's axes and turns about the points' centroid: the valley between origin and
// rotation, curved about the camera's centre, is straight there. Its columns are then those of this step
// (orbit), and those of the parameters themselves for the covariance.
class Freedom {
 public:
  Freedom(const RefineProblem& problem)
      : free_(free_parameters(problem)),
        lens_(lens_size(problem.start)),
        one_focal_(problem.one_focal),
        orbits_(free_.has_all(pose_parameters)),
        centroid_(centroid_of(problem.points)) {
    angles_free_ = free_.has(Parameter::rx) + free_.has(Parameter::ry) + free_.has(Parameter::rz);
    const std::vector<Parameter> all = order();
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!free_.has(all[i])) continue;
      list_.push_back(all[i]);
      places_.push_back(static_cast<Eigen::Index>(i));
    }
    aspect_ = problem.start.fx_px / problem.start.fy_px;
  }

  const std::vector<Parameter>& list() const { return list_; }

  // The pose's columns of the step by those of moved().
  Matrix6 pose_of_step(const State& state) const {
    Matrix6 T = Matrix6::Identity();
    if (!orbits_) return pose_of_parameters(state);
    T.topLeftCorner<3, 3>() = state.X_WC.linear();
    T.topRightCorner<3, 3>() = -cross_matrix(state.X_WC.translation() - centroid_);
    return T;
  }
  Matrix6 pose_of_parameters(const State& state) const {
    Matrix6 T = Matrix6::Identity();
    if (partly_turned()) T.bottomRightCorner<3, 3>() = axes_of_angles(state.X_WC);
    return T;
  }

  // The equations in the free parameters.
  ViewEquations chosen(const ViewEquations& all, const Matrix6& pose) const {
    SmallMatrix N = all.N;
    SmallVector g = all.g;
    const Eigen::Index first = N.rows() - 6;
    const Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 15, 6> columns = N.rightCols<6>().lazyProduct(pose);
    const Matrix6 own = pose.transpose().lazyProduct(columns.bottomRows<6>());
    N.topRightCorner(first, 6) = columns.topRows(first);
    N.bottomLeftCorner(6, first) = columns.topRows(first).transpose();
    N.bottomRightCorner<6, 6>() = own;
    g.tail<6>() = pose.transpose() * Vector6(all.g.tail<6>());
    if (one_focal_) {  // fy = fx / aspect
      N.col(0) += N.col(1) / aspect_;
      N.row(0) += N.row(1) / aspect_;
      g(0) += g(1) / aspect_;
    }
    ViewEquations chosen;
    const auto n = static_cast<Eigen::Index>(list_.size());
    chosen.N.resize(n, n);
    chosen.g.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index row = places_[static_cast<std::size_t>(i)];
      chosen.g(i) = g(row);
      for (Eigen::Index j = 0; j < n; ++j) chosen.N(j, i) = N(places_[static_cast<std::size_t>(j)], row);
    }
    return chosen;
  }

  State moved_by(const State& state, const SmallVector& step) const {
    State next = state;
    Vector6 delta = Vector6::Zero();
    for (std::size_t k = 0; k < list_.size(); ++k) {
      const double by = step(static_cast<Eigen::Index>(k));
      if (list_[k] < Parameter::x)
        change_internal(next.model, list_[k], by);
      else
        delta(static_cast<int>(list_[k]) - static_cast<int>(Parameter::x)) = by;
    }
    if (orbits_) {
      const Eigen::Matrix3d turn = exp_so3(delta.tail<3>());
      next.X_WC.linear() = turn * state.X_WC.linear();
      next.X_WC.translation() =
          centroid_ + turn * (state.X_WC.translation() - centroid_ + state.X_WC.linear() * delta.head<3>());
      return next;
    }
    if (!partly_turned()) {
      next.X_WC = moved(state.X_WC, delta);
      return next;
    }
    SixNumbers six = to_six_numbers(state.X_WC);
    six.x_mm += delta(0);
    six.y_mm += delta(1);
    six.z_mm += delta(2);
    six.rx_deg += delta(3) * degrees_per_radian;
    six.ry_deg += delta(4) * degrees_per_radian;
    six.rz_deg += delta(5) * degrees_per_radian;
    next.X_WC = from_six_numbers(six);
    return next;
  }

 private:
  bool partly_turned() const { return angles_free_ == 1 || angles_free_ == 2; }

  std::vector<Parameter> order() const {
    using enum Parameter;
    if (lens_ == 1) return {fx, fy, cx, cy, K, x, y, z, rx, ry, rz};
    return {fx, fy, cx, cy, k1, k2, p1, p2, k3, x, y, z, rx, ry, rz};
  }

  void change_internal(CameraModel& model, Parameter parameter, double by) const {
    if (auto* division = std::get_if<Division>(&model.distortion); division && parameter == Parameter::K)
      division->K += by;
    if (auto* brown = std::get_if<BrownConrady>(&model.distortion)) {
      if (parameter == Parameter::k1) brown->k1 += by;
      if (parameter == Parameter::k2) brown->k2 += by;
      if (parameter == Parameter::p1) brown->p1 += by;
      if (parameter == Parameter::p2) brown->p2 += by;
      if (parameter == Parameter::k3) brown->k3 += by;
    }
    if (parameter == Parameter::fx) {
      model.fx_px += by;
      if (one_focal_) model.fy_px = model.fx_px / aspect_;
    }
    if (parameter == Parameter::fy) model.fy_px += by;
    if (parameter == Parameter::cx) model.cx_px += by;
    if (parameter == Parameter::cy) model.cy_px += by;
  }

  ParameterSet free_;
  Eigen::Index lens_;
  bool one_focal_;
  bool orbits_;
  Vector3d centroid_;
  int angles_free_ = 0;
  double aspect_ = 1;
  std::vector<Parameter> list_;
  std::vector<Eigen::Index> places_;  // of the listed ones among all
};

// With a unit diagonal.
struct Scaled {
  SmallMatrix N;
  SmallVector g;
  SmallVector scale;  // step = scale * scaled step
};

Scaled scaled(const ViewEquations& equations) {
  Scaled result;
  result.scale =
      equations.N.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  result.N = result.scale.asDiagonal() * equations.N * result.scale.asDiagonal();
  result.g = result.scale.cwiseProduct(equations.g);
  return result;
}

struct Descent {
  State state;
  ViewEquations equations;
  int iterations = 0;
  bool converged = false;
};

// What the cost is when the residuals are nothing but rounding of the pixels.
double rounding_of(const RefineProblem& problem, const PointColumns& columns) {
  const double pixels = (columns.wuu * columns.u_px.square() + columns.wvv * columns.v_px.square()).sum();
  if (problem.residual == Residual::reprojection) return 1e-24 * pixels;
  const Pose X_CW = problem.X_WC_start.inverse();
  double depth = 0;
  for (const CalibrationPoint& point : problem.points)
    depth = std::max(depth, std::abs((X_CW * point.p_W_mm).z()));
  return 1e-24 * pixels * depth * depth;
}

// A step is the last one when it promises to save next to nothing: what is then left to the minimum is the
// square of that.
Descent descend(const RefineProblem& problem, const PointColumns& columns, const Freedom& freedom,
                const State& start, double robust) {
  const Objective objective{problem.residual, robust};
  Descent at{start, normal_equations(columns, start.model, start.X_WC, objective), 0, false};
  const double rounding = rounding_of(problem, columns);
  double damping = first_damping;
  while (at.equations.visible && at.iterations < problem.max_iterations) {
    const Scaled own = scaled(freedom.chosen(at.equations, freedom.pose_of_step(at.state)));
    ++at.iterations;
    SmallMatrix damped = own.N;
    damped.diagonal().array() += damping;
    const SmallVector step = damped.llt().solve(own.g);
    const double promised = step.dot(own.g);
    at.converged = promised <= last_step * at.equations.cost + rounding;
    State next = freedom.moved_by(at.state, own.scale.cwiseProduct(step));
    if (at.converged) {  // nothing more is to be learnt there
      at.state = std::move(next);
      at.equations.cost = std::max(0.0, at.equations.cost - promised);
      break;
    }
    ViewEquations there = normal_equations(columns, next.model, next.X_WC, objective);
    const bool better = there.visible && there.cost <= at.equations.cost;
    if (better) {
      at.state = std::move(next);
      at.equations = std::move(there);
      damping = std::max(damping * 0.1, 1e-12);
    } else {
      damping *= 10;
    }
    if (damping > largest_damping) {  // nothing is left but the rounding of the cost
      at.converged = promised <= 1e-9 * at.equations.cost;
      break;
    }
  }
  return at;
}

// A robust loss has many minima: from one wide enough for every point down to the one wanted.
Descent descend_robustly(const RefineProblem& problem, const PointColumns& columns, const Freedom& freedom,
                         const State& start) {
  constexpr double narrower = 0.5;
  double robust = problem.robust;
  if (robust > 0) {
    const auto points = static_cast<double>(problem.points.size());
    const ViewEquations first =
        normal_equations(columns, start.model, start.X_WC, Objective{problem.residual, 0});
    if (first.visible) robust = std::max(robust, 2 * std::sqrt(first.cost / points));
  }
  Descent at = descend(problem, columns, freedom, start, robust);
  while (robust > problem.robust) {
    robust = std::max(problem.robust, narrower * robust);
    const int before = at.iterations;
    at = descend(problem, columns, freedom, at.state, robust);
    at.iterations += before;
  }
  return at;
}

// The centre of a disc's image lies beside the image of its centre: what is left for the centre itself.
double correct_discs(std::span<const CalibrationPoint> points, const State& state, PointColumns& columns) {
  double largest = 0;
  const Pose X_CW = state.X_WC.inverse();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].disc_radius_mm > 0)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector2d beside =
        ellipse_centre_offset(state.model, X_CW * points[i].p_W_mm, X_CW.linear() * points[i].disc_normal_W,
                              points[i].disc_radius_mm);
    const Eigen::Vector2d before(columns.u_px(row), columns.v_px(row));
    columns.u_px(row) = points[i].u_px.x() - beside.x();
    columns.v_px(row) = points[i].u_px.y() - beside.y();
    largest = std::max(largest, (Eigen::Vector2d(columns.u_px(row), columns.v_px(row)) - before).norm());
  }
  return largest;
}

// The parameters with the largest parts in the direction that the points leave open.
std::string undetermined(const MatrixXd& N, const std::vector<Parameter>& list) {
  std::string names;
  const VectorXd direction = symmetric_eigen(N).vectors.col(0).cwiseAbs();
  for (std::size_t k = 0; k < list.size(); ++k)
    if (direction(static_cast<Eigen::Index>(k)) > 0.3 * direction.maxCoeff())
      names += (names.empty() ? "" : ", ") + std::string(name_of(list[k]));
  return names;
}

RefineResult failed(CalibrationStatus status, std::string reason) {
  RefineResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

double norm1(const SmallMatrix& M) { return M.cwiseAbs().colwise().sum().maxCoeff(); }

// Condition and covariance, or the names of what cannot be told apart.
void finish(const Freedom& freedom, const Descent& at, RefineResult& result) {
  const Scaled own = scaled(freedom.chosen(at.equations, freedom.pose_of_parameters(at.state)));
  const Eigen::LLT<SmallMatrix> factor(own.N);
  const auto n = own.N.rows();
  const SmallMatrix inverse = factor.solve(SmallMatrix::Identity(n, n));
  result.condition = norm1(own.N) * norm1(inverse);
  if (factor.info() != Eigen::Success || !(result.condition < worst_condition)) {
    result.status = CalibrationStatus::not_determined;
    result.reason = "the points do not tell these parameters apart: " + undetermined(own.N, freedom.list()) +
                    "; fix one of them, or add points at other depths and nearer to the image's edge";
    return;
  }
  result.uncertainty.parameters = freedom.list();
  result.uncertainty.covariance = own.scale.asDiagonal() * inverse * own.scale.asDiagonal();
  result.status = CalibrationStatus::ok;
}

}  // namespace

ParameterSet free_parameters(const RefineProblem& problem) {
  ParameterSet free;
  const bool division = lens_size(problem.start) == 1;
  for (std::size_t i = 0; i < parameter_count; ++i) {
    const auto parameter = static_cast<Parameter>(i);
    const bool other_lens = lens_parameters.has(parameter) && (parameter == Parameter::K) != division;
    if (!other_lens && !problem.fixed.has(parameter)) free.add(parameter);
  }
  if (!problem.one_focal) return free;
  // One of them fixed holds both; else fx stands for both.
  if (!free.has(Parameter::fx)) free.remove(Parameter::fy);
  if (!free.has(Parameter::fy)) free.remove(Parameter::fx);
  free.remove(Parameter::fy);
  return free;
}

RefineResult refine(const RefineProblem& problem) {
  if (problem.residual == Residual::algebraic && lens_size(problem.start) != 1)
    return failed(CalibrationStatus::wrong_problem, "the algebraic residual is that of the division model");
  const Freedom freedom(problem);
  const std::size_t equations = 2 * problem.points.size();
  if (freedom.list().empty())
    return failed(CalibrationStatus::wrong_problem, "every parameter is fixed: there is nothing to refine");
  if (equations < freedom.list().size())
    return failed(CalibrationStatus::too_few_points, number(problem.points.size()) + " points give " +
                                                         number(equations) + " equations for " +
                                                         number(freedom.list().size()) + " parameters");
  PointColumns columns = columns_of(problem.points);
  Descent at{{problem.start, problem.X_WC_start}, {}, 0, false};
  int iterations = 0;
  for (int round = 0; round < disc_rounds; ++round) {
    const double change = correct_discs(problem.points, at.state, columns);
    if (round > 0 && change < 1e-9) break;
    at = descend_robustly(problem, columns, freedom, at.state);
    iterations += at.iterations;
  }
  if (!at.equations.visible)
    return failed(CalibrationStatus::behind_camera,
                  "with the start values a point lies behind the camera or has no image: wrong coordinates, "
                  "pixels or start");
  RefineResult result;
  result.model = at.state.model;
  result.X_WC = at.state.X_WC;
  result.cost = at.equations.cost;
  result.iterations = iterations;
  finish(freedom, at, result);
  if (result.status == CalibrationStatus::ok && !at.converged && problem.max_iterations > 0) {
    result.status = CalibrationStatus::not_converged;
    result.reason = "no minimum after " + number(iterations) + " steps";
  }
  return result;
}

}  // namespace zeropose
