// Where a stereo sensor stands or sits on a hand: the truth comes back, with an honest covariance.
#include "measure/sensor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "tests/support/poses.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::Random;

constexpr double sigma_px = 0.05;

// Two cameras 300 mm apart, turned towards each other.
std::vector<CalibratedCamera> sensor() {
  return {{"left", test::division_camera(-0.05), from_six_numbers({-150, 0, 0, 0, 9, 1})},
          {"right", test::division_camera(0.03), from_six_numbers({150, 5, 2, 1, -9, -1})}};
}

class Scene {
 public:
  explicit Scene(std::uint64_t seed) : random_(seed) {}

  void add_known(const std::string& name, const Vector3d& p_mm, double sigma_mm) {
    true_.push_back(p_mm);
    const Vector3d off(test::normal(random_), test::normal(random_), test::normal(random_));
    points.push_back({name, p_mm + sigma_mm * off, sigma_mm});
  }
  // X_FS: of the sensor in the frame that the points are known in.
  void see(std::size_t point, const Pose& X_FS, const std::string& view, const std::optional<Pose>& X_RH) {
    SensorSighting sighting{point, view, X_RH, {}};
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      Observation seen;
      seen.camera = c;
      seen.u_px = test::photograph(cameras[c].model, X_FS * cameras[c].X_WC, true_[point]);
      seen.u_px += sigma_px * Eigen::Vector2d(test::normal(random_), test::normal(random_));
      seen.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
      sighting.observations.push_back(seen);
    }
    sightings.push_back(sighting);
  }
  SensorResult calibrate() const { return calibrate_sensor({cameras, points, sightings}); }

  std::vector<CalibratedCamera> cameras = sensor();
  std::vector<KnownPoint> points;
  std::vector<SensorSighting> sightings;

 private:
  Random random_;
  std::vector<Vector3d> true_;
};

const Pose X_WS = from_six_numbers({1000, -200, 300, 120, 20, -35});
const Pose X_HS = from_six_numbers({20, -60, 110, 3, -5, 92});
const std::vector<Vector3d> places_S{
    {-100, -80, 950}, {110, -70, 1000}, {90, 80, 900}, {-90, 75, 1050}, {0, 10, 870}};

Scene stationary(std::uint64_t seed) {
  Scene scene(seed);
  for (std::size_t k = 0; k < places_S.size(); ++k) {
    scene.add_known(std::string("p").append(std::to_string(k)), X_WS * places_S[k], 0.03);
    scene.see(k, X_WS, "", {});
  }
  return scene;
}

// The point stands still in R; the hand moves so that the sensor sees it at the places above.
Scene on_hand(std::uint64_t seed, const std::vector<Vector3d>& seen_S, double turn_deg) {
  Scene scene(seed);
  const Vector3d p_R(800, 100, 50);
  for (std::size_t k = 0; k < seen_S.size(); ++k) {
    const double turn = turn_deg * double(k);
    Pose X_RS = from_six_numbers({0, 0, 0, 170 + turn, -turn / 2, 30 + 2 * turn});
    X_RS.translation() = p_R - X_RS.linear() * seen_S[k];
    // Each position errs by itself: the robot's uncertainty counts as that of the point.
    scene.add_known(std::string("tip").append(std::to_string(k)), p_R, 0.05);
    scene.see(k, X_RS, std::to_string(k + 1), X_RS * X_HS.inverse());
  }
  return scene;
}

// Share of draws whose truth lies in the 95 % ellipsoid of six numbers (12.592).
template <typename Draw>
double share_inside(const Pose& truth, int draws, const Draw& draw) {
  int inside = 0;
  for (int k = 0; k < draws; ++k) {
    const SensorResult result = draw(std::uint64_t(k) + 1);
    EXPECT_NE(result.fit.status, FrameFitStatus::collinear) << result.fit.reason;
    const Vector6 off = difference(truth, result.fit.X_AB);
    const bool counts = result.fit.status == FrameFitStatus::ok && result.fit.removed.empty();
    inside += counts && off.dot(result.fit.covariance.ldlt().solve(off)) < 12.592 ? 1 : 0;
  }
  return double(inside) / draws;
}

TEST(Sensor, StandsInTheWorldWithAnHonestCovariance) {
  const double share =
      share_inside(X_WS, 1500, [](std::uint64_t seed) { return stationary(seed).calibrate(); });
  EXPECT_GT(share, 0.93);
  EXPECT_LT(share, 0.97);
}

TEST(Sensor, SitsOnTheHandWithAnHonestCovariance) {
  const double share =
      share_inside(X_HS, 1500, [](std::uint64_t seed) { return on_hand(seed, places_S, 7).calibrate(); });
  EXPECT_GT(share, 0.93);
  EXPECT_LT(share, 0.97);
}

TEST(Sensor, NamesTheMissingMotion) {
  std::vector<Vector3d> line_S;
  for (int k = 0; k < 4; ++k) line_S.push_back({-60.0 + 40 * k, 0.5 * (-60.0 + 40 * k), 950});
  const SensorResult result = on_hand(3, line_S, 0).calibrate();
  EXPECT_EQ(result.fit.status, FrameFitStatus::collinear);
  EXPECT_NE(result.fit.reason.find("move the hand in a second direction"), std::string::npos)
      << result.fit.reason;
  const SensorResult few = on_hand(3, {places_S[0], places_S[1]}, 5).calibrate();
  EXPECT_EQ(few.fit.status, FrameFitStatus::too_few_points);
  EXPECT_NE(few.fit.reason.find("more positions of the hand"), std::string::npos) << few.fit.reason;
}

TEST(Sensor, NamesTheWrongPoint) {
  Scene scene = stationary(5);
  scene.points[3].p_mm.x() += 2;
  const SensorResult result = scene.calibrate();
  ASSERT_EQ(result.fit.status, FrameFitStatus::ok) << result.fit.reason;
  EXPECT_EQ(result.fit.removed, std::vector<std::size_t>{3});
}

TEST(Sensor, TellsWhichSightingHasNoPlace) {
  Scene scene = stationary(6);
  scene.sightings[2].observations.pop_back();
  const SensorResult result = scene.calibrate();
  EXPECT_EQ(result.fit.status, FrameFitStatus::failed);
  EXPECT_EQ(result.fit.reason.rfind("point p2: ", 0), 0u) << result.fit.reason;
}

}  // namespace
}  // namespace zeropose
