#include "calib/views_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/symmetric_eigen.h"
#include "calib/views_checks.h"

namespace zeropose::bundle {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Where the unknowns that all views share stand: the internals and the pose of every camera, then the
// stage's.
struct Layout {
  std::vector<Index> internals, cameras;
  Index stage = 0, stage_size = 0, size = 0;

  explicit Layout(const Freedom& freedom) {
    for (std::size_t c = 0; c < freedom.cameras.size(); ++c) {
      internals.push_back(size);
      size += freedom.internals[c].cols();
      cameras.push_back(size);
      if (freedom.cameras[c]) size += 6;
    }
    stage = size;
    stage_size = freedom.stage ? freedom.stage->directions.cols() : 0;
    size += stage_size;
  }
};

// The normal equations in blocks: shared, and per view its own and the mixed ones.
struct Normal {
  MatrixXd shared;
  std::vector<Matrix6> own;
  std::vector<MatrixXd> mixed;  // 6 x shared
};

// d (internals, X_CB) / d (shared unknowns) for one chunk.
MatrixXd chain_of(const State& state, const Chunk& chunk, const Freedom& freedom, const Layout& layout) {
  MatrixXd chain = MatrixXd::Zero(columns, layout.size);
  const MatrixXd& directions = freedom.internals[chunk.camera];
  chain.block(0, layout.internals[chunk.camera], internals_count, directions.cols()) = directions;
  if (freedom.cameras[chunk.camera])
    chain.block(internals_count, layout.cameras[chunk.camera], 6, 6) =
        by_camera(state.X_WC[chunk.camera], state.X_WB[chunk.view]);
  if (const Stage* mover = mover_of(freedom, chunk.view))
    chain.block(internals_count, layout.stage, 6, layout.stage_size) =
        by_view(state.X_WC[chunk.camera]) * mover->by_stage(chunk.view, state.X_BS) * mover->directions;
  return chain;
}

std::optional<Normal> normal_of(const State& state, std::span<const Chunk> chunks, const Freedom& freedom,
                                const Layout& layout, double loss) {
  Normal normal{MatrixXd::Zero(layout.size, layout.size),
                std::vector<Matrix6>(state.X_WB.size(), Matrix6::Zero()),
                std::vector<MatrixXd>(state.X_WB.size(), MatrixXd::Zero(6, layout.size))};
  for (const Chunk& chunk : chunks) {
    const Pose X_CB = state.X_WC[chunk.camera].inverse() * state.X_WB[chunk.view];
    const auto equations = equations_of(state.models[chunk.camera], X_CB, chunk.points, loss);
    if (!equations) return std::nullopt;
    const MatrixXd H = equations->sums.topLeftCorner<columns, columns>();
    const MatrixXd chain = chain_of(state, chunk, freedom, layout);
    normal.shared += chain.transpose() * H * chain;
    if (!freedom.views[chunk.view]) continue;
    const Matrix6 A = by_view(state.X_WC[chunk.camera]);
    normal.own[chunk.view] += A.transpose() * H.bottomRightCorner(6, 6) * A;
    normal.mixed[chunk.view] += A.transpose() * H.bottomRows(6) * chain;
  }
  return normal;
}

// M^-1 by way of a unit diagonal; none when it is singular. Condition: of the scaled matrix.
struct Inverse {
  MatrixXd matrix;
  double condition = 0;
  VectorXd weakest;  // the direction nearest to singular, scaled
  bool regular = false;
};

Inverse inverse_of(const MatrixXd& M, const VectorXd& before) {
  Inverse inverse;
  inverse.regular = true;
  if (M.rows() == 0) return inverse;
  // Scaled by what the diagonal was before the views took their share: what is then left of it, near the
  // arithmetic's noise, is nothing.
  const VectorXd scale = before.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * M * scale.asDiagonal());
  const VectorXd& values = eigen.values;
  inverse.weakest = eigen.vectors.col(0);
  inverse.regular = values[0] > 1e-13 * values[values.size() - 1];
  if (!inverse.regular) return inverse;
  const MatrixXd half = scale.asDiagonal() * eigen.vectors;
  inverse.matrix = half * values.cwiseInverse().asDiagonal() * half.transpose();
  const VectorXd unit = M.diagonal().cwiseSqrt().cwiseInverse();
  const VectorXd scaled = symmetric_eigen(unit.asDiagonal() * M * unit.asDiagonal()).values;
  inverse.condition = scaled[values.size() - 1] / scaled[0];
  return inverse;
}

