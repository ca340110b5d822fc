// The truth of the wheel-alignment cell: where the projectors' lines fall, and what may be wrong before a
// sensor.
#include "sim/wheel_object.h"

#include <gtest/gtest.h>

#include <cmath>

#include "config/config_error.h"
#include "example_cells.h"
#include "sim/renderer.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;

const WheelObject& wheel_of(const Scene& scene) { return std::get<WheelObject>(scene.object); }

const WheelSensorTruth& sensor(const Scene& scene, std::size_t i) { return wheel_of(scene).sensors[i]; }

// Whether a point of the nominal wheel's plane lies in the plane of a line, and between its ends.
bool lit(const Scene& scene, const WheelSensorTruth& truth, std::size_t line, double radius_mm,
         double angle_rad) {
  const Vector3d p_N(radius_mm * std::cos(angle_rad), radius_mm * std::sin(angle_rad), 0);
  const Vector3d p_P = truth.projector.X_WP.inverse() * scene.X_WO_nominal * p_N;
  const ProjectedLine& l = truth.projector.lines[line];
  const double along = l.along_P.dot(p_P) / p_P.z();
  return std::abs(l.n_P.dot(p_P)) < 0.01 && along > l.from && along < l.to;
}

TEST(WheelTruth, RadialLinesPointToTheAxisAndOneLineAcrossReachesAll) {
  const Scene scene = test::example("wheel-alignment");
  ASSERT_EQ(wheel_of(scene).sensors.size(), 3u);
  constexpr double apart = 8 / degrees_per_radian;
  for (std::size_t i = 0; i < 3; ++i) {
    const WheelSensorTruth& truth = sensor(scene, i);
    ASSERT_EQ(truth.projector.lines.size(), 6u);
    for (const double radius_mm : {220.0, 265.0, 310.0})
      for (std::size_t line = 0; line < 3; ++line)
        EXPECT_TRUE(lit(scene, truth, line, radius_mm, truth.angle_rad + (1.0 - double(line)) * apart))
            << i << line;
    // Straight across the middle line: at the radius there, further out beside it.
    const double aside = std::tan(apart);
    for (const auto& [line, reaches] : {std::pair<std::size_t, bool>{3, false}, {4, true}, {5, false}}) {
      const double radius_mm = std::array{276, 262, 248}[line - 3], out_mm = radius_mm * std::hypot(1, aside);
      EXPECT_TRUE(lit(scene, truth, line, radius_mm, truth.angle_rad));
      EXPECT_TRUE(lit(scene, truth, line, out_mm, truth.angle_rad + apart));
      EXPECT_EQ(lit(scene, truth, line, out_mm, truth.angle_rad - apart), reaches);
    }
  }
}

TEST(WheelTruth, FaultsHaveASensorAKindAndANumber) {
  const Scene scene = test::example("wheel-alignment");
  const auto fault = wheel_fault(wheel_of(scene), "rear line 6");
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->sensor, 1u);
  EXPECT_EQ(fault->number, 6u);
  EXPECT_TRUE(wheel_fault(wheel_of(scene), "top dirt 99"));
  for (const char* text :
       {"top", "top dirt", "top line 0", "top line 7", "side dirt 1", "top mud 1", "top dirt 1 2"})
    EXPECT_FALSE(wheel_fault(wheel_of(scene), text)) << text;
}

// A dark line changes the pictures of its own sensor's cameras, dirt those of the cameras that see it.
TEST(WheelTruth, FaultsAreSeenBeforeTheirSensorAlone) {
  const Scene scene = test::example("wheel-alignment");
  for (const char* text : {"front line 2", "front dirt 3"}) {
    Faults faults;
    faults.covered.insert(text);
    for (std::size_t camera = 0; camera < 6; ++camera) {
      const CameraRenderer renderer(scene, camera);
      const bool same =
          renderer.clean_picture(scene.X_WO_nominal) == renderer.clean_picture(scene.X_WO_nominal, faults);
      EXPECT_EQ(same, camera < 4) << text << ' ' << camera;
    }
  }
}

TEST(WheelTruth, IsRefusedWhereCellAndTruthDoNotFit) {
  const Cell marks = load_cell(test::cells + "press-shop.json");
  Cell wheel = load_cell(test::cells + "wheel-alignment.json");
  const Scene scene = test::example("wheel-alignment");
  WheelObject object;
  object.tyre = wheel_of(scene).tyre;
  EXPECT_THROW(complete(object, marks.jobs.front(), scene.cameras), ConfigError);
  wheel.jobs.front().wheel->layout.across = 4;
  EXPECT_THROW(complete(object, wheel.jobs.front(), scene.cameras), ConfigError);
  EXPECT_THROW(
      load_scenes(load_cell(test::cells + "wheel-alignment.json"), test::cells + "press-shop.sim.json"),
      ConfigError);
}

}  // namespace
}  // namespace zeropose
