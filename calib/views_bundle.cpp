#include "calib/views_bundle.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <memory>

namespace zeropose::bundle {
namespace {

using Eigen::Map;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A pose as Ceres holds it: translation, quaternion x y z w. Jacobians are those of moved() with a seventh
// column of zeros, and the manifold's derivative picks the six: shorter than by way of the quaternion.
constexpr int pose_size = 7;
using PoseNumbers = Eigen::Matrix<double, pose_size, 1>;

PoseNumbers numbers_of(const Pose& X) {
  PoseNumbers numbers;
  numbers << X.translation(), Eigen::Quaterniond(X.linear()).coeffs();
  return numbers;
}

Pose pose_of(const double* numbers) {
  Pose X = Pose::Identity();
  X.translation() = Map<const Eigen::Vector3d>(numbers);
  X.linear() = Map<const Eigen::Quaterniond>(numbers + 3).normalized().toRotationMatrix();
  return X;
}

// It may move along some directions only, too.
class PoseManifold : public ceres::Manifold {
 public:
  explicit PoseManifold(const Eigen::MatrixXd& directions = Matrix6::Identity())
      : directions_(directions),
        inverse_(Eigen::MatrixXd(directions.transpose() * directions).ldlt().solve(directions.transpose())) {}
  int AmbientSize() const override { return pose_size; }
  int TangentSize() const override { return static_cast<int>(directions_.cols()); }
  bool Plus(const double* x, const double* delta, double* sum) const override {
    Map<PoseNumbers> target(sum);
    target =
        numbers_of(moved(pose_of(x), directions_ * Map<const Eigen::VectorXd>(delta, directions_.cols())));
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Map<RowMatrix> target(jacobian, pose_size, directions_.cols());
    target.topRows<6>() = directions_;
    target.row(6).setZero();
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    Map<Eigen::VectorXd>(delta, directions_.cols()) = inverse_ * difference(pose_of(x), pose_of(y));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Map<RowMatrix> target(jacobian, directions_.cols(), pose_size);
    target.leftCols<6>() = inverse_;
    target.col(6).setZero();
    return true;
  }

 private:
  Eigen::MatrixXd directions_, inverse_;
};

// Internals that may move along some directions only: some are held, and with one focal length two move as
// one.
class InternalsManifold : public ceres::Manifold {
 public:
  explicit InternalsManifold(const Eigen::MatrixXd& directions)
      : directions_(directions),
        inverse_(directions.colwise().squaredNorm().cwiseInverse().asDiagonal() * directions.transpose()) {}
  int AmbientSize() const override { return internals_count; }
  int TangentSize() const override { return static_cast<int>(directions_.cols()); }
  bool Plus(const double* x, const double* delta, double* sum) const override {
    Map<Internals> target(sum);
    target = Map<const Internals>(x) + directions_ * Map<const Eigen::VectorXd>(delta, directions_.cols());
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Map<RowMatrix>(jacobian, internals_count, directions_.cols()) = directions_;
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    Map<Eigen::VectorXd>(delta, directions_.cols()) =
        inverse_ * (Map<const Internals>(y) - Map<const Internals>(x));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Map<RowMatrix>(jacobian, directions_.cols(), internals_count) = inverse_;
    return true;
  }

