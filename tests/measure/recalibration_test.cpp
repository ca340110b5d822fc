// A camera that was knocked is found again: exactly without noise, at the Cramer-Rao bound with it, honestly,
// and not at all from points that cannot tell (spec 60).
#include "measure/recalibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/recalibration_scene.h"
#include "tests/support/sanitized.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::KnockedCamera;
using test::Random;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Method = RecalibrationMethod;

const int trials = test::sanitized() ? 200 : 1000;

std::vector<Distortion> both_lenses() {
  return {Division{-0.29}, BrownConrady{-0.25, 0.3, 0.001, -0.0007, 0.1}};
}

Pose small_change() { return from_six_numbers({9.86, 1.32, -7.63, 0.645, 2.097, 0.126}); }

KnockedCamera knocked(const Distortion& lens, std::vector<test::FixedPoint> layout,
                      const Pose& X_CoCn = small_change()) {
  KnockedCamera camera;
  camera.model = test::long_lens(lens);
  camera.layout = std::move(layout);
  camera.X_CoCn = X_CoCn;
  return camera;
}

std::vector<test::FixedPoint> with_plate(std::vector<test::FixedPoint> points,
                                         const std::vector<test::FixedPoint>& more) {
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

// Two plates of five points.
std::vector<test::FixedPoint> rich_plates() {
  return with_plate(test::plate("near", 220, 240, 2050, 150, 30, 5),
                    test::plate("far", 540, 320, 2950, 220, -35, 5));
}

// --- exact without noise

TEST(Recalibration, ExactWithoutNoise) {
  Random random(1);
  for (const Distortion& lens : both_lenses())
    for (const auto& [method, layout] :
         {std::pair{Method::known_points, test::six_points(2000, 3000)},
          std::pair{Method::known_points, test::three_points()},
          std::pair{Method::groups, test::two_plates()}, std::pair{Method::groups, rich_plates()}}) {
      const KnockedCamera camera = knocked(lens, layout);
      const RecalibrationResult result = camera.recalibrated(method, 0, random);
      ASSERT_EQ(result.code, Code::ok) << result.reason;
      EXPECT_TRUE(result.translation_known);
      test::expect_near(result.X_CoCn, camera.X_CoCn, 1e-4, 1e-6);
      test::expect_near(result.X_WCn, camera.X_WCo * camera.X_CoCn, 1e-4, 1e-6);
      EXPECT_LT(result.rms_px, 1e-6);
      EXPECT_THAT(result.warnings, IsEmpty());
    }
}

TEST(Recalibration, FromPosesFarAway) {
  Random random(2);
  for (int trial = 0; trial < 30; ++trial) {
    KnockedCamera camera = knocked(Division{-0.29}, test::six_points(2000, 3000));
    // The camera is where it was; what is believed about it is wrong by a lot.
    const Pose X_WC = camera.X_WCo * camera.X_CoCn;
    const auto points = camera.see(Method::known_points, 0, random);
    Vector6 far;
    far << test::uniform_vector(random, 500), test::uniform_vector(random, 0.5);
    camera.X_WCo = moved(camera.X_WCo, far);
    const RecalibrationResult result = test::recalibrated(camera, Method::known_points, points, 0);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    test::expect_near(result.X_WCn, X_WC, 1e-4, 1e-6);
    ASSERT_FALSE(result.warnings.empty());
    EXPECT_THAT(result.warnings.front(), HasSubstr("misses the pixels before"));
  }
}

TEST(Recalibration, ArbitraryPointsAreExactForAPureRotation) {
  Random random(3);
  for (const Distortion& lens : both_lenses())
    for (const std::size_t count : {2u, 6u}) {
      auto layout = test::six_points(2000, 3000);
      layout.resize(count);
      const KnockedCamera camera = knocked(lens, layout, from_six_numbers({0, 0, 0, 1.07, -1.654, 8.047}));
      const RecalibrationResult result = camera.recalibrated(Method::arbitrary_points, 0, random);
      ASSERT_EQ(result.code, Code::ok) << result.reason;
      EXPECT_FALSE(result.translation_known);
      test::expect_near(result.X_CoCn, camera.X_CoCn, 0, 1e-9);
      EXPECT_TRUE(result.covariance.topRows<3>().isZero());
    }
}

// --- noise: the bound, and honesty

struct Spread {
  Eigen::VectorXd rms;  // by component of the delta
  double inside = 0;    // share within the 95 % ellipsoid of the estimator's own covariance
};

// The last `unknowns` components of the change's delta.
Spread spread_of(const KnockedCamera& camera, Method method, double sigma_px, int unknowns) {
  const double ellipsoid_95 = unknowns == 6 ? 12.592 : 7.815;
  Random random(17);
  Spread spread{Eigen::VectorXd::Zero(unknowns), 0};
  int accused = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const RecalibrationResult result = camera.recalibrated(method, sigma_px, random);
    // One fit in a thousand accuses a point by chance.
    accused += result.code == Code::deviation_not_attributable || !result.removed.empty();
    if (result.code == Code::deviation_not_attributable) continue;
    EXPECT_EQ(result.code, Code::ok) << result.reason;
    const Eigen::VectorXd error = difference(camera.X_CoCn, result.X_CoCn).tail(unknowns);
    const Eigen::MatrixXd covariance = result.change_covariance.bottomRightCorner(unknowns, unknowns);
    spread.rms += error.cwiseAbs2() / trials;
    spread.inside += (error.dot(covariance.ldlt().solve(error)) < ellipsoid_95) / static_cast<double>(trials);
  }
  EXPECT_LE(accused, 5);
  spread.rms = spread.rms.cwiseSqrt();
  return spread;
}

