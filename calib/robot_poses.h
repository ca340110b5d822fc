// The poses of a robot's hand that a calibration is made from: whether they turn enough, and as what else
// than X_RH in mm and degrees they may have been written down.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// How the hand's orientations differ. Each direction fixed to the hand is moved by the turns, one least of
// all; where all turns are about one axis it is that axis, and it is not moved.
struct HandTurns {
  double least = 0;  // root mean square distance of that unit vector's places from their mean
  double next = 0;   // the same of the direction across it that is moved least
  Eigen::Vector3d axis_H = Eigen::Vector3d::UnitZ();  // the direction, in the hand
  Eigen::Vector3d axis_R = Eigen::Vector3d::UnitZ();  // and its mean place, in the robot's base
};
HandTurns turns_of(std::span<const Pose> X_RH);

// The turns are about at least two axes, by about a degree and more.
bool turns_suffice(const HandTurns& turns);

// What is missing where they do not suffice: which turns stay open, and the motion to add. `what` stays
// undetermined along the axis: "the tool's end".
std::string missing_turn(const HandTurns& turns, const std::string& what);

// A warning where they suffice but are so small that noise counts many times; empty where they are large.
std::string small_turns(const HandTurns& turns);

// p and c of R_i p + d_i = c for all i by least squares; R_i and d_i are the rotation and translation of the
// poses. Along directions that stay open p is 0.
struct FixedPoint {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero(), c_mm = Eigen::Vector3d::Zero();
};
FixedPoint fixed_point(std::span<const Pose> poses);

// As what the poses may have been written down.
enum class Reading { as_expected, inverse, radians, metres, metres_and_radians };
std::vector<Pose> read_as(std::span<const Pose> X_RH, Reading reading);

// The sentence's end: "the poses look like ...".
std::string words_of(Reading reading);

// The reading by which the poses fit ten times better than as expected and within `plausible`; as_expected
// where there is none. The misfit is any figure that is small where the poses fit; nullopt: none can be
// computed.
using Misfit = std::function<std::optional<double>(std::span<const Pose> X_RH)>;
Reading better_reading(std::span<const Pose> X_RH, const Misfit& misfit, double plausible);

// Warnings about units from the size of the numbers alone.
std::vector<std::string> doubtful_units(std::span<const Pose> X_RH);

// 3 x 3 x 3 poses of the hand for a ball grid (spec 40 P2): from the first one on in steps along the axes of
// the robot's base, or of the hand. x runs fastest.
std::vector<Pose> ball_grid(const Pose& X_RH_first, const Eigen::Vector3d& step_mm, bool along_hand);

// Unit vector as text: (0.00, 0.00, 1.00).
std::string direction_text(const Eigen::Vector3d& direction);

}  // namespace zeropose
