// Calibration of one camera, or of a rig of cameras together, from several views of a board or body whose
// poses need not be known (spec 30, "Multi-image"). Start: Z. Zhang, "A flexible new technique for camera
// calibration", 2000; then all parameters together by least squares (bundle adjustment).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

// A point of the board (p_W_mm and disc_normal_W are in the board's frame B) as a camera saw it in a view.
struct ViewPoint {
  std::size_t view = 0, camera = 0;
  CalibrationPoint point;
};

struct ViewsCamera {
  std::string name;
  int width_px = 0, height_px = 0;
  LensModel lens = LensModel::division;
  std::optional<CameraModel> start;  // internals to begin with
  ParameterSet fixed;      // internals held at the start's values; without one: origin in the image centre,
                           // lens 0. The pose cannot be held.
  bool one_focal = false;  // fx = fy
};

struct BoardView {
  std::string name;
  std::optional<Pose> X_WB;  // known
};

// Known poses take the board's axes for those of the stage that moves it. check: so does the answer, and says
// what the points say. estimate: a constant X_BS (StageEstimate) is found together with everything else; only
// the first known view then stands exactly where its pose says.
enum class StageAxes { check, estimate };

// Frame W: that of the known poses X_WB; where none is known, the first camera (X_WC = identity).
struct ViewsProblem {
  std::span<const ViewsCamera> cameras;
  std::span<const BoardView> views;
  std::span<const ViewPoint> points;
  double sigma_px = 0;   // of one pixel coordinate, scales the covariances; 0: from the residuals
  double reject_px = 0;  // points with a larger deviation are thrown out, worst first; 0: never
  double robust = 0;     // Cauchy's loss, this many sigmas wide (with identity covariances: px); 0: none
  StageAxes stage = StageAxes::check;
  int max_iterations = 100;
  std::function<void(int iteration, double cost)> progress;  // cost: half the sum of squares
};

struct CameraEstimate {
  CameraModel model;
  Pose X_WC = Pose::Identity();
  ParameterCovariance internals;              // of the free ones, in the order fx fy cx cy K | k1 k2 p1 p2 k3
  Matrix6 pose_covariance = Matrix6::Zero();  // of the delta of moved(X_WC); zero for the frame W itself
  double rms_px = 0;
};

struct ViewEstimate {
  Pose X_WB = Pose::Identity();  // one camera and no known poses: X_CB
  Matrix6 covariance = Matrix6::Zero();
  double rms_px = 0;
  std::size_t points_used = 0;
};

// The stage's axes S in the board, of which known poses say that they are the board's:
// X_WB = X_WB1 X_BS X_S1S X_BS^-1 with the first known pose X_WB1 and the stage's motion X_S1S.
struct StageEstimate {
  bool held = false;    // the answer takes X_BS for the identity; this is what the points say about that
  std::string unknown;  // why they do not tell X_BS and what would help, in one sentence; empty: they do
  Pose X_BS = Pose::Identity();
  // Of the delta of moved(X_BS). Along what the motions do not show (one direction: the turn about it, and
  // any shift) it is zero, and X_BS is the identity.
  Matrix6 covariance = Matrix6::Zero();
  int unknowns = 0;   // of six, that the motions show
  double chance = 1;  // of a fit so much better where X_BS is the identity
  double rms_px = 0;  // of the fit with X_BS
  // Held: by how many of its own sigmas a number of the answer would move at most, were X_BS estimated.
  double answer_moves_sigmas = 0;
};
// "rx 0.198 (sigma 0.008), ry -0.221 (sigma 0.029) deg": of the turns that the motions show.
std::string turn_text(const StageEstimate& stage);

struct ViewsResult {
  CalibrationStatus status = CalibrationStatus::failed;
  std::string reason;                   // one sentence with the numbers, empty when ok
  std::vector<CameraEstimate> cameras;  // empty unless ok, like views
  std::vector<ViewEstimate> views;
  double sigma_px = 0;      // of one coordinate: as given, or from the residuals
  double rms_px = 0;        // root of the mean squared point distance, over the points used
  double residual_sum = 0;  // weighted squares, over the points used
  std::vector<CalibrationDeviation> deviations;  // in the order of the points
  std::vector<std::size_t> rejected;             // in the order in which they were thrown out
  std::optional<StageEstimate> stage;            // none: no two known poses that differ
  int iterations = 0;
  CalibrationDiagnosis diagnosis;
};

ViewsResult calibrate_views(const ViewsProblem& problem);

}  // namespace zeropose