 private:
  Eigen::MatrixXd directions_, inverse_;
};

// sums = [J r]^T [J r] as a short J and r with the same: the triangle of a Cholesky decomposition, pivoted
// and of a matrix scaled to a unit diagonal, so that directions without information fall out. The last
// residual is what no parameter can change. Ceres then handles 16 rows per chunk, however many points it has.
constexpr int short_rows = columns + 1;
using ShortJacobian = Eigen::Matrix<double, short_rows, columns>;
struct ShortEquations {
  ShortJacobian J = ShortJacobian::Zero();
  Eigen::Matrix<double, short_rows, 1> r = Eigen::Matrix<double, short_rows, 1>::Zero();
};

ShortEquations shortened(const Equations& equations) {
  using Square = Eigen::Matrix<double, columns, columns>;
  using Vector = Eigen::Matrix<double, columns, 1>;
  const Vector diagonal = equations.sums.diagonal().head<columns>();
  const Vector size = diagonal.cwiseSqrt();
  const Vector scale = (diagonal.array() > 0).select(size.cwiseInverse(), 0);
  const Square scaled =
      scale.asDiagonal() * equations.sums.topLeftCorner<columns, columns>() * scale.asDiagonal();
  const Eigen::LDLT<Square> ldlt(scaled);
  Vector y = ldlt.transpositionsP() * scale.cwiseProduct(equations.sums.col(columns).head<columns>());
  ldlt.matrixL().solveInPlace(y);
  Square upper = ldlt.transpositionsP() * Square(Square::Identity());
  upper = ldlt.matrixU() * upper.eval();
  ShortEquations result;
  double explained = 0;
  for (int i = 0; i < columns; ++i) {
    const double pivot = ldlt.vectorD()[i];
    if (!(pivot > 1e-15)) continue;
    result.J.row(i) = std::sqrt(pivot) * upper.row(i) * size.asDiagonal();
    result.r[i] = y[i] / std::sqrt(pivot);
    explained += result.r[i] * result.r[i];
  }
  result.r[columns] = std::sqrt(std::max(0.0, equations.cost - explained));
  return result;
}

// Parameters: internals, X_WC, X_WB or, where a stage moves the board, X_BS.
class ChunkCost : public ceres::SizedCostFunction<short_rows, internals_count, pose_size, pose_size> {
 public:
  ChunkCost(const CameraModel& model, const Chunk& chunk, const Stage* stage, double loss)
      : model_(model), chunk_(chunk), stage_(stage), loss_(loss) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const CameraModel model = with_internals(model_, Map<const Internals>(parameters[0]));
    const Pose X_WC = pose_of(parameters[1]), last = pose_of(parameters[2]);
    const Pose X_WB = stage_ != nullptr ? stage_->X_WB(chunk_.view, last) : last,
               X_CB = X_WC.inverse() * X_WB;
    if (!(model.fx_px > 0) || !(model.fy_px > 0)) return false;
    Map<Eigen::Matrix<double, short_rows, 1>> r(residuals);
    if (jacobians == nullptr) {
      const auto cost = cost_of(model, X_CB, chunk_.points, loss_);
      r.setZero();
      r[columns] = std::sqrt(cost.value_or(0));
      return cost.has_value();
    }
    const auto equations = equations_of(model, X_CB, chunk_.points, loss_);
    if (!equations) return false;
    const ShortEquations rows = shortened(*equations);
    r = rows.r;
    if (jacobians[0] != nullptr)
      Map<RowMatrix>(jacobians[0], short_rows, internals_count) = rows.J.leftCols<internals_count>();
    if (jacobians[1] != nullptr) write_pose(rows.J, by_camera(X_WC, X_WB), jacobians[1]);
    const Matrix6 by_last =
        stage_ != nullptr ? stage_->by_stage(chunk_.view, last) : Matrix6(Matrix6::Identity());
    if (jacobians[2] != nullptr) write_pose(rows.J, by_view(X_WC) * by_last, jacobians[2]);
    return true;
  }

 private:
  static void write_pose(const ShortJacobian& J, const Matrix6& chain, double* jacobian) {
    Map<RowMatrix> target(jacobian, short_rows, pose_size);
    target.leftCols<6>() = J.rightCols<6>() * chain;
    target.col(6).setZero();
  }

  const CameraModel& model_;
  const Chunk& chunk_;
  const Stage* stage_;
  double loss_;
};

class Progress : public ceres::IterationCallback {
 public:
  explicit Progress(const std::function<void(int, double)>& report) : report_(report) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    report_(summary.iteration, summary.cost);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<void(int, double)>& report_;
};

// The state as Ceres' parameter blocks.
struct Blocks {
  std::vector<Internals> internals;
  std::vector<PoseNumbers> cameras, views;
  PoseNumbers stage;

