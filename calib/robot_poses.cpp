#include "calib/robot_poses.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/symmetric_eigen.h"
#include "calib/words.h"

namespace zeropose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double least_spread = 0.01;  // a turn of a degree: errors count a hundred times
constexpr double small_spread = 0.1;   // of eleven degrees: ten times
constexpr double largest_metres = 5;   // no robot keeps its hand so near to its base, in mm
constexpr double full_turn_rad = 6.3;  // and no angle in radians is larger
constexpr double clearly_better = 0.1;

Matrix3d mean_rotation(std::span<const Pose> poses) {
  Matrix3d sum = Matrix3d::Zero();
  for (const Pose& pose : poses) sum += pose.linear() / static_cast<double>(poses.size());
  return sum;
}

Matrix3d spread_of(std::span<const Pose> poses, const Matrix3d& mean) {
  Matrix3d sum = Matrix3d::Zero();
  for (const Pose& pose : poses)
    sum += (pose.linear() - mean).transpose() * (pose.linear() - mean) / static_cast<double>(poses.size());
  return sum;
}

Pose with_radians(const Pose& X_RH) {
  SixNumbers six = to_six_numbers(X_RH);
  six.rx_deg *= degrees_per_radian, six.ry_deg *= degrees_per_radian, six.rz_deg *= degrees_per_radian;
  return from_six_numbers(six);
}

Pose with_metres(Pose X_RH) {
  X_RH.translation() *= 1000;
  return X_RH;
}

double largest_coordinate(std::span<const Pose> poses) {
  double largest = 0;
  for (const Pose& pose : poses) largest = std::max(largest, pose.translation().cwiseAbs().maxCoeff());
  return largest;
}

double largest_angle_deg(std::span<const Pose> poses) {
  double largest = 0;
  for (const Pose& pose : poses) {
    const SixNumbers six = to_six_numbers(pose);
    largest = std::max({largest, std::abs(six.rx_deg), std::abs(six.ry_deg), std::abs(six.rz_deg)});
  }
  return largest;
}

}  // namespace

HandTurns turns_of(std::span<const Pose> X_RH) {
  HandTurns turns;
  if (X_RH.empty()) return turns;
  const Matrix3d mean = mean_rotation(X_RH);
  const SymmetricEigen eigen = symmetric_eigen(spread_of(X_RH, mean));
  turns.least = std::sqrt(std::max(0.0, eigen.values(0)));
  turns.next = std::sqrt(std::max(0.0, eigen.values(1)));
  turns.axis_H = eigen.vectors.col(0);
  Eigen::Index largest = 0;
  turns.axis_H.cwiseAbs().maxCoeff(&largest);
  if (turns.axis_H(largest) < 0) turns.axis_H = -turns.axis_H;
  const Vector3d place = mean * turns.axis_H;
  turns.axis_R = place.norm() > 0 ? Vector3d(place.normalized()) : turns.axis_H;
  return turns;
}

bool turns_suffice(const HandTurns& turns) { return turns.least >= least_spread; }

std::vector<Pose> ball_grid(const Pose& X_RH_first, const Eigen::Vector3d& step_mm, bool along_hand) {
  std::vector<Pose> poses;
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d way = Eigen::Vector3d(i % 3, i / 3 % 3, i / 9).cwiseProduct(step_mm);
    Pose& X_RH = poses.emplace_back(X_RH_first);
    X_RH.translation() += along_hand ? X_RH.linear() * way : way;
  }
  return poses;
}

std::string direction_text(const Vector3d& direction) {
  std::string text;
  for (int k = 0; k < 3; ++k) {
    const std::string one = number(std::abs(direction(k)) < 0.005 ? 0.0 : direction(k));
    text += (text.empty() ? "(" : ", ") + one;
  }
  return text + ")";
}

