#include "calib/frame_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "calib/best_fit.h"
#include "calib/point_fit.h"
#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Below this share of their length along a line points lie on it.
constexpr double line_share = 1e-3;

class FrameEquations : public PointEquations {
 public:
  FrameEquations(std::span<const MeasuredPair> pairs, const Pose& X_AB) : pairs_(pairs), X_AB_(X_AB) {
    // Turned once, by the pose to begin with: weights that moved with the estimate would not let it converge.
    for (const MeasuredPair& pair : pairs)
      whiten_.emplace_back(pair.covariance_A_mm2 +
                           X_AB.linear() * pair.covariance_B_mm2 * X_AB.linear().transpose());
  }

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<FrameEquations>(*this); }
  Eigen::Index unknowns() const override { return 6; }
  std::size_t points() const override { return pairs_.size(); }
  Eigen::Index rows_per_point() const override { return 3; }
  bool linearise(std::size_t point, PointRows& rows) const override {
    const MeasuredPair& pair = pairs_[point];
    const Vector3d turned = X_AB_.linear() * pair.p_B_mm;
    Eigen::Matrix<double, 3, 6> J;
    J << Matrix3d::Identity(), -cross_matrix(turned);
    rows.r = whiten_[point].matrixL().solve(Vector3d(pair.p_A_mm - turned - X_AB_.translation()));
    rows.J = whiten_[point].matrixL().solve(J);
    return rows.r.allFinite();
  }
  void move(const Eigen::VectorXd& delta) override { X_AB_ = moved(X_AB_, delta); }
  const Pose& X_AB() const { return X_AB_; }

 private:
  std::span<const MeasuredPair> pairs_;
  Pose X_AB_;
  std::vector<Eigen::LLT<Matrix3d>> whiten_;
};

FrameFitResult failed(FrameFitStatus status, std::string reason) {
  FrameFitResult result;
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

bool is_positive(const Matrix3d& covariance) {
  return covariance.allFinite() && symmetric_eigen(covariance).values(0) > 0;
}

// failed: nothing is wrong.
FrameFitResult fault_of(std::span<const MeasuredPair> pairs) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const MeasuredPair& pair = pairs[i];
    if (!pair.p_A_mm.allFinite() || !pair.p_B_mm.allFinite())
      return failed(FrameFitStatus::wrong_problem,
                    "point " + number(i + 1) + " (from 1) has a number that is not finite");
    // Whether two that are not positive add up to one that is depends on the pose: not taken.
    if (!is_positive(pair.covariance_A_mm2) && !is_positive(pair.covariance_B_mm2))
      return failed(FrameFitStatus::wrong_problem,
                    "point " + number(i + 1) + " (from 1) has no covariance that is positive definite");
  }
  if (pairs.size() < 3)
    return failed(FrameFitStatus::too_few_points, number(pairs.size()) + " points, a frame needs 3");
  return {};
}

// Spread across and along the line that fits the points best, root mean square: of the one frame's points.
FrameFitResult line_of(std::span<const MeasuredPair> pairs) {
  Vector3d centre = Vector3d::Zero();
  for (const MeasuredPair& pair : pairs) centre += pair.p_A_mm / double(pairs.size());
  Matrix3d sum = Matrix3d::Zero();
  for (const MeasuredPair& pair : pairs)
    sum += (pair.p_A_mm - centre) * (pair.p_A_mm - centre).transpose() / double(pairs.size());
  const Vector3d squares = symmetric_eigen(sum).values.cwiseMax(0);
  const double across = std::sqrt(squares(0) + squares(1)), along = std::sqrt(squares(2));
  if (across > line_share * along) return {};
  return failed(FrameFitStatus::collinear,
                "the " + number(pairs.size()) + " points lie on a line: " + number(across) +
                    " mm across over " + number(along) + " mm along (root mean square)");
}

std::string list_of(const std::vector<std::size_t>& points) {
  std::string text;
  for (const std::size_t point : points) text += (text.empty() ? "" : ", ") + number(point + 1);
  return text;
}

void fill(std::span<const MeasuredPair> pairs, const std::vector<bool>& used, const WrongPoints& wrong,
          FrameFitResult& result) {
  result.X_AB = static_cast<const FrameEquations&>(*wrong.fit.at).X_AB();
  result.covariance = wrong.fit.inverse_N;
  result.redundancy = wrong.fit.redundancy;
  result.removed = wrong.removed;
  result.suspects = wrong.suspects;
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    result.residuals_mm.push_back(pairs[i].p_A_mm - result.X_AB * pairs[i].p_B_mm);
    if (!used[i]) continue;
    sum += result.residuals_mm.back().squaredNorm();
    ++count;
  }
  result.rms_mm = count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

std::string_view name_of(FrameFitStatus status) {
  switch (status) {
    case FrameFitStatus::ok:
      return "ok";
    case FrameFitStatus::wrong_problem:
      return "wrong_problem";
    case FrameFitStatus::too_few_points:
      return "too_few_points";
    case FrameFitStatus::collinear:
      return "collinear";
    case FrameFitStatus::contradiction:
      return "contradiction";
    case FrameFitStatus::not_converged:
      return "not_converged";
    default:
      return "failed";
  }
}

FrameFitResult fit_frames(std::span<const MeasuredPair> pairs) {
  if (FrameFitResult fault = fault_of(pairs); fault.status != FrameFitStatus::failed) return fault;
  if (FrameFitResult line = line_of(pairs); line.status != FrameFitStatus::failed) return line;
  std::vector<PointPair> plain;
  for (const MeasuredPair& pair : pairs)
    plain.push_back(
        {pair.p_A_mm, pair.p_B_mm, 1 / (pair.covariance_A_mm2.trace() + pair.covariance_B_mm2.trace())});
  const BestFitResult start = best_fit(plain);
  if (start.status != BestFitStatus::ok)
    return failed(FrameFitStatus::collinear, "the points lie on a line in one of the frames");
  std::vector<bool> used(pairs.size(), true);
  PointFit all = fit_points(FrameEquations(pairs, start.X_AB), used);
  if (all.status == PointFitStatus::ok) {
    const Pose X_AB = static_cast<const FrameEquations&>(*all.at).X_AB();
    all = fit_points(FrameEquations(pairs, X_AB), used);
  }
  if (all.status != PointFitStatus::ok)
    return failed(FrameFitStatus::not_converged, "no pose explains the " + number(pairs.size()) + " points");
  WrongPointOptions options;
  options.sigma_px = 1;  // the residuals are whitened
  const WrongPoints wrong = remove_wrong_points(std::move(all), used, options);
  FrameFitResult result;
  result.status = FrameFitStatus::ok;
  fill(pairs, used, wrong, result);
  if (wrong.agree) return result;
  result.status = FrameFitStatus::contradiction;
  result.reason =
      "the points contradict each other by " + number(result.rms_mm, 3) +
      " mm (root mean square), more than their sigmas allow" +
      (wrong.suspects.empty() ? std::string(", and no single one explains it")
                              : ", wrong is one of points " + list_of(wrong.suspects) + " (from 1)");
  return result;
}

UncertainPose chain(const UncertainPose& X_AB, const UncertainPose& X_BC) {
  const Matrix3d& R = X_AB.X.linear();
  Matrix6 turn = Matrix6::Zero(), lever = Matrix6::Identity();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
  lever.topRightCorner<3, 3>() = -cross_matrix(R * X_BC.X.translation());
  return {X_AB.X * X_BC.X,
          lever * X_AB.covariance * lever.transpose() + turn * X_BC.covariance * turn.transpose()};
}

}  // namespace zeropose
