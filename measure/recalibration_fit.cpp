#include "measure/recalibration_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "calib/three_points.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Ways to place all groups that are tried; each plate of three points has two as a rule.
constexpr std::size_t most_placements = 16;
const double unlikely = 2 * std::log(1000.0);  // of a placement so many times less likely than the best one
constexpr double same_change = 1e-6;           // rad, and mm / 1000

Vector3d direction_of(const CameraModel& model, const Vector2d& u_px) { return *ray(model, u_px); }

void whiten(const Matrix2d& covariance, Eigen::Ref<Eigen::VectorXd> r, Eigen::Ref<MatrixXd> J) {
  const Matrix2d L = covariance.llt().matrixL();
  L.triangularView<Eigen::Lower>().solveInPlace(r);
  L.triangularView<Eigen::Lower>().solveInPlace(J);
}

class RotationEquations : public PointEquations {
 public:
  RotationEquations(const RecalibrationProblem& problem, const Matrix3d& R)
      : problem_(&problem), R_CoCn_(R) {}

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<RotationEquations>(*this); }
  Eigen::Index unknowns() const override { return 3; }
  std::size_t points() const override { return problem_->points.size(); }
  Eigen::Index rows_per_point() const override { return 2; }
  void move(const Eigen::VectorXd& delta) override { R_CoCn_ = exp_so3(delta) * R_CoCn_; }
  const Matrix3d& R_CoCn() const { return R_CoCn_; }

  // The new pixel against the old one as the turned camera would see it; its covariance is carried along.
  bool linearise(std::size_t index, PointRows& rows) const override {
    const RecalibrationPoint& point = problem_->points[index];
    const Vector3d d_old = direction_of(problem_->model, point.old_px);
    const auto before = project_with_jacobian(problem_->model, d_old);
    const auto after = project_with_jacobian(problem_->model, R_CoCn_.transpose() * d_old);
    if (!before || !after) return false;
    const Eigen::Matrix<double, 2, 3> by_direction = after->du_dp * R_CoCn_.transpose();
    const Matrix2d by_old_px = by_direction.leftCols<2>() * before->du_dp.leftCols<2>().inverse();
    rows.r = point.new_px - after->u_px;
    rows.J = by_direction * cross_matrix(d_old);
    whiten(point.new_covariance_px2 + by_old_px * point.old_covariance_px2 * by_old_px.transpose(), rows.r,
           rows.J);
    return true;
  }

 private:
  const RecalibrationProblem* problem_;
  Matrix3d R_CoCn_;
};

class GroupEquations : public PointEquations {
 public:
  GroupEquations(const RecalibrationProblem& problem, GroupState state)
      : problem_(&problem), group_(group_numbers(problem.points)), state_(std::move(state)) {}

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<GroupEquations>(*this); }
  Eigen::Index unknowns() const override { return 6 + 6 * static_cast<Eigen::Index>(state_.X_CoG.size()); }
  std::size_t points() const override { return problem_->points.size(); }
  Eigen::Index rows_per_point() const override { return 4; }
  const GroupState& state() const { return state_; }

  void move(const Eigen::VectorXd& delta) override {
    state_.X_CoCn = moved(state_.X_CoCn, delta.head<6>());
    for (std::size_t g = 0; g < state_.X_CoG.size(); ++g)
      state_.X_CoG[g] = moved(state_.X_CoG[g], delta.segment<6>(6 + 6 * static_cast<Eigen::Index>(g)));
  }

  bool linearise(std::size_t index, PointRows& rows) const override {
    const RecalibrationPoint& point = problem_->points[index];
    const Pose& X_CoG = state_.X_CoG[group_[index]];
    const Matrix3d R_CnCo = state_.X_CoCn.linear().transpose();
    const Vector3d p_Co = X_CoG * point.p_mm, arm = p_Co - state_.X_CoCn.translation();
    const auto before = project_with_jacobian(problem_->model, p_Co);
    const auto after = project_with_jacobian(problem_->model, R_CnCo * arm);
    if (!before || !after) return false;
    Eigen::Matrix<double, 3, 6> by_group, by_change;
    by_group << Matrix3d::Identity(), -cross_matrix(X_CoG.linear() * point.p_mm);
    by_change << -R_CnCo, R_CnCo * cross_matrix(arm);
    const Eigen::Index column = 6 + 6 * static_cast<Eigen::Index>(group_[index]);
    rows.r.resize(4);
    rows.r << point.old_px - before->u_px, point.new_px - after->u_px;
    rows.J = MatrixXd::Zero(4, unknowns());
    rows.J.block<2, 6>(0, column) = before->du_dp * by_group;
    rows.J.block<2, 6>(2, column) = after->du_dp * R_CnCo * by_group;
    rows.J.block<2, 6>(2, 0) = after->du_dp * by_change;
    whiten(point.old_covariance_px2, rows.r.head(2), rows.J.topRows(2));
    whiten(point.new_covariance_px2, rows.r.tail(2), rows.J.bottomRows(2));
    return true;
  }

 private:
  const RecalibrationProblem* problem_;
  std::vector<std::size_t> group_;
  GroupState state_;
};