void expect_at_the_bound(const KnockedCamera& camera, Method method, double sigma_px, int unknowns = 6) {
  const Spread spread = spread_of(camera, method, sigma_px, unknowns);
  const Eigen::VectorXd bound = test::cramer_rao(camera, method, sigma_px).diagonal().cwiseSqrt();
  // Three standard deviations of a root mean square of so many trials.
  const double chance = 3 / std::sqrt(2.0 * trials);
  for (int k = 0; k < unknowns; ++k) {
    EXPECT_LE(spread.rms(k), (trials >= 1000 ? 1.1 : 1 + chance) * bound(k)) << "component " << k;
    EXPECT_GE(spread.rms(k), (1 - chance) * bound(k)) << "component " << k;
  }
  EXPECT_NEAR(spread.inside, 0.95, trials >= 1000 ? 0.02 : 0.045);
}

TEST(Recalibration, KnownPointsReachTheCramerRaoBound) {
  expect_at_the_bound(knocked(both_lenses()[0], test::six_points(2000, 3000)), Method::known_points, 0.02);
  expect_at_the_bound(knocked(both_lenses()[1], test::six_points(2000, 3000)), Method::known_points, 0.1);
}

TEST(Recalibration, GroupsReachTheCramerRaoBound) {
  expect_at_the_bound(knocked(Division{-0.29}, test::two_plates()), Method::groups, 0.02);
  expect_at_the_bound(knocked(both_lenses()[1], rich_plates()), Method::groups, 0.1);
}

TEST(Recalibration, ArbitraryPointsReachTheCramerRaoBoundOfARotation) {
  const Pose turn = from_six_numbers({0, 0, 0, 0.645, 2.097, 0.126});
  for (const Distortion& lens : both_lenses())
    expect_at_the_bound(knocked(lens, test::six_points(2000, 3000), turn), Method::arbitrary_points, 0.1, 3);
}

// --- what the neglected translation does to the rotation

// A point at distance Z from a camera that was shifted by t and turned by R lies where a camera that was only
// turned by exp(e) R would see it when e x d = t / Z: for points near the axis e = (-t_y, t_x, 0) / Z.
TEST(Recalibration, NeglectedTranslationIsAWrongRotationOfTByZ) {
  Random random(5);
  const double Z_mm = 2500;
  for (const Vector3d& t : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(-2.84, 1.28, 0)}) {
    Pose change = from_six_numbers({0, 0, 0, 0.09, 0.02, 0.006});
    change.translation() = t;
    const KnockedCamera camera = knocked(
        Division{-0.29}, {test::point_at("a", 330, 250, Z_mm), test::point_at("b", 430, 320, Z_mm)}, change);
    const RecalibrationResult result = camera.recalibrated(Method::arbitrary_points, 0, random);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    const Vector3d error = difference(camera.X_CoCn, result.X_CoCn).tail<3>();
    const Vector3d expected = Vector3d(-t.y(), t.x(), 0) / Z_mm;
    EXPECT_LT((error - expected).norm(), 0.02 * expected.norm())
        << error.transpose() << "; " << expected.transpose();
  }
}

