// A robot, a camera and a board, whose poses are known: what robot calibrations are tested on.
#pragma once

#include "calib/hand_eye.h"
#include "tests/support/poses.h"

namespace zeropose::test {

struct RobotNoise {
  double px = 0, mm = 0, deg = 0;
};

// A camera of 768 x 572 px that looks at a board of 5 x 4 points, 40 mm apart, from about 700 mm, while the
// hand turns by up to `turn_deg` about random axes.
struct RobotScene {
  HandEyeSetup setup = HandEyeSetup::eye_to_hand;
  CameraModel model;
  Pose X_FC = Pose::Identity(), X_GB = Pose::Identity();
  std::vector<Pose> X_RH;  // as they are
  double board_scale = 1;  // of the real board against its drawing

  // What robot and camera say.
  std::vector<HandEyeView> views(const RobotNoise& noise, Random& random) const;
  HandEyeProblem problem(std::span<const HandEyeView> views) const;
};
RobotScene robot_scene(HandEyeSetup setup, std::size_t views, double turn_deg, Random& random);

// The same with hand poses whose turns are about one axis of the hand.
RobotScene scene_with_one_axis(HandEyeSetup setup, std::size_t views, const Eigen::Vector3d& axis_H,
                               Random& random);

}  // namespace zeropose::test
