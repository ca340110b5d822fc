#include "sim/hand_errors.h"

namespace zeropose {
namespace {

Vector6 drawn(double mm, double deg, std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  Vector6 delta;
  for (Eigen::Index i = 0; i < 6; ++i) delta(i) = normal(generator) * (i < 3 ? mm : deg / degrees_per_radian);
  return delta;
}

}  // namespace

HandErrors::HandErrors(const RobotErrors& sigma, std::size_t places, std::uint64_t seed)
    : sigma_(sigma), generator_(seed) {
  for (std::size_t i = 0; i < places; ++i)
    absolute_.push_back(drawn(sigma.absolute_mm, sigma.absolute_deg, generator_));
}

Pose HandErrors::true_hand(std::size_t place, const Pose& X_RH) {
  return moved(X_RH,
               absolute_.at(place) + drawn(sigma_.repeatability_mm, sigma_.repeatability_deg, generator_));
}

}  // namespace zeropose
