// The ways to deliver a correction, and robots on an axis (spec 50 M7): whatever is sent, the tool reaches
// the same place. What a robot does with it is worked out here with plain matrices.
#include <gtest/gtest.h>

#include "measure/correction.h"
#include "tests/support/cell_scene.h"

namespace zeropose {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using test::CellScene;
using test::Random;

Vector4d homogeneous(const Vector3d& p) { return {p.x(), p.y(), p.z(), 1}; }

// Rows of [R | p] from Euler's formula for an axis and an angle; no code of the product.
Matrix4d matrix_of(const Vector3d& axis, double angle_deg, const Vector3d& p) {
  const double angle = angle_deg / 57.29577951308232, c = std::cos(angle), s = std::sin(angle);
  const Vector3d k = axis / axis.norm();
  Matrix4d X = Matrix4d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      X(row, column) = k(row) * k(column) * (1 - c) + (row == column ? c : 0);
  X(0, 1) -= k.z() * s, X(0, 2) += k.y() * s, X(1, 0) += k.z() * s;
  X(1, 2) -= k.x() * s, X(2, 0) -= k.y() * s, X(2, 1) += k.x() * s;
  X.topRightCorner<3, 1>() = p;
  return X;
}

Pose pose_of(const Matrix4d& X) {
  Pose pose = Pose::Identity();
  pose.matrix() = X;
  return pose;
}

// A base that stands askew: at least 10 degrees about every axis.
Matrix4d askew_base() {
  return matrix_of({0, 0, 1}, 75, {1800, -2600, 350}) * matrix_of({0, 1, 0}, -14, {0, 0, 0}) *
         matrix_of({1, 0, 0}, 23, {0, 0, 0});
}

// A robot with a programme taught at the zero: one point in its base's frame.
struct TaughtRobot {
  Matrix4d X_WR;
  Vector4d p_R0;   // taught
  Matrix4d X_RO0;  // the user frame it was taught in

  // Where its tool goes in the world when it is sent X in that frame.
  Vector3d goes_to(CorrectionFrame frame, const Matrix4d& X) const {
    const Matrix4d X_RW = X_WR.inverse();
    const Vector4d p_O = X_RO0.inverse() * p_R0;
    Vector4d p_R = Vector4d::Zero();
    if (frame == CorrectionFrame::object_zero) p_R = X_RO0 * X * p_O;
    if (frame == CorrectionFrame::world_shift) p_R = X_RW * X * X_WR * p_R0;
    if (frame == CorrectionFrame::robot_base_shift) p_R = X * p_R0;
    if (frame == CorrectionFrame::user_frame) p_R = X * p_O;
    return (X_WR * p_R).head<3>();
  }
};

constexpr CorrectionFrame all_frames[] = {CorrectionFrame::object_zero, CorrectionFrame::world_shift,
                                          CorrectionFrame::robot_base_shift, CorrectionFrame::user_frame};

// A cell whose drawing is wrong by millimetres, with its zero.
struct CompensatedCell {
  CellScene scene = test::car_body();
  Pose X_WO0_true = from_six_numbers({15, -8, 5, 0.1, 0.2, -0.15});
  Job drawn = scene.job;
  ZeroResult zero;