using Indices = std::vector<std::size_t>;

std::vector<Indices> members_of(std::span<const RecalibrationPoint> points) {
  std::vector<Indices> members;
  const Indices groups = group_numbers(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (groups[i] >= members.size()) members.resize(groups[i] + 1);
    members[groups[i]].push_back(i);
  }
  return members;
}

// The three points of a group that span the largest triangle.
std::array<std::size_t, 3> widest(std::span<const RecalibrationPoint> points, const Indices& members) {
  std::array<std::size_t, 3> chosen{members[0], members[1], members[2]};
  double largest = -1;
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::size_t j = i + 1; j < members.size(); ++j)
      for (std::size_t k = j + 1; k < members.size(); ++k) {
        const Vector3d& p = points[members[i]].p_mm;
        const double area = (points[members[j]].p_mm - p).cross(points[members[k]].p_mm - p).squaredNorm();
        if (area > largest) largest = area, chosen = {members[i], members[j], members[k]};
      }
  return chosen;
}

// Every X_CG that three points of a group allow.
std::vector<Pose> places_of(const RecalibrationProblem& problem, const Indices& members,
                            Eigen::Vector2d RecalibrationPoint::*u_px) {
  std::array<Vector3d, 3> p_G_mm, d_C;
  const auto triple = widest(problem.points, members);
  for (std::size_t k = 0; k < 3; ++k) {
    p_G_mm[k] = problem.points[triple[k]].p_mm;
    d_C[k] = direction_of(problem.model, problem.points[triple[k]].*u_px);
  }
  std::vector<Pose> places = poses_from_three(p_G_mm, d_C);
  for (Pose& place : places) place = place.inverse();
  return places;
}

// Sum of the squared distances of a group's new pixels from where the change would put them.
double misfit(const RecalibrationProblem& problem, const Indices& members, const Pose& X_CoCn,
              const Pose& X_CoG) {
  double sum = 0;
  for (const std::size_t i : members) {
    const auto u_px = project(problem.model, X_CoCn.inverse() * (X_CoG * problem.points[i].p_mm));
    sum += u_px ? (problem.points[i].new_px - *u_px).squaredNorm() : 1e12;
  }
  return sum;
}

// The changes that single groups suggest, and that of a camera that only turned.
std::vector<Pose> suggested_changes(const RecalibrationProblem& problem, const std::vector<Indices>& members,
                                    const std::vector<std::vector<Pose>>& old_places) {
  Pose turned = Pose::Identity();
  turned.linear() = rotation_between(problem);
  std::vector<Pose> changes{turned};
  for (std::size_t g = 0; g < members.size(); ++g)
    for (const Pose& X_CnG : places_of(problem, members[g], &RecalibrationPoint::new_px))
      for (const Pose& X_CoG : old_places[g]) changes.push_back(X_CoG * X_CnG.inverse());
  return changes;
}

struct Placement {
  double misfit = std::numeric_limits<double>::infinity();
  GroupState state;
};

