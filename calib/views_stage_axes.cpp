#include "calib/views_stage_axes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/chance.h"
#include "calib/symmetric_eigen.h"
#include "calib/views_report.h"
#include "calib/words.h"

namespace zeropose {

std::string turn_text(const StageEstimate& stage) {
  // To a thousandth, and without the sign of a zero.
  const Eigen::Vector3d thousandths = 1000 * degrees_per_radian * log_so3(stage.X_BS.linear());
  const Eigen::Vector3d turn = (thousandths.array().round() + 0.0) / 1000;
  const Vector6 sigma = stage.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  std::string text;
  for (int k = 0; k < 3; ++k)
    if (sigma[3 + k] > 1e-3 * sigma.tail<3>().maxCoeff())
      text += (text.empty() ? "r" : ", r") + std::string(1, "xyz"[k]) + " " + number(turn[k], 3) +
              " (sigma " + number(sigma[3 + k] * degrees_per_radian, 3) + ")";
  return text + " deg";
}

}  // namespace zeropose

namespace zeropose::bundle {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double by_eye_deg = 1;        // so well a board is put on a stage without measuring
constexpr double wrong_table_deg = 5;   // more is no fault in setting up
constexpr double by_chance = 0.0027;    // three sigma
constexpr double arithmetic_px = 1e-4;  // exact pixels: what stays of them when the iteration ends

// Along the stage's directions, from the identity.
VectorXd unknowns_of(const Stage& stage, const Pose& X_BS) {
  const MatrixXd& D = stage.directions;
  return MatrixXd(D.transpose() * D).ldlt().solve(D.transpose() * difference(Pose::Identity(), X_BS));
}

// Of the direction in which it is known worst.
double turn_sigma_deg(const Matrix6& covariance) {
  const VectorXd squares = symmetric_eigen(covariance.bottomRightCorner<3, 3>()).values;
  return std::sqrt(std::max(0.0, squares[2])) * degrees_per_radian;
}

double rms_px(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks) {
  double sum = 0, count = 0;
  for (const Chunk& chunk : chunks)
    for (const SeenPoint& point : chunk.points)
      if (const auto deviation = deviation_of(state, problem.points[point.index]))
        sum += deviation->dev_px.squaredNorm(), count += 1;
  return std::sqrt(sum / std::max(1.0, count));
}

double largest_in_sigmas(const VectorXd& move, const MatrixXd& covariance) {
  double largest = 0;
  for (Eigen::Index k = 0; k < move.size(); ++k)
    if (covariance(k, k) > 0) largest = std::max(largest, std::abs(move[k]) / std::sqrt(covariance(k, k)));
  return largest;
}

// Of the internals and poses of all cameras.
double answer_moves_sigmas(const ViewsProblem& problem, const ViewsResult& result, const State& to) {
  double largest = 0;
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    const CameraEstimate& camera = result.cameras[c];
    const MatrixXd D = directions_of(problem.cameras[c]);
    const VectorXd internals = D.colwise().squaredNorm().cwiseInverse().asDiagonal() * D.transpose() *
                               (internals_of(to.models[c]) - internals_of(camera.model));
    largest = std::max({largest, largest_in_sigmas(internals, camera.internals.covariance),
                        largest_in_sigmas(difference(camera.X_WC, to.X_WC[c]), camera.pose_covariance)});
  }
  return largest;
}

// Of a drop of the squares by so many sigmas squared.
double chance_of(const ViewsProblem& problem, double square, int unknowns, int redundancy) {
  return problem.sigma_px > 0 ? chi_square_tail(square, unknowns)
                              : fisher_tail(square / unknowns, unknowns, redundancy);
}

std::string what_helps(const ViewsProblem& problem) {
  return std::string(
             ": hold the focal lengths, take them for one where pixels are square, or add views of the board "
             "tilted (their poses need not be known)") +
         (problem.cameras.size() == 1 ? ", or calibrate a second camera together with this one" : "");
}

}  // namespace