// For any layout: e = N^-1 sum J' P f with f the pixels by which the shift displaces each point.
TEST(Recalibration, NeglectedTranslationExplainsTheWholeErrorOfArbitraryPoints) {
  Random random(6);
  for (const Pose& change : {from_six_numbers({-2.84, 1.28, 0.75, 0.092, 0.02, 0.006}), small_change()}) {
    const KnockedCamera camera = knocked(Division{-0.29}, test::six_points(2000, 3000), change);
    Pose turned = change;
    turned.translation().setZero();
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Vector3d g = Vector3d::Zero();
    for (const test::FixedPoint& point : camera.layout) {
      const Vector2d f = test::photograph(camera.model, change, point.p_Co_mm) -
                         test::photograph(camera.model, turned, point.p_Co_mm);
      Eigen::Matrix<double, 2, 3> J;
      for (int k = 0; k < 3; ++k) {
        Vector6 delta = Vector6::Zero();
        delta(3 + k) = 1e-5;
        J.col(k) = (test::photograph(camera.model, moved(turned, delta), point.p_Co_mm) -
                    test::photograph(camera.model, moved(turned, -delta), point.p_Co_mm)) /
                   2e-5;
      }
      N += J.transpose() * J;
      g += J.transpose() * f;
    }
    const Vector3d expected = N.inverse() * g;
    const RecalibrationResult result = camera.recalibrated(Method::arbitrary_points, 0, random);
    ASSERT_EQ(result.code, Code::ok) << result.reason;
    const Vector3d error = difference(change, result.X_CoCn).tail<3>();
    // The weights of the two pixels' covariances differ from 1 by parts in a hundred over the picture.
    EXPECT_LT((error - expected).norm(), 0.05 * expected.norm());
    ASSERT_FALSE(result.warnings.empty());
    EXPECT_THAT(result.warnings.front(), HasSubstr("the camera was shifted as well"));
  }
}

// --- points that moved themselves

TEST(Recalibration, AKnockedPointIsNamedWhereTheRedundancySuffices) {
  Random random(7);
  struct Case {
    Method method;
    std::vector<test::FixedPoint> layout;
    std::size_t wrong;
    Pose change;
  };
  const Pose turn = from_six_numbers({0, 0, 0, 0.645, 2.097, 0.126});
  for (const Case& c : {Case{Method::known_points, test::six_points(2000, 3000), 3, small_change()},
                        Case{Method::groups, rich_plates(), 6, small_change()},
                        Case{Method::arbitrary_points, test::six_points(2000, 3000), 1, turn}})
    for (const double known_sigma_px : {0.05, 0.0}) {
      const KnockedCamera camera = knocked(Division{-0.29}, c.layout, c.change);
      auto points = camera.see(c.method, 0.05, random);
      points[c.wrong].new_px += Vector2d(6, -4);
      const RecalibrationResult result = test::recalibrated(camera, c.method, points, known_sigma_px);
      ASSERT_EQ(result.code, Code::ok) << result.reason;
      EXPECT_THAT(result.removed, ElementsAre(c.wrong));
      EXPECT_FALSE(result.deviations[c.wrong].used);
      EXPECT_GT(result.deviations[c.wrong].new_px.norm(), 4);
      const Eigen::VectorXd bound = test::cramer_rao(camera, c.method, 0.05).diagonal().cwiseSqrt();
      EXPECT_LT(test::angle_deg(result.X_CoCn, camera.X_CoCn), 6 * bound.tail(3).norm() * degrees_per_radian);
    }
}