  explicit CompensatedCell(Random& random) {
    for (Mark& mark : drawn.marks) mark.p_O_mm += test::uniform_vector(random, 2);
    const std::vector<std::vector<Observation>> frames = {observed(X_WO0_true, random)};
    zero = make_zero(scene.cameras, drawn, frames);
  }
  std::vector<Observation> observed(const Pose& X_WO, Random& random) const {
    return test::observe(scene.cameras, scene.job, X_WO, 0, random);
  }
  PoseResult measured(const Pose& X_WO, Random& random) const {
    const auto observations = observed(X_WO, random);
    const Job now = compensated(drawn, zero.zero);
    return estimate_pose(test::problem_of(scene.cameras, now, observations, zero.zero.X_WO0));
  }
};

TEST(Delivery, EveryFrameBringsTheToolToTheSamePlace) {
  Random random(1);
  const CompensatedCell cell(random);
  ASSERT_EQ(cell.zero.code, Code::ok) << cell.zero.reason;
  const Pose& X_WO0 = cell.zero.zero.X_WO0;
  const Matrix4d X_WR = askew_base();
  for (int trial = 0; trial < 50; ++trial) {
    const Pose X_WO_true = cell.X_WO0_true * test::random_shift(random, 30, 0.4);
    const PoseResult pose = cell.measured(X_WO_true, random);
    ASSERT_EQ(pose.code, Code::ok) << pose.reason;
    const Vector3d p_W0 = cell.X_WO0_true * Vector3d(test::uniform(random, -500, 3000), 700, 200);
    const TaughtRobot robot{X_WR, X_WR.inverse() * homogeneous(p_W0), X_WR.inverse() * X_WO0.matrix()};
    std::vector<Vector3d> places_W;
    for (const CorrectionFrame frame : all_frames)
      places_W.push_back(robot.goes_to(frame, correction(frame, pose_of(X_WR), X_WO0, pose.X_WO).matrix()));
    for (const Vector3d& p_W : places_W) EXPECT_LT((p_W - places_W.front()).norm(), 1e-8);
    // The drawing's 2 mm, turned by 0.4 deg and seen from 30 mm further at 2.5 m: 0.04 mm.
    const Vector3d p_W_true = X_WO_true * (cell.X_WO0_true.inverse() * p_W0);
    EXPECT_LT((places_W.front() - p_W_true).norm(), 0.1);
    EXPECT_GT((p_W_true - p_W0).norm(), 1);
  }
}

// The same correction taken for one in another frame ends elsewhere: what the test above would not forgive.
TEST(Delivery, InAWrongFrameEndsElsewhere) {
  Random random(2);
  const Matrix4d X_WR = askew_base();
  const Pose X_WO0 = from_six_numbers({500, 200, 100, 5, -3, 12});
  const Pose X_WO = X_WO0 * from_six_numbers({20, -10, 5, 0.3, -0.2, 0.4});
  const TaughtRobot robot{X_WR, X_WR.inverse() * homogeneous({1500, 300, 200}),
                          X_WR.inverse() * X_WO0.matrix()};
  const auto sent = [&](CorrectionFrame frame) {
    return correction(frame, pose_of(X_WR), X_WO0, X_WO).matrix();
  };
  const Vector3d right = robot.goes_to(CorrectionFrame::world_shift, sent(CorrectionFrame::world_shift));
  for (const CorrectionFrame taken : all_frames)
    for (const CorrectionFrame given : all_frames) {
      const double off_mm = (robot.goes_to(taken, sent(given)) - right).norm();
      EXPECT_EQ(off_mm < 1e-8, taken == given) << off_mm;
    }
}

const LinearAxis axis{Vector3d(0.96, 0.28, 0), 250};

TEST(LinearAxis, AtItsZeroIsWhereTheBaseWasTaught) {
  const Pose X_WR = pose_of(askew_base());
  EXPECT_EQ(base_at(axis, X_WR, 250).matrix(), X_WR.matrix());
  const Pose away = base_at(axis, X_WR, 1250);
  EXPECT_EQ(away.linear(), X_WR.linear());
  EXPECT_LT((away.translation() - X_WR.translation() - Vector3d(960, 280, 0)).norm(), 1e-9);
}

// D_R(e + d) = T^-1 D_R(e) T with T the way of the base in its own frame.
TEST(LinearAxis, CarriesTheShiftOfTheBaseAlong) {
  Random random(3);
  const Pose X_WR = pose_of(askew_base());
  for (int trial = 0; trial < 50; ++trial) {
    const Pose X_WO0 = test::uniform_pose(random, 3000), X_WO = X_WO0 * test::random_shift(random, 30, 0.4);
    const double from_mm = test::uniform(random, -5000, 5000), way_mm = test::uniform(random, -5000, 5000);
    const auto D_R = [&](double position_mm) {
      return correction(CorrectionFrame::robot_base_shift, base_at(axis, X_WR, position_mm), X_WO0, X_WO);
    };
    Pose T = Pose::Identity();
    T.translation() = way_mm * (X_WR.linear().transpose() * axis.direction_W);
    test::expect_near(D_R(from_mm + way_mm), T.inverse() * D_R(from_mm) * T, 1e-8, 1e-9);
    // What has no base in it does not care where the base is.
    for (const auto frame : {CorrectionFrame::object_zero, CorrectionFrame::world_shift})
      EXPECT_EQ(correction(frame, base_at(axis, X_WR, from_mm), X_WO0, X_WO).matrix(),
                correction(frame, X_WR, X_WO0, X_WO).matrix());
  }
}

// Taught with the base at one place of the axis, used at another.
TEST(LinearAxis, ToolReachesTheShiftedObjectFromEveryPosition) {
  Random random(4);
  const Matrix4d X_WR = askew_base();
  for (int trial = 0; trial < 50; ++trial) {
    const double position_mm = test::uniform(random, -4000, 4000);
    const Pose X_WO0 = test::uniform_pose(random, 2000), X_WO = X_WO0 * test::random_shift(random, 30, 0.4);
    const Vector3d p_O = test::uniform_vector(random, 1500);
    Matrix4d X_WR_now = X_WR;
    X_WR_now.topRightCorner<3, 1>() += (position_mm - 250) * Vector3d(0.96, 0.28, 0);
    const TaughtRobot robot{X_WR_now, X_WR_now.inverse() * homogeneous(X_WO0 * p_O),
                            X_WR_now.inverse() * X_WO0.matrix()};
    for (const CorrectionFrame frame : all_frames) {
      const Pose sent = correction(frame, base_at(axis, pose_of(X_WR), position_mm), X_WO0, X_WO);
      EXPECT_LT((robot.goes_to(frame, sent.matrix()) - X_WO * p_O).norm(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace zeropose
