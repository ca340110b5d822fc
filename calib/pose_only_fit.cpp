#include "calib/pose_only_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/best_fit.h"
#include "calib/three_points.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

// A fit with more than this between the points ended in a wrong valley, or started from a wrong point.
constexpr double plausible_px = 5;
// Two poses are one when they differ by less, rad and share of the distance.
constexpr double same_pose = 1e-4;
// The believed pose decides when the next one is so many times farther from it.
constexpr double clearly_nearer = 2;
// Triples are chosen among so many points at most.
constexpr std::size_t most_looked_at = 40;

class CameraEquations : public PointEquations {
 public:
  CameraEquations(const PoseOnlyProblem& problem, double scale_px, const Pose& X_WC)
      : problem_(&problem), scale_px_(scale_px), X_WC_(X_WC) {
    double distance_mm = 0;
    for (const CalibrationPoint& point : problem.points)
      distance_mm += (point.p_W_mm - X_WC.translation()).norm() / static_cast<double>(problem.points.size());
    px_per_mm_ = problem.model.fx_px / distance_mm;
  }

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<CameraEquations>(*this); }
  Eigen::Index unknowns() const override { return 6; }
  std::size_t points() const override { return problem_->points.size(); }
  Eigen::Index rows_per_point() const override { return 2; }
  const Pose& X_WC() const { return X_WC_; }
  void move(const Eigen::VectorXd& delta) override { X_WC_ = moved(X_WC_, delta); }

  bool linearise(std::size_t point, PointRows& rows) const override {
    const CalibrationPoint& seen = problem_->points[point];
    const Vector3d arm = seen.p_W_mm - X_WC_.translation();
    const Eigen::Matrix3d R_CW = X_WC_.linear().transpose();
    if (problem_->residual == Residual::algebraic) return linearise_algebraic(seen, R_CW, arm, rows);
    const auto image = project_with_jacobian(problem_->model, R_CW * arm);
    if (!image) return false;
    Eigen::MatrixXd J(2, 6);
    J << -image->du_dp * R_CW, image->du_dp * R_CW * cross_matrix(arm);
    const Eigen::Matrix2d L = seen.covariance_px2.llt().matrixL();
    rows.J = L.triangularView<Eigen::Lower>().solve(J);
    rows.r = L.triangularView<Eigen::Lower>().solve(seen.u_px - image->u_px);
    return true;
  }

  bool linearise_rest(PointRows& rows) const override {
    const auto count = static_cast<Eigen::Index>(problem_->features.size());
    rows.r.resize(3 * count);
    rows.J.resize(3 * count, 6);
    for (Eigen::Index i = 0; i < count; ++i) {
      const HousingFeature& feature = problem_->features[static_cast<std::size_t>(i)];
      const double weight = scale_px_ / feature.sigma_mm;
      const Vector3d arm = X_WC_.linear() * feature.p_C_mm;
      rows.r.segment<3>(3 * i) = weight * (feature.p_W_mm - X_WC_.translation() - arm);
      rows.J.middleRows<3>(3 * i) << weight * Eigen::Matrix3d::Identity(), -weight * cross_matrix(arm);
    }
    return true;
  }

 private:
  // The point's distance from its line of sight, in px at the points' mean distance.
  bool linearise_algebraic(const CalibrationPoint& seen, const Eigen::Matrix3d& R_CW, const Vector3d& arm,
                           PointRows& rows) const {
    const Vector3d d = ray(problem_->model, seen.u_px)->normalized();
    if (!(d.dot(R_CW * arm) > 0)) return false;
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = d.unitOrthogonal();
    across.row(1) = d.cross(d.unitOrthogonal());
    across *= px_per_mm_;
    rows.r = -across * (R_CW * arm);
    rows.J.resize(2, 6);
    rows.J << -across * R_CW, across * R_CW * cross_matrix(arm);
    return true;
  }

  const PoseOnlyProblem* problem_;
  double scale_px_, px_per_mm_ = 1;
  Pose X_WC_;
};

// Root mean square of the whitened residuals of a point.
double misfit_px(const PointFit& fit, std::size_t points) {
  return std::sqrt(fit.cost / static_cast<double>(points));
}

using Triple = std::array<std::size_t, 3>;

// The three points whose images span the largest triangle; `without` is not among them.
Triple widest_triple(std::span<const Vector3d> directions, std::size_t without) {
  Triple widest{};
  double largest = -1;
  const std::size_t n = std::min(directions.size(), most_looked_at);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = j + 1; k < n; ++k) {
        if (i == without || j == without || k == without) continue;
        const double area =
            (directions[j] - directions[i]).cross(directions[k] - directions[i]).squaredNorm();
        if (area > largest) largest = area, widest = {i, j, k};
      }
  return widest;
}

// Where the features put the camera, roughly: the directions of the points as seen from there.
std::vector<Pose> starts_by_features(const PoseOnlyProblem& problem) {
  std::vector<PointPair> pairs;
  for (const HousingFeature& feature : problem.features) pairs.push_back({feature.p_W_mm, feature.p_C_mm, 1});
  if (const BestFitResult fit = best_fit(pairs); fit.status == BestFitStatus::ok) return {fit.X_AB};
  const Vector3d p_WF = problem.features.front().p_W_mm;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const CalibrationPoint& point : problem.points)
    sum += (point.p_W_mm - p_WF).normalized() * ray(problem.model, point.u_px)->normalized().transpose();
  Pose X_WC = Pose::Identity();
  X_WC.linear() = nearest_rotation(sum);
  X_WC.translation() = p_WF - X_WC.linear() * problem.features.front().p_C_mm;
  return {X_WC};
}