std::string missing_turn(const HandTurns& turns, const std::string& what) {
  if (turns.next < least_spread)
    return "the hand has all but the same orientation in all poses, which leaves " + what +
           " open; turn it by 30 degrees and more, about two axes across each other";
  return "the hand turns about one axis only, " + direction_text(turns.axis_R) + " in the robot's base and " +
         direction_text(turns.axis_H) + " in the hand; " + what +
         " stays open along it; add poses that are turned by 30 degrees and more about an axis across it, "
         "e.g. " +
         direction_text(turns.axis_H.unitOrthogonal()) + " in the hand";
}

std::string small_turns(const HandTurns& turns) {
  if (turns.least >= small_spread) return {};
  return "the hand turns little about axes across " + direction_text(turns.axis_H) +
         " in the hand (by about " + number(2 * std::asin(turns.least) * degrees_per_radian, 1) +
         " degrees): errors count many times along it; turn it by 30 degrees and more";
}

FixedPoint fixed_point(std::span<const Pose> poses) {
  const Matrix3d mean = mean_rotation(poses);
  const auto count = static_cast<double>(poses.size());
  Vector3d offset = Vector3d::Zero(), right = Vector3d::Zero();
  for (const Pose& pose : poses) offset += pose.translation() / count;
  for (const Pose& pose : poses)
    right -= (pose.linear() - mean).transpose() * (pose.translation() - offset) / count;
  const SymmetricEigen eigen = symmetric_eigen(spread_of(poses, mean));
  FixedPoint fixed;
  for (int k = 0; k < 3; ++k)
    if (eigen.values(k) > 1e-14)
      fixed.p_mm += eigen.vectors.col(k) * (eigen.vectors.col(k).dot(right) / eigen.values(k));
  fixed.c_mm = mean * fixed.p_mm + offset;
  return fixed;
}

std::vector<Pose> read_as(std::span<const Pose> X_RH, Reading reading) {
  std::vector<Pose> poses(X_RH.begin(), X_RH.end());
  for (Pose& pose : poses) {
    if (reading == Reading::inverse) pose = pose.inverse();
    if (reading == Reading::radians || reading == Reading::metres_and_radians) pose = with_radians(pose);
    if (reading == Reading::metres || reading == Reading::metres_and_radians) pose = with_metres(pose);
  }
  return poses;
}

std::string words_of(Reading reading) {
  switch (reading) {
    case Reading::inverse:
      return "X_HR, not X_RH (the robot's base in its hand)";
    case Reading::radians:
      return "angles in radians, expected degrees";
    case Reading::metres:
      return "positions in metres, expected mm";
    case Reading::metres_and_radians:
      return "metres and radians, expected mm and degrees";
    default:
      return "X_RH in mm and degrees";
  }
}

Reading better_reading(std::span<const Pose> X_RH, const Misfit& misfit, double plausible) {
  Reading best = Reading::as_expected;
  double limit = plausible;
  if (const auto expected = misfit(X_RH)) limit = std::min(limit, clearly_better * *expected);
  for (const Reading reading :
       {Reading::inverse, Reading::radians, Reading::metres, Reading::metres_and_radians}) {
    const auto found = misfit(read_as(X_RH, reading));
    if (!found || !(*found < limit)) continue;
    limit = *found;
    best = reading;
  }
  return best;
}

std::vector<std::string> doubtful_units(std::span<const Pose> X_RH) {
  std::vector<std::string> doubts;
  if (X_RH.empty()) return doubts;
  const double coordinate = largest_coordinate(X_RH), angle = largest_angle_deg(X_RH);
  if (coordinate < largest_metres && coordinate > 0)
    doubts.push_back("no coordinate of the hand is larger than " + number(coordinate, 3) +
                     " mm: positions look like metres, expected mm");
  if (angle < full_turn_rad && angle > 0 && X_RH.size() > 2)
    doubts.push_back("no angle of the hand is larger than " + number(angle, 3) +
                     " degrees: angles look like radians, expected degrees");
  return doubts;
}

}  // namespace zeropose