TEST(Recalibration, FewPointsThatContradictEachOtherAreRefused) {
  Random random(8);
  auto layout = test::six_points(2000, 3000);
  layout.resize(4);
  const KnockedCamera camera = knocked(Division{-0.29}, layout);
  auto points = camera.see(Method::known_points, 0.05, random);
  points[0].new_px += Vector2d(30, 20);
  const RecalibrationResult result = test::recalibrated(camera, Method::known_points, points, 0.05);
  EXPECT_EQ(result.code, Code::deviation_not_attributable) << result.reason;
  EXPECT_THAT(result.removed, IsEmpty());
  EXPECT_THAT(result.reason, HasSubstr("contradict each other"));
}

TEST(Recalibration, SwappedPointsAreRefused) {
  Random random(9);
  auto layout = test::six_points(2000, 3000);
  layout.resize(4);
  const KnockedCamera camera = knocked(Division{-0.29}, layout);
  auto points = camera.see(Method::known_points, 0.05, random);
  std::swap(points[0].new_px, points[1].new_px);
  EXPECT_NE(test::recalibrated(camera, Method::known_points, points, 0).code, Code::ok);
}

// --- what must not give a pose

class Degenerate : public testing::Test {
 protected:
  RecalibrationResult solve(Method method, std::vector<test::FixedPoint> layout) {
    Random random(10);
    const KnockedCamera camera = knocked(Division{-0.29}, std::move(layout));
    auto points = camera.see(method, 0, random);
    if (spoil) spoil(points);
    return test::recalibrated(camera, method, points, 0.1);
  }
  std::function<void(std::vector<RecalibrationPoint>&)> spoil;
};

TEST_F(Degenerate, TooFewPoints) {
  auto layout = test::six_points(2000, 3000);
  layout.resize(2);
  EXPECT_EQ(solve(Method::known_points, layout).code, Code::too_few_marks);
  layout.resize(1);
  EXPECT_EQ(solve(Method::arbitrary_points, layout).code, Code::too_few_marks);
  EXPECT_EQ(solve(Method::groups, test::plate("one", 300, 300, 2500, 200, 30, 6)).code, Code::too_few_marks);
  auto plates = test::two_plates();
  plates.pop_back();
  const RecalibrationResult result = solve(Method::groups, plates);
  EXPECT_EQ(result.code, Code::too_few_marks);
  EXPECT_THAT(result.reason, HasSubstr("group far has 2 points"));
  EXPECT_EQ(solve(Method::arbitrary_points, {}).code, Code::too_few_marks);
}

TEST_F(Degenerate, PointsOnALine) {
  std::vector<test::FixedPoint> line;
  for (int i = 0; i < 5; ++i) {
    line.push_back(test::point_at(std::string("P").append(std::to_string(i)), 384, 286, 2000));
    line.back().p_Co_mm += (i - 2) * Vector3d(70, 20, 150);
  }
  const RecalibrationResult result = solve(Method::known_points, line);
  EXPECT_EQ(result.code, Code::geometry_degenerate);
  EXPECT_THAT(result.reason, HasSubstr("on a line"));
  spoil = [](std::vector<RecalibrationPoint>& points) {
    points[2].p_mm = 0.5 * (points[0].p_mm + points[1].p_mm);
  };
  EXPECT_EQ(solve(Method::groups, test::two_plates()).code, Code::geometry_degenerate);
}

TEST_F(Degenerate, ParallelDirections) {
  const RecalibrationResult result =
      solve(Method::arbitrary_points,
            {test::point_at("a", 300, 200, 2000), test::point_at("b", 300.1, 200.1, 3000)});
  EXPECT_EQ(result.code, Code::geometry_degenerate);
  EXPECT_THAT(result.reason, HasSubstr("parallel"));
}

TEST_F(Degenerate, NumbersThatAreNone) {
  for (const Method method : {Method::known_points, Method::arbitrary_points, Method::groups}) {
    spoil = [](std::vector<RecalibrationPoint>& points) { points[1].new_px.y() = std::nan(""); };
    RecalibrationResult result = solve(method, test::two_plates());
    EXPECT_EQ(result.code, Code::marks_invalid);
    EXPECT_THAT(result.reason, HasSubstr("P2"));
    spoil = [](std::vector<RecalibrationPoint>& points) { points[1].new_covariance_px2 << 1, 2, 2, 1; };
    EXPECT_EQ(solve(method, test::two_plates()).code, Code::marks_invalid);
  }
}

}  // namespace
}  // namespace zeropose