std::string names_of_weak(const ViewsProblem& problem, const Freedom& freedom, const Layout& layout,
                          const VectorXd& weakest) {
  std::string names;
  const double limit = 0.3 * weakest.cwiseAbs().maxCoeff();
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const std::string of = problem.cameras.size() > 1 ? " of " + problem.cameras[c].name : "";
    const std::vector<Parameter> parameters = free_internals(problem.cameras[c]);
    for (std::size_t k = 0; k < parameters.size(); ++k)
      if (std::abs(weakest[layout.internals[c] + static_cast<Index>(k)]) >= limit)
        names += (names.empty() ? "" : ", ") + std::string(name_of(parameters[k])) + of;
    if (freedom.cameras[c] && weakest.segment(layout.cameras[c], 6).cwiseAbs().maxCoeff() >= limit)
      names += (names.empty() ? "the pose" : ", the pose") + of;
  }
  if (layout.stage_size > 0 &&
      weakest.segment(layout.stage, layout.stage_size).cwiseAbs().maxCoeff() >= limit)
    names += names.empty() ? "the stage's axes" : ", the stage's axes";
  return names;
}

}  // namespace

Scatter scatter_of(const ViewsProblem& problem, std::span<const Chunk> chunks, double residual_sum,
                   const UncertaintyAnswer& answer) {
  int equations = 0;
  for (const Chunk& chunk : chunks) equations += 2 * static_cast<int>(chunk.points.size());
  const int redundancy = std::max(1, answer.found ? equations - answer.found->unknowns : 1);
  return {problem.sigma_px > 0 ? problem.sigma_px : std::sqrt(residual_sum / redundancy), redundancy};
}

UncertaintyAnswer uncertainty_of(const ViewsProblem& problem, const State& state,
                                 std::span<const Chunk> chunks, const Freedom& freedom, double loss) {
  const Layout layout(freedom);
  const auto normal = normal_of(state, chunks, freedom, layout, loss);
  if (!normal) return {std::nullopt, "a point without image"};
  MatrixXd reduced = normal->shared;
  std::vector<Matrix6> own(state.X_WB.size(), Matrix6::Zero());
  for (std::size_t v = 0; v < own.size(); ++v) {
    if (!freedom.views[v]) continue;
    const Inverse inverse = inverse_of(normal->own[v], normal->own[v].diagonal());
    if (!inverse.regular) return {std::nullopt, "the pose of view " + problem.views[v].name};
    own[v] = inverse.matrix;
    reduced -= normal->mixed[v].transpose() * own[v] * normal->mixed[v];
  }
  const Inverse shared = inverse_of(reduced, normal->shared.diagonal());
  if (!shared.regular) return {std::nullopt, names_of_weak(problem, freedom, layout, shared.weakest)};
  Uncertainty result;
  result.condition = shared.condition;
  result.unknowns = static_cast<int>(layout.size);
  for (std::size_t c = 0; c < state.models.size(); ++c) {
    const Index n = freedom.internals[c].cols();
    result.internals.push_back(shared.matrix.block(layout.internals[c], layout.internals[c], n, n));
    result.cameras.push_back(Matrix6::Zero());
    if (freedom.cameras[c])
      result.cameras.back() = shared.matrix.block(layout.cameras[c], layout.cameras[c], 6, 6);
  }
  result.stage = shared.matrix.block(layout.stage, layout.stage, layout.stage_size, layout.stage_size);
  for (std::size_t v = 0; v < own.size(); ++v) {
    result.views.push_back(own[v]);
    if (const Stage* mover = mover_of(freedom, v)) {
      const MatrixXd A = mover->by_stage(v, state.X_BS) * mover->directions;
      result.views.back() = A * result.stage * A.transpose();
    }
    if (!freedom.views[v]) continue;
    result.unknowns += 6;
    if (layout.size == 0) continue;
    const MatrixXd share = own[v] * normal->mixed[v];
    result.views.back() += share * shared.matrix * share.transpose();
  }
  return {result, ""};
}

}  // namespace zeropose::bundle
