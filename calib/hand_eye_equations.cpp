#include <Eigen/Cholesky>
#include <cmath>

#include "calib/hand_eye_parts.h"

namespace zeropose::hand_eye {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// d predicted / d moved() of state and robot.
void fill_derivatives(HandEyeSetup setup, const State& state, const SeenView& view, ViewTerms& terms) {
  const Pose X_FG = X_FG_of(setup, view.X_RH), X_FB = X_FG * state.X_GB;
  const Matrix6 from_F = bundle::by_view(state.X_FC);
  terms.by_state.leftCols<6>() = bundle::by_camera(state.X_FC, X_FB);
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = X_FG.linear();
  terms.by_state.rightCols<6>() = from_F * turn;
  if (setup == HandEyeSetup::eye_in_hand) {
    terms.by_robot = from_F * bundle::by_camera(view.X_RH, state.X_GB);
    return;
  }
  Matrix6 carried = Matrix6::Identity();
  carried.topRightCorner<3, 3>() = -cross_matrix(X_FG.linear() * state.X_GB.translation());
  terms.by_robot = from_F * carried;
}

// A board that is larger by a share looks like one that is nearer by it.
Vector6 nearer(const Pose& X_CB) {
  Vector6 delta = Vector6::Zero();
  delta.head<3>() = -X_CB.translation();
  return delta;
}

// d log(R exp(-d)) / d d = -J, J the inverse right Jacobian at phi = log R.
Matrix3d inverse_right_jacobian(const Vector3d& phi) {
  const double angle = phi.norm();
  const Matrix3d W = cross_matrix(phi);
  const double b =
      angle < 1e-4 ? 1.0 / 12 : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  return Matrix3d::Identity() + 0.5 * W + b * W * W;
}

class LoopEquations : public PointEquations {
 public:
  LoopEquations(HandEyeSetup setup, std::span<const SeenView> views, const State& start, const Noise& noise)
      : setup_(setup), views_(views), state_(start) {
    for (const SeenView& view : views)
      factors_.push_back(covariance_of(pose_terms(setup, start, view), noise).llt().matrixL());
  }

  std::unique_ptr<PointEquations> copy() const override { return std::make_unique<LoopEquations>(*this); }
  Eigen::Index unknowns() const override { return 12; }
  std::size_t points() const override { return views_.size(); }
  Eigen::Index rows_per_point() const override { return 6; }
  const State& state() const { return state_; }
  void move(const Eigen::VectorXd& delta) override {
    state_ = {moved(state_.X_FC, delta.head<6>()), moved(state_.X_GB, delta.tail<6>())};
  }

  bool linearise(std::size_t view, PointRows& rows) const override {
    const ViewTerms terms = pose_terms(setup_, state_, views_[view]);
    Matrix6x12 J = terms.by_state;
    J.bottomRows<3>() = inverse_right_jacobian(terms.e.tail<3>()) * J.bottomRows<3>();
    const auto L = factors_[view].triangularView<Eigen::Lower>();
    rows.r = L.solve(terms.e);
    rows.J = L.solve(J);
    return rows.r.allFinite();
  }

 private:
  HandEyeSetup setup_;
  std::span<const SeenView> views_;
  State state_;
  std::vector<Matrix6> factors_;
};

}  // namespace

Pose predicted(HandEyeSetup setup, const State& state, const Pose& X_RH) {
  return state.X_FC.inverse() * X_FG_of(setup, X_RH) * state.X_GB;
}

ViewTerms pose_terms(HandEyeSetup setup, const State& state, const SeenView& view) {
  ViewTerms terms;
  const Pose X_CB = predicted(setup, state, view.X_RH);
  terms.e = difference(X_CB, view.X_CB);
  terms.cofactor = view.cofactor;
  terms.by_scale = nearer(X_CB);
  fill_derivatives(setup, state, view, terms);
  return terms;
}

std::optional<ViewTerms> pixel_terms(const CameraModel& model, HandEyeSetup setup, const State& state,
                                     const SeenView& view) {
  const Pose X_CB = predicted(setup, state, view.X_RH);
  const auto equations = bundle::equations_of(model, X_CB, view.points, 0);
  if (!equations) return std::nullopt;
  ViewTerms terms;
  const auto normal = equations->sums.block<6, 6>(internals_count, internals_count).eval().ldlt();
  terms.cofactor = normal.solve(Matrix6::Identity());
  terms.e = -normal.solve(equations->sums.block<6, 1>(internals_count, bundle::columns));
  terms.by_scale = nearer(X_CB);
  fill_derivatives(setup, state, view, terms);
  return terms;
}

Matrix6 covariance_of(const ViewTerms& terms, const Noise& noise) {
  Vector6 squares;
  squares << Vector3d::Constant(noise.mm * noise.mm), Vector3d::Constant(noise.rad * noise.rad);
  return noise.px * noise.px * terms.cofactor +
         terms.by_robot * squares.asDiagonal() * terms.by_robot.transpose();
}

std::unique_ptr<PointEquations> equations_at(HandEyeSetup setup, std::span<const SeenView> views,
                                             const State& start, const Noise& noise) {
  return std::make_unique<LoopEquations>(setup, views, start, noise);
}

State state_of(const PointFit& fit) { return static_cast<const LoopEquations&>(*fit.at).state(); }

}  // namespace zeropose::hand_eye
