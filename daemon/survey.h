// A robot goes through a list of positions, says where its hand is, and at each one a camera, or both of a
// stereo sensor, look for a target: what the calibrations that need a robot and the teaching of an object are
// made from (spec 40: P1, P2, hand-eye, stereo sensor; spec 50 M2). It only gathers; calibrating is done from
// what it gathered.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "calib/rigid.h"
#include "measure/board.h"
#include "measure/body.h"
#include "measure/code.h"
#include "measure/marks.h"

namespace zeropose {

// One ball or flat disc anywhere in the picture; the search's window is not used.
struct RoundTarget {
  MarkSearch search;
};

// A board with one reading only: its frame must be the same in every picture.
struct BoardTarget {
  BoardProblem problem;
  double radius_mm = 0;  // of its circles; 0: unknown, or corners
};

// A calibration body; the marks of the problem are these.
struct BodyTarget {
  std::vector<BodyMark> marks;
  BodyProblem problem;
};

// A tool's end that touches a fixed tip: where the hand is says all, no camera looks.
struct TouchTarget {};

struct SurveyCamera {
  std::size_t index = 0;  // of the cell
  std::string name;
};

struct SurveyOptions {
  std::vector<SurveyCamera> cameras;  // all must see the target; a body is for one, a touch for none
  std::variant<RoundTarget, BoardTarget, BodyTarget, TouchTarget> target;
  int positions = 0;  // the robot counts them from 1
  // Where the hand shall go, X_RH of each position; empty: the robot's own program knows.
  std::vector<Pose> targets{};
  std::size_t robot = 0;  // of the cell, that goes to the targets
};

struct SurveyPoint {
  std::string camera;
  Eigen::Vector3d p_B_mm = Eigen::Vector3d::Zero();  // in the target's frame; of a round one zero
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double radius_mm = 0;  // of a flat round mark; 0: it is none, or its radius is not known
  Eigen::Vector3d normal_B = -Eigen::Vector3d::UnitZ();
};

struct SurveyView {
  Pose X_RH = Pose::Identity();
  std::vector<SurveyPoint> points;
};

// Why a position was not taken; nothing is changed then.
struct SurveyVerdict {
  Code code = Code::internal;
  std::string reason;  // one sentence with the numbers, empty when ok
};

class Survey {
 public:
  // Throws std::invalid_argument for options that make no sense.
  explicit Survey(const SurveyOptions& options);

  const SurveyOptions& options() const { return options_; }

  // Two pictures of every camera at one position, taken one after the other, so that a robot that still moves
  // shows; of touches none. A position that is told again takes the place of what was there.
  // Codes: argument_out_of_range, too_few_marks (the target is not in sight, or more than one),
  // not_standing_still.
  SurveyVerdict look(int position, const Pose& X_RH, std::span<const ImageView> first,
                     std::span<const ImageView> second);

  const std::map<int, SurveyView>& views() const { return views_; }
  std::vector<int> missing() const;
  // The next one to go to after this one was told, and from the end again to the first; 0: none is missing.
  int next_after(int position) const;

 private:
  SurveyOptions options_;
  std::map<int, SurveyView> views_;
};

}  // namespace zeropose