std::string unknown_axes(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                         const Freedom& freedom, const UncertaintyAnswer& answer) {
  const std::string how = "how the stage's axes are turned against the board's";
  if (!answer.found) {
    Freedom held = freedom;
    held.stage.reset();
    if (!uncertainty_of(problem, state, chunks, held, problem.robust).found) return "";
    return "the points do not tell " + how + what_helps(problem);
  }
  const Scatter scatter = scatter_of(problem, chunks, cost_of(state, chunks, 0), answer);
  const MatrixXd& D = freedom.stage->directions;
  const double sigma_deg =
      std::max(scatter.sigma_px, least_sigma_px) * turn_sigma_deg(D * answer.found->stage * D.transpose());
  if (sigma_deg <= by_eye_deg) return "";
  return "the points tell " + how + " to " + number(sigma_deg, 1) + " deg only (sigma)" + what_helps(problem);
}

StageEstimate stage_estimate(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                             const Freedom& freedom, const Uncertainty& uncertainty) {
  const Stage& stage = *freedom.stage;
  const Scatter scatter = scatter_of(problem, chunks, cost_of(state, chunks, 0), {uncertainty, ""});
  const MatrixXd covariance = scatter.sigma_px * scatter.sigma_px * uncertainty.stage;
  const VectorXd unknowns = unknowns_of(stage, state.X_BS);
  const double square = unknowns.dot(covariance.ldlt().solve(unknowns));
  StageEstimate estimate;
  estimate.X_BS = state.X_BS;
  estimate.covariance = stage.directions * covariance * stage.directions.transpose();
  estimate.unknowns = static_cast<int>(unknowns.size());
  estimate.chance = chance_of(problem, square, estimate.unknowns, scatter.redundancy);
  estimate.rms_px = rms_px(problem, state, chunks);
  return estimate;
}

void check_stage(const ViewsProblem& problem, const State& state, std::span<const Chunk> chunks,
                 const Freedom& freedom, int redundancy, ViewsResult& result) {
  Freedom free = freedom;
  free.stage = stage_of(problem);
  if (!free.stage) return;
  StageEstimate& stage = result.stage.emplace();
  stage.held = true;
  stage.unknowns = static_cast<int>(free.stage->directions.cols());
  State other = state;
  if (!refine(other, chunks, free, {problem.robust, problem.max_iterations, {}}).converged) {
    stage.unknown = "an estimate of how the stage's axes are turned against the board's does not settle";
    return;
  }
  const UncertaintyAnswer answer = uncertainty_of(problem, other, chunks, free, problem.robust);
  stage.unknown = unknown_axes(problem, other, chunks, free, answer);
  if (stage.unknown.empty() && answer.found) {
    stage = stage_estimate(problem, other, chunks, free, *answer.found);
    stage.held = true;
    stage.answer_moves_sigmas = answer_moves_sigmas(problem, result, other);
  }
  // Whether something is wrong shows by how much better it fits, even where the points do not tell what.
  stage.rms_px = rms_px(problem, other, chunks);
  const double left = cost_of(other, chunks, problem.robust);
  const int rest = std::max(1, redundancy - stage.unknowns);
  const double variance = problem.sigma_px > 0 ? problem.sigma_px * problem.sigma_px
                                               : std::max(left / rest, arithmetic_px * arithmetic_px);
  stage.chance =
      chance_of(problem, (cost_of(state, chunks, problem.robust) - left) / variance, stage.unknowns, rest);
}

void warn_of_stage(ViewsResult& result) {
  const StageEstimate& stage = *result.stage;
  // A turn that leaves the answer within its own sigma does no harm.
  const bool harmful = !stage.unknown.empty() || stage.answer_moves_sigmas > 1;
  if (stage.held && stage.chance < by_chance && harmful)
    result.diagnosis.warnings.push_back(
        "the stage's axes seem turned against the board's" +
        (stage.unknown.empty() ? " by " + turn_text(stage) : ", the points do not tell by how much") +
        ": were that estimated, the deviations would fall from " + number(result.rms_px, 3) + " to " +
        number(stage.rms_px, 3) + " px" +
        (stage.unknown.empty() ? " and the answer would move by up to " +
                                     number(stage.answer_moves_sigmas, 1) + " of its sigmas"
                               : ""));
  const double turn_deg = log_so3(stage.X_BS.linear()).norm() * degrees_per_radian;
  if (turn_deg > wrong_table_deg && stage.chance < by_chance)
    result.diagnosis.warnings.push_back("no stage is set up " + number(turn_deg, 1) +
                                        " deg off: is an axis or a sign of the known poses wrong?");
}

}  // namespace zeropose::bundle