  explicit Blocks(const State& state) : stage(numbers_of(state.X_BS)) {
    for (const CameraModel& model : state.models) internals.push_back(internals_of(model));
    for (const Pose& X_WC : state.X_WC) cameras.push_back(numbers_of(X_WC));
    for (const Pose& X_WB : state.X_WB) views.push_back(numbers_of(X_WB));
  }
  void write(State& state, const Freedom& freedom) const {
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      state.models[c] = with_internals(state.models[c], internals[c]);
      state.X_WC[c] = pose_of(cameras[c].data());
    }
    state.X_BS = pose_of(stage.data());
    for (std::size_t v = 0; v < views.size(); ++v) {
      const Stage* mover = mover_of(freedom, v);
      state.X_WB[v] = mover != nullptr ? mover->X_WB(v, state.X_BS) : pose_of(views[v].data());
    }
  }
};

// Only the blocks that a chunk uses are known to Ceres.
void set_freedom(ceres::Problem& problem, Blocks& blocks, const Freedom& freedom) {
  const auto pose = [&problem](double* block, bool free) {
    if (!problem.HasParameterBlock(block)) return;
    if (free)
      problem.SetManifold(block, new PoseManifold);
    else
      problem.SetParameterBlockConstant(block);
  };
  for (std::size_t c = 0; c < blocks.cameras.size(); ++c) {
    pose(blocks.cameras[c].data(), freedom.cameras[c]);
    double* internals = blocks.internals[c].data();
    if (!problem.HasParameterBlock(internals)) continue;
    if (freedom.internals[c].cols() == 0)
      problem.SetParameterBlockConstant(internals);
    else
      problem.SetManifold(internals, new InternalsManifold(freedom.internals[c]));
  }
  for (std::size_t v = 0; v < blocks.views.size(); ++v) pose(blocks.views[v].data(), freedom.views[v]);
  if (problem.HasParameterBlock(blocks.stage.data()))
    problem.SetManifold(blocks.stage.data(), new PoseManifold(freedom.stage->directions));
}

// BoardView poses are eliminated first. Without a free view, or with nothing else free, there is nothing to
// eliminate.
void set_solver(ceres::Solver::Options& options, const ceres::Problem& problem, Blocks& blocks) {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  const auto add = [&](double* block, int group) {
    if (!problem.HasParameterBlock(block)) return 0;
    ordering->AddElementToGroup(block, group);
    return problem.IsParameterBlockConstant(block) ? 0 : 1;
  };
  int views = 0, others = 0;
  for (PoseNumbers& view : blocks.views) views += add(view.data(), 0);
  for (PoseNumbers& camera : blocks.cameras) others += add(camera.data(), 1);
  for (Internals& internals : blocks.internals) others += add(internals.data(), 1);
  others += add(blocks.stage.data(), 1);
  const bool schur = views > 0 && others > 0;
  options.linear_solver_type = schur ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  if (schur) options.linear_solver_ordering = ordering;
}

}  // namespace

Outcome refine(State& state, std::span<const Chunk> chunks, const Freedom& freedom, const Options& options) {
  Blocks blocks(state);
  ceres::Problem problem;
  for (const Chunk& chunk : chunks) {
    const Stage* mover = mover_of(freedom, chunk.view);
    problem.AddResidualBlock(new ChunkCost(state.models[chunk.camera], chunk, mover, options.loss), nullptr,
                             blocks.internals[chunk.camera].data(), blocks.cameras[chunk.camera].data(),
                             mover != nullptr ? blocks.stage.data() : blocks.views[chunk.view].data());
  }
  set_freedom(problem, blocks, freedom);
  ceres::Solver::Options solver;
  set_solver(solver, problem, blocks);
  solver.max_num_iterations = options.max_iterations;
  // The step that ends it moved the estimate by less than a thousandth of its sigma; what remains is the
  // square of that.
  solver.function_tolerance = 1e-10;
  // Nearly Gauss-Newton from the first step: the closed-form starts are good, and a step that is not is taken
  // back.
  solver.initial_trust_region_radius = 1e8;
  solver.gradient_tolerance = 0;
  solver.parameter_tolerance = 1e-10;
  solver.max_num_consecutive_invalid_steps = 20;
  solver.logging_type = ceres::SILENT;
  Progress progress(options.progress);
  if (options.progress) solver.callbacks.push_back(&progress);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) return {};
  blocks.write(state, freedom);
  return {true, summary.termination_type == ceres::CONVERGENCE, static_cast<int>(summary.iterations.size())};
}

}  // namespace zeropose::bundle