std::vector<Pose> starts_by_triple(const PoseOnlyProblem& problem, std::span<const Vector3d> directions,
                                   const Triple& triple) {
  std::array<Vector3d, 3> p_W_mm, d_C;
  for (std::size_t k = 0; k < 3; ++k) {
    p_W_mm[k] = problem.points[triple[k]].p_W_mm;
    d_C[k] = directions[triple[k]];
  }
  return poses_from_three(p_W_mm, d_C);
}

// Distance between two poses of the camera, rad and share of the distance to the points.
double apart(const Pose& a, const Pose& b, double distance_mm) {
  const Vector6 delta = difference(a, b);
  return delta.head<3>().norm() / distance_mm + delta.tail<3>().norm();
}

double distance_of(const PoseOnlyProblem& problem, const Pose& X_WC) {
  Vector3d centre = Vector3d::Zero();
  for (const CalibrationPoint& point : problem.points)
    centre += point.p_W_mm / static_cast<double>(problem.points.size());
  return (centre - X_WC.translation()).norm();
}

// Fits from some starts, added to those that are known unless they are one of them.
class Valleys {
 public:
  Valleys(const PoseOnlyProblem& problem, double scale_px) : problem_(problem), scale_px_(scale_px) {}

  void fit_from(const std::vector<Pose>& starts) {
    const std::vector<bool> all(problem_.points.size(), true);
    for (const Pose& start : starts) {
      PointFit fit = fit_points(CameraEquations(problem_, scale_px_, start), all);
      if (fit.status != PointFitStatus::ok) {
        if (nearest_.status == PointFitStatus::failed || fit.status == PointFitStatus::not_determined)
          nearest_ = std::move(fit);
        continue;
      }
      const Pose X_WC = pose_of(fit);
      const double distance_mm = distance_of(problem_, X_WC);
      const bool known = std::any_of(fits_.begin(), fits_.end(), [&](const PointFit& other) {
        return apart(pose_of(other), X_WC, distance_mm) < same_pose;
      });
      if (!known) fits_.push_back(std::move(fit));
    }
    std::sort(fits_.begin(), fits_.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  }

  bool plausible() const {
    return !fits_.empty() && misfit_px(fits_.front(), problem_.points.size()) < plausible_px;
  }

  // Leaves the best one, and the poses of those that are as good.
  CameraFits decide() {
    CameraFits result;
    if (fits_.empty()) {
      result.best = std::move(nearest_);
      return result;
    }
    WrongPointOptions options;
    options.sigma_px = problem_.sigma_px;
    const double sigma = std::max(options.least_sigma_px, sigma_of_fit(fits_.front(), options));
    const double limit = fits_.front().cost + 2 * std::log(1000.0) * sigma * sigma;
    std::erase_if(fits_, [limit](const PointFit& fit) { return fit.cost > limit; });
    result.undecided = fits_.size() > 1 && !decided_by_belief();
    for (std::size_t i = 1; i < fits_.size(); ++i) result.alternatives.push_back(pose_of(fits_[i]));
    result.best = std::move(fits_.front());
    return result;
  }

 private:
  // Sorts by the distance to the believed pose; false when that does not decide.
  bool decided_by_belief() {
    if (!problem_.X_WC_near) return false;
    const double distance_mm = distance_of(problem_, *problem_.X_WC_near);
    const auto from_belief = [&](const PointFit& fit) {
      return apart(pose_of(fit), *problem_.X_WC_near, distance_mm);
    };
    std::sort(fits_.begin(), fits_.end(),
              [&](const auto& a, const auto& b) { return from_belief(a) < from_belief(b); });
    return from_belief(fits_[1]) > clearly_nearer * from_belief(fits_[0]);
  }

  const PoseOnlyProblem& problem_;
  double scale_px_;
  std::vector<PointFit> fits_;
  PointFit nearest_;
};

}  // namespace

std::unique_ptr<PointEquations> equations_at(const PoseOnlyProblem& problem, double scale_px,
                                             const Pose& X_WC) {
  return std::make_unique<CameraEquations>(problem, scale_px, X_WC);
}

Pose pose_of(const PointFit& fit) { return static_cast<const CameraEquations&>(*fit.at).X_WC(); }

CameraFits fits_from_anywhere(const PoseOnlyProblem& problem, double scale_px) {
  Valleys valleys(problem, scale_px);
  if (problem.X_WC_near) valleys.fit_from({*problem.X_WC_near});
  if (!problem.features.empty()) {
    valleys.fit_from(starts_by_features(problem));
    return valleys.decide();
  }
  std::vector<Vector3d> directions;
  for (const CalibrationPoint& point : problem.points) directions.push_back(*ray(problem.model, point.u_px));
  const std::size_t none = problem.points.size();
  const Triple first = widest_triple(directions, none);
  valleys.fit_from(starts_by_triple(problem, directions, first));
  // One of the three may be a wrong point.
  for (std::size_t k = 0; k < 3 && problem.points.size() > 3 && !valleys.plausible(); ++k)
    valleys.fit_from(starts_by_triple(problem, directions, widest_triple(directions, first[k])));
  return valleys.decide();
}

}  // namespace zeropose
