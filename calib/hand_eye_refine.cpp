#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/hand_eye_parts.h"

namespace zeropose::hand_eye {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Terms = std::vector<ViewTerms>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

constexpr int max_rounds = 60;
// A step below this, mm and rad, moves nothing that anybody can measure.
constexpr double small_step = 1e-9;
// Variances that change by less than this share have settled.
constexpr double small_change = 1e-2;

std::optional<Terms> terms_at(const CameraModel& model, HandEyeSetup setup, std::span<const SeenView> views,
                              const State& state) {
  Terms terms;
  for (const SeenView& view : views) {
    auto one = pixel_terms(model, setup, state, view);
    if (!one) return std::nullopt;
    terms.push_back(std::move(*one));
  }
  return terms;
}

struct Normal {
  Matrix12 inverse;
  Vector12 step;
};

Normal solve(const Terms& terms, const Noise& noise) {
  Matrix12 N = Matrix12::Zero();
  Vector12 g = Vector12::Zero();
  Normal normal;
  for (const ViewTerms& view : terms) {
    const auto covariance = covariance_of(view, noise).llt();
    const Matrix6x12 WJ = covariance.solve(view.by_state);
    N += view.by_state.transpose() * WJ;
    g += WJ.transpose() * view.e;
  }
  const Vector12 scale = N.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix12 scaled = scale.asDiagonal() * N * scale.asDiagonal();
  normal.inverse = scale.asDiagonal() * scaled.ldlt().solve(Matrix12::Identity()) * scale.asDiagonal();
  normal.step = normal.inverse * g;
  return normal;
}

// --- the robot's noise: restricted maximum likelihood by Fisher scoring, in units of the usual variances

// What a variance of 1 adds to the covariance of a view's error: of the hand's place, of its turn.
std::array<Matrix6, 2> parts_of(const ViewTerms& view) {
  const double mm = usual_robot_mm, rad = usual_robot_deg / degrees_per_radian;
  const Eigen::Matrix<double, 6, 3> shift = mm * view.by_robot.leftCols<3>(),
                                    turn = rad * view.by_robot.rightCols<3>();
  return {shift * shift.transpose(), turn * turn.transpose()};
}

// F theta = q of the scoring, for the variances theta.
struct Scoring {
  Eigen::Matrix2d F = Eigen::Matrix2d::Zero();
  Eigen::Vector2d q = Eigen::Vector2d::Zero();
};

// P = W - W J (J^T W J)^-1 J^T W of all views, which takes the estimated poses out of the errors.
MatrixXd projector(const Terms& terms, const Noise& noise, const Matrix12& inverse) {
  const auto n = static_cast<Eigen::Index>(terms.size());
  MatrixXd WJ(6 * n, 12), P = MatrixXd::Zero(6 * n, 6 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    const ViewTerms& view = terms[static_cast<std::size_t>(v)];
    const auto covariance = covariance_of(view, noise).llt();
    P.block<6, 6>(6 * v, 6 * v) = covariance.solve(Matrix6::Identity());
    WJ.middleRows<6>(6 * v) = covariance.solve(view.by_state);
  }
  P.noalias() -= WJ * inverse * WJ.transpose();
  return P;
}

Scoring scoring_of(const Terms& terms, const Noise& noise, const Matrix12& inverse) {
  const auto n = static_cast<Eigen::Index>(terms.size());
  const MatrixXd P = projector(terms, noise, inverse);
  VectorXd e(6 * n);
  std::array<MatrixXd, 3> PV{MatrixXd(6 * n, 6 * n), MatrixXd(6 * n, 6 * n), MatrixXd(6 * n, 6 * n)};
  std::vector<std::array<Matrix6, 2>> parts;
  for (Eigen::Index v = 0; v < n; ++v) {
    const ViewTerms& view = terms[static_cast<std::size_t>(v)];
    parts.push_back(parts_of(view));
    e.segment<6>(6 * v) = view.e;
    for (std::size_t k = 0; k < 2; ++k) PV[k].middleCols<6>(6 * v) = P.middleCols<6>(6 * v) * parts.back()[k];
    PV[2].middleCols<6>(6 * v) = P.middleCols<6>(6 * v) * (noise.px * noise.px * view.cofactor);
  }
  const VectorXd Pe = P * e;
  const auto trace = [&](std::size_t a, std::size_t b) {
    return PV[a].cwiseProduct(PV[b].transpose()).sum();
  };
  Scoring scoring;
  for (std::size_t a = 0; a < 2; ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    for (std::size_t b = 0; b < 2; ++b) scoring.F(row, static_cast<Eigen::Index>(b)) = trace(a, b);
    for (Eigen::Index v = 0; v < n; ++v)
      scoring.q(row) +=
          Pe.segment<6>(6 * v).dot(parts[static_cast<std::size_t>(v)][a] * Pe.segment<6>(6 * v));
    scoring.q(row) -= trace(a, 2);
  }
  return scoring;
}

// Few views tell the noise of place and turn badly apart, and where pixels are noisier hardly tell it at all:
// as if so many errors had shown that both are the usual noise times one factor, and so many that the factor
// is 1.
constexpr double errors_of_one_factor = 20, errors_of_usual_noise = 0.5;
constexpr double least_variance = 1e-4;

// The variances from a scoring at those of now; halfway on a logarithmic scale, which keeps them from
// swinging.
Eigen::Vector2d variances_of(Scoring scoring, const Eigen::Vector2d& now) {
  const Eigen::Vector2d weight = now.array().square().inverse();
  const double common = std::sqrt(now(0) * now(1));
  scoring.F.diagonal() += (errors_of_one_factor + errors_of_usual_noise) * weight;
  scoring.q += (errors_of_one_factor * common + errors_of_usual_noise) * weight;
  const Eigen::Vector2d next = (scoring.F.inverse() * scoring.q).cwiseMax(least_variance);
  return next.allFinite() ? Eigen::Vector2d(next.cwiseProduct(now).cwiseSqrt()) : now;
}

// True: settled.
bool update_noise(const Terms& terms, const Matrix12& inverse, Noise& noise) {
  const double mm = usual_robot_mm, rad = usual_robot_deg / degrees_per_radian;
  const Eigen::Vector2d before(noise.mm * noise.mm / (mm * mm), noise.rad * noise.rad / (rad * rad));
  const Eigen::Vector2d after = variances_of(scoring_of(terms, noise, inverse), before);
  noise.mm = mm * std::sqrt(after(0));
  noise.rad = rad * std::sqrt(after(1));
  return ((after - before).array().abs() <= small_change * before.array()).all();
}

// How many errors have shown the covariances: those that show the robot's noise, and more as far as the
// pixels' noise, which is known well, makes up the covariances.
double degrees_of(const Terms& terms, const Refined& refined) {
  const double mm = usual_robot_mm, rad = usual_robot_deg / degrees_per_radian;
  const Noise& noise = refined.noise;
  const Eigen::Vector2d theta(noise.mm * noise.mm / (mm * mm), noise.rad * noise.rad / (rad * rad));
  const double errors = theta.dot(scoring_of(terms, noise, refined.covariance).F * theta);
  Matrix12 by_robot = Matrix12::Zero();
  for (const ViewTerms& view : terms) {
    const auto parts = parts_of(view);
    const Matrix6x12 WJ = covariance_of(view, noise).llt().solve(view.by_state);
    by_robot += WJ.transpose() * (theta(0) * parts[0] + theta(1) * parts[1]) * WJ;
  }
  by_robot = refined.covariance * by_robot * refined.covariance;
  const auto share = [&](Eigen::Index at) {
    return refined.covariance.block<6, 6>(at, at).ldlt().solve(by_robot.block<6, 6>(at, at)).trace() / 6;
  };
  const double most = std::max(share(0), share(6));
  return most > 0 ? (errors + 2 * errors_of_usual_noise) / (most * most) : 1e9;
}

// The board's scale as thirteenth unknown, one step from the estimate.
void fill_scale(const Terms& terms, const Normal& normal, Refined& refined) {
  double N = 0, g = 0;
  Vector12 mixed = Vector12::Zero();
  for (const ViewTerms& view : terms) {
    const auto covariance = covariance_of(view, refined.noise).llt();
    const Vector6 Ws = covariance.solve(view.by_scale);
    N += view.by_scale.dot(Ws);
    g += Ws.dot(view.e);
    mixed += view.by_state.transpose() * Ws;
  }
  const double left = N - mixed.dot(normal.inverse * mixed);
  if (!(left > 1e-9 * N)) return;
  refined.scale = 1 + (g - mixed.dot(normal.step)) / left;
  refined.scale_sigma = 1 / std::sqrt(left);
}

}  // namespace

Refined refine(const CameraModel& model, HandEyeSetup setup, std::span<const SeenView> views,
               const State& start, const Noise& noise, bool estimate_robot) {
  Refined refined;
  refined.state = start;
  refined.noise = noise;
  bool settled = !estimate_robot;
  for (int round = 0; round < max_rounds && !refined.converged; ++round) {
    const auto terms = terms_at(model, setup, views, refined.state);
    if (!terms) return refined;
    const Normal normal = solve(*terms, refined.noise);
    if (!normal.step.allFinite()) return refined;
    refined.converged =
        settled && normal.step.norm() < small_step * (1 + refined.state.X_FC.translation().norm());
    refined.covariance = normal.inverse;
    if (refined.converged) fill_scale(*terms, normal, refined);
    if (refined.converged && estimate_robot) refined.degrees = degrees_of(*terms, refined);
    refined.state = {moved(refined.state.X_FC, normal.step.head<6>()),
                     moved(refined.state.X_GB, normal.step.tail<6>())};
    if (estimate_robot && !settled && !refined.converged)
      settled = update_noise(*terms, normal.inverse, refined.noise) || round > max_rounds / 2;
  }
  return refined;
}

}  // namespace zeropose::hand_eye
