// The least squares behind calibrate_views(): all internals and poses together. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/camera_model.h"
#include "calib/views_stage.h"

namespace zeropose::bundle {

struct SeenPoint {
  Eigen::Vector3d p_B_mm;
  Eigen::Vector2d u_px;    // without the eccentricity of a disc
  Eigen::Matrix2d whiten;  // lower triangular, whiten^T whiten = inverse covariance
  std::size_t index = 0;   // in ViewsProblem::points
};

// What one camera sees in one view.
struct Chunk {
  std::size_t view = 0, camera = 0;
  std::vector<SeenPoint> points;
};

struct State {
  std::vector<CameraModel> models;
  std::vector<Pose> X_WC, X_WB;
  Pose X_BS = Pose::Identity();  // see Stage; X_WB has it in it
};

// What may move: for every camera the directions in which its internals may (9 x n, orthogonal columns).
struct Freedom {
  std::vector<Eigen::MatrixXd> internals;
  std::vector<bool> cameras, views;  // their poses
  std::optional<Stage> stage = {};   // its X_BS; none: known poses are held as they are
};

// The stage, if it moves this view's board.
inline const Stage* mover_of(const Freedom& freedom, std::size_t view) {
  return freedom.stage && freedom.stage->moves(view) ? &*freedom.stage : nullptr;
}

// The equations of a chunk by the 9 internals and the 6 of moved(X_CB), as sums over its points:
// sums = [J r]^T [J r] with r = projected - found, whitened and weighted by the loss.
inline constexpr int columns = internals_count + 6;
struct Equations {
  Eigen::Matrix<double, columns + 1, columns + 1> sums;
  double cost = 0;  // sum of the losses (without one: of the squares)
};

// nullopt: a point has no image. loss: Cauchy's, so many sigmas wide; 0: none.
std::optional<Equations> equations_of(const CameraModel& model, const Pose& X_CB,
                                      std::span<const SeenPoint> points, double loss);
std::optional<double> cost_of(const CameraModel& model, const Pose& X_CB, std::span<const SeenPoint> points,
                              double loss);

// The cost of all chunks; infinite when a point has no image.
double cost_of(const State& state, std::span<const Chunk> chunks, double loss);

// d moved(X_CB) / d moved(X_WC) and / d moved(X_WB) for X_CB = X_WC^-1 X_WB.
Matrix6 by_camera(const Pose& X_WC, const Pose& X_WB);
Matrix6 by_view(const Pose& X_WC);

inline constexpr int trial_iterations = 30;  // of an attempt that another one follows
struct Options {
  double loss = 0;
  int max_iterations = 100;
  std::function<void(int iteration, double cost)> progress;
};

struct Outcome {
  bool usable = false;  // false: the start has no finite cost
  bool converged = false;
  int iterations = 0;
};

// Levenberg-Marquardt with the view poses eliminated (Ceres, DENSE_SCHUR, one thread) from state on; leaves
// the estimate there.
Outcome refine(State& state, std::span<const Chunk> chunks, const Freedom& freedom, const Options& options);

}  // namespace zeropose::bundle
