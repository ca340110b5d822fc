// How far a robot's hand stands from where the robot says.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "calib/rigid.h"

namespace zeropose {

// One sigma per axis: each time anew, and always alike at one place.
struct RobotErrors {
  double repeatability_mm = 0.05, repeatability_deg = 0.003;
  double absolute_mm = 0.5, absolute_deg = 0.02;
};

class HandErrors {
 public:
  HandErrors(const RobotErrors& sigma, std::size_t places, std::uint64_t seed);

  // Where the hand truly is when the robot says X_RH at this place; every call draws anew.
  Pose true_hand(std::size_t place, const Pose& X_RH);

 private:
  RobotErrors sigma_;
  std::mt19937_64 generator_;
  std::vector<Vector6> absolute_;
};

}  // namespace zeropose
