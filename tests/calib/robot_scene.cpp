#include "tests/calib/robot_scene.h"

#include "tests/support/synthetic_camera.h"

namespace zeropose::test {
namespace {

using Eigen::Vector3d;

// The hand so that the camera has the board at X_CB.
Pose hand_for(const RobotScene& scene, const Pose& X_CB) {
  const Pose X_FG = scene.X_FC * X_CB * scene.X_GB.inverse();
  return scene.setup == HandEyeSetup::eye_to_hand ? X_FG : X_FG.inverse();
}

Pose board_before_camera(const Eigen::Matrix3d& turn, Random& random) {
  Pose X_CB = Pose::Identity();
  X_CB.linear() = turn * Eigen::AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  X_CB.translation() =
      Vector3d(uniform(random, -70, 70), uniform(random, -50, 50), uniform(random, 600, 850)) -
      X_CB.linear() * Vector3d(80, 60, 0);
  return X_CB;
}

RobotScene bare_scene(HandEyeSetup setup, Random& random) {
  RobotScene scene;
  scene.setup = setup;
  scene.model = division_camera(-0.2);
  const bool in_hand = setup == HandEyeSetup::eye_in_hand;
  scene.X_FC = uniform_pose(random, in_hand ? 100 : 900);
  scene.X_GB = uniform_pose(random, in_hand ? 900 : 100);
  return scene;
}

Vector6 robot_error(const RobotNoise& noise, Random& random) {
  Vector6 delta;
  for (int k = 0; k < 6; ++k) delta(k) = normal(random, k < 3 ? noise.mm : noise.deg / degrees_per_radian);
  return delta;
}

}  // namespace

RobotScene robot_scene(HandEyeSetup setup, std::size_t views, double turn_deg, Random& random) {
  RobotScene scene = bare_scene(setup, random);
  for (std::size_t v = 0; v < views; ++v) {
    const Vector3d axis = uniform_vector(random, 1).normalized();
    // The board must not be seen from the side or from behind; about the line of sight it turns further.
    const double angle = uniform(random, 0.5, 1) * turn_deg / degrees_per_radian;
    Vector3d turn = angle * axis;
    turn.z() *= 2;
    scene.X_RH.push_back(hand_for(scene, board_before_camera(exp_so3(turn), random)));
  }
  return scene;
}

RobotScene scene_with_one_axis(HandEyeSetup setup, std::size_t views, const Vector3d& axis_H,
                               Random& random) {
  RobotScene scene = robot_scene(setup, views, 20, random);
  for (Pose& X_RH : scene.X_RH)
    X_RH.linear() = scene.X_RH.front().linear() * exp_so3(uniform(random, -0.3, 0.3) * axis_H.normalized());
  return scene;
}

std::vector<HandEyeView> RobotScene::views(const RobotNoise& noise, Random& random) const {
  std::vector<HandEyeView> seen;
  for (std::size_t v = 0; v < X_RH.size(); ++v) {
    const Pose X_FG = setup == HandEyeSetup::eye_to_hand ? X_RH[v] : X_RH[v].inverse();
    const Pose X_BC = (X_FG * X_GB).inverse() * X_FC;
    std::vector<Vector3d> points;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 5; ++column)
        points.push_back(board_scale * Vector3d(40 * column, 40 * row, 0));
    HandEyeView view{std::to_string(v + 1), moved(X_RH[v], robot_error(noise, random)),
                     photograph(model, X_BC, points, noise.px, random)};
    for (CalibrationPoint& point : view.points) point.p_W_mm /= board_scale;
    seen.push_back(view);
  }
  return seen;
}

HandEyeProblem RobotScene::problem(std::span<const HandEyeView> views) const {
  HandEyeProblem problem;
  problem.model = model;
  problem.setup = setup;
  problem.views = views;
  return problem;
}

}  // namespace zeropose::test
