// The parts of calibrate_hand_eye(). Internal to calib.
//
// F is the frame that the camera is fixed to, G that of the board: hand and base (eye in hand) or base and
// hand. In both setups X_FGi X_GB = X_FC X_CBi.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/hand_eye.h"
#include "calib/point_fit.h"
#include "calib/views_bundle.h"

namespace zeropose::hand_eye {

using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

struct State {
  Pose X_FC = Pose::Identity(), X_GB = Pose::Identity();
};

// A view whose board was found.
struct SeenView {
  std::size_t index = 0;  // in HandEyeProblem::views
  Pose X_RH = Pose::Identity(), X_CB = Pose::Identity();
  std::vector<bundle::SeenPoint> points;
  Matrix6 cofactor = Matrix6::Zero();  // covariance of X_CB for a sigma of 1 px
  double cost = 0;                     // of X_CB: whitened squares
  double squares_px2 = 0;              // of X_CB: of the used points' deviations
};

// Of one component of moved(X_RH), and of a pixel.
struct Noise {
  double px = 0, mm = 0, rad = 0;
};
inline constexpr double usual_robot_mm = 0.05, usual_robot_deg = 0.01;

Pose X_FG_of(HandEyeSetup setup, const Pose& X_RH);

// The pose of the board in one view, free of the marks' eccentricity. Fills the result's fields that belong
// to the view alone; nullopt where there is none, with the reason there. near: where several poses explain
// the picture.
std::optional<SeenView> look(const HandEyeProblem& problem, std::size_t view,
                             const std::optional<Pose>& X_CB_near, HandEyeViewResult& result);

// --- start

struct Loop {
  Pose X_FG = Pose::Identity(), X_CB = Pose::Identity();
};
std::vector<Loop> loops_of(HandEyeSetup setup, std::span<const SeenView> views);

// Closed form; also for turns of 180 degrees. Precondition: turns about two axes.
State closed_form(std::span<const Loop> loops);

// Of a loop: X_FG X_GB beside X_FC X_CB, mm and rad along F's axes.
Vector6 error_of(const State& state, const Loop& loop);

// The closed form that most loops agree with: of all, or of all but one.
State robust_start(std::span<const Loop> loops);

// --- equations

// One view at a state: e found minus predicted as delta of moved(X_CB) and its derivatives' negatives.
struct ViewTerms {
  Vector6 e;
  Matrix6 cofactor;     // of e by the pixels, for 1 px
  Matrix6x12 by_state;  // d predicted / d (moved(X_FC), moved(X_GB))
  Matrix6 by_robot;     // d predicted / d moved(X_RH)
  Vector6 by_scale;     // d predicted / d scale of the board, as the pose that looks the same
};
Pose predicted(HandEyeSetup setup, const State& state, const Pose& X_RH);
// From X_CB of the view alone.
ViewTerms pose_terms(HandEyeSetup setup, const State& state, const SeenView& view);
// From the reprojection errors of the prediction; nullopt: a point has no image.
std::optional<ViewTerms> pixel_terms(const CameraModel& model, HandEyeSetup setup, const State& state,
                                     const SeenView& view);
Matrix6 covariance_of(const ViewTerms& terms, const Noise& noise);

// The views as points of a fit: pose_terms() whitened with the covariances at the start.
std::unique_ptr<PointEquations> equations_at(HandEyeSetup setup, std::span<const SeenView> views,
                                             const State& start, const Noise& noise);
State state_of(const PointFit& fit);  // precondition: the fit is one of such equations

// --- refinement

struct Refined {
  bool converged = false;
  State state;
  Noise noise;
  Eigen::Matrix<double, 12, 12> covariance = Eigen::Matrix<double, 12, 12>::Zero();
  double scale = 1, scale_sigma = 0;
  double degrees = 0;  // of freedom of the covariance, where the robot's noise was estimated
};
// Gauss-Newton on the reprojection errors from a state that is near; estimates the robot's noise on the way
// where it is asked for.
Refined refine(const CameraModel& model, HandEyeSetup setup, std::span<const SeenView> views,
               const State& start, const Noise& noise, bool estimate_robot);

// --- doubts

// What would explain that the views contradict each other: another reading of the poses, the other setup,
// views in another order, another scale of the board. Empty: nothing known. `views` are all whose board was
// found.
std::string explanation(const HandEyeProblem& problem, std::span<const SeenView> views);

// Of views that were taken out: two whose robot poses are swapped.
std::vector<std::string> swapped_views(const HandEyeProblem& problem, std::span<const SeenView> views,
                                       const State& state, std::vector<std::size_t> removed);

}  // namespace zeropose::hand_eye