// For every way to place the groups by the old pixels the change that suits the new ones best; the most
// suitable ways first.
std::vector<Placement> placements_of(const RecalibrationProblem& problem) {
  const std::vector<Indices> members = members_of(problem.points);
  std::vector<std::vector<Pose>> places;
  for (const Indices& group : members)
    places.push_back(places_of(problem, group, &RecalibrationPoint::old_px));
  const std::vector<Pose> changes = suggested_changes(problem, members, places);
  std::vector<Placement> placements{{0, {}}};
  for (std::size_t g = 0; g < members.size(); ++g) {
    std::vector<Placement> longer;
    for (const Placement& before : placements)
      for (const Pose& place : places[g]) {
        longer.push_back(before);
        longer.back().state.X_CoG.push_back(place);
      }
    for (Placement& placement : longer) {
      placement.misfit = std::numeric_limits<double>::infinity();
      for (const Pose& change : changes) {
        double sum = 0;
        for (std::size_t k = 0; k <= g; ++k)
          sum += misfit(problem, members[k], change, placement.state.X_CoG[k]);
        if (sum < placement.misfit) placement.misfit = sum, placement.state.X_CoCn = change;
      }
    }
    std::sort(longer.begin(), longer.end(), [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
    if (longer.size() > most_placements) longer.resize(most_placements);
    placements = std::move(longer);
  }
  return placements;
}

}  // namespace

Matrix3d rotation_between(const RecalibrationProblem& problem) {
  Matrix3d sum = Matrix3d::Zero();
  for (const RecalibrationPoint& point : problem.points)
    sum += direction_of(problem.model, point.old_px).normalized() *
           direction_of(problem.model, point.new_px).normalized().transpose();
  return nearest_rotation(sum);
}

PointFit fit_rotation(const RecalibrationProblem& problem, const Matrix3d& R_CoCn_start) {
  return fit_points(RotationEquations(problem, R_CoCn_start), std::vector<bool>(problem.points.size(), true));
}

Matrix3d rotation_of(const PointFit& fit) { return static_cast<const RotationEquations&>(*fit.at).R_CoCn(); }

std::vector<std::size_t> group_numbers(std::span<const RecalibrationPoint> points) {
  std::map<std::string, std::size_t> known;
  std::vector<std::size_t> numbers;
  for (const RecalibrationPoint& point : points)
    numbers.push_back(known.try_emplace(point.group, known.size()).first->second);
  return numbers;
}

PointFit fit_groups(const RecalibrationProblem& problem, const GroupState& start) {
  return fit_points(GroupEquations(problem, start), std::vector<bool>(problem.points.size(), true));
}

const GroupState& groups_of(const PointFit& fit) {
  return static_cast<const GroupEquations&>(*fit.at).state();
}

GroupFits fit_groups_from_anywhere(const RecalibrationProblem& problem) {
  std::vector<PointFit> fits;
  GroupFits result;
  for (const Placement& placement : placements_of(problem)) {
    PointFit fit = fit_groups(problem, placement.state);
    if (fit.status == PointFitStatus::ok)
      fits.push_back(std::move(fit));
    else if (result.best.status == PointFitStatus::failed || fit.status == PointFitStatus::not_determined)
      result.best = std::move(fit);
  }
  if (fits.empty()) return result;
  std::sort(fits.begin(), fits.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  WrongPointOptions options;
  options.sigma_px = problem.sigma_px;
  const double sigma = std::max(options.least_sigma_px, sigma_of_fit(fits.front(), options));
  const Pose& X_CoCn = groups_of(fits.front()).X_CoCn;
  for (std::size_t i = 1; i < fits.size(); ++i) {
    if (fits[i].cost - fits.front().cost > unlikely * sigma * sigma) break;
    const Vector6 apart = difference(X_CoCn, groups_of(fits[i]).X_CoCn);
    if (apart.head<3>().norm() / 1000 + apart.tail<3>().norm() > same_change)
      result.others.push_back(groups_of(fits[i]).X_CoCn);
  }
  result.best = std::move(fits.front());
  return result;
}

}  // namespace zeropose
