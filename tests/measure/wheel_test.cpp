// From the six images of a wheel to camber and toe, and what is refused on the way.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/measure/wheel_scene.h"

namespace zeropose::test {
namespace {

using Eigen::Vector3d;

constexpr double aim_deg = 0.05;

class Wheel : public ::testing::Test {
 protected:
  // One sensor rendered anew, after the test has changed the cell.
  WheelResult with_fault(const WheelCell& cell, std::size_t sensor) {
    CleanPictures pictures = clean();
    render_sensor(cell, X_WO(), sensor, pictures);
    return measured(cell, exposed(pictures, noise_));
  }
  static const WheelCell& cell() {
    static const WheelCell cell = wheel_cell(example_tyres()[1]);
    return cell;
  }
  static Pose X_WO() { return tilted_wheel(-1.2, 0.8); }
  static const CleanPictures& clean() {
    static const CleanPictures pictures = rendered(cell(), X_WO());
    return pictures;
  }
  static void expect_true(const WheelResult& result) {
    ASSERT_EQ(result.status, WheelStatus::ok) << result.reason;
    EXPECT_NEAR(result.camber_rad * degrees_per_radian, -1.2, aim_deg);
    EXPECT_NEAR(result.toe_rad * degrees_per_radian, 0.8, aim_deg);
  }
  static void expect_refused(const WheelResult& result, LineArrayStatus order, const std::string& words) {
    EXPECT_EQ(result.status, WheelStatus::lines_not_ordered) << result.reason;
    EXPECT_EQ(result.order, order) << name_of(result.order) << ": " << result.reason;
    EXPECT_NE(result.reason.find(words), std::string::npos) << result.reason;
    EXPECT_NE(result.reason.find("s2 left"), std::string::npos) << result.reason;  // which camera
  }

  std::uint64_t noise_ = 7;
};

TEST_F(Wheel, AnglesCentreAndRadius) {
  const WheelResult result = measured(cell(), exposed(clean(), noise_));
  expect_true(result);
  EXPECT_EQ(result.order, LineArrayStatus::ok);
  EXPECT_EQ(result.lines.size(), 9U);
  EXPECT_EQ(result.profile.size(), 9U);
  // The profile's circle lies before or behind O's origin, along the axis.
  const Vector3d off = X_WO().inverse() * result.X_WO.translation();
  EXPECT_LT(off.head<2>().norm(), 0.3);
  EXPECT_LT(result.sigma_camber_rad * degrees_per_radian, 0.01);
}

TEST_F(Wheel, OfAnyTyreAndShifted) {
  for (const std::size_t tyre : {0, 2}) {
    const WheelCell other = wheel_cell(example_tyres()[tyre]);
    const Pose X_WO = tilted_wheel(1.6, -2.5, {5, -4, -6});
    const WheelResult result = measured(other, exposed(rendered(other, X_WO), noise_));
    ASSERT_EQ(result.status, WheelStatus::ok) << other.tyre.name << ": " << result.reason;
    EXPECT_NEAR(result.camber_rad * degrees_per_radian, 1.6, aim_deg) << other.tyre.name;
    EXPECT_NEAR(result.toe_rad * degrees_per_radian, -2.5, aim_deg) << other.tyre.name;
    const Vector3d off = X_WO.inverse() * result.X_WO.translation();
    EXPECT_LT(off.head<2>().norm(), 0.3) << other.tyre.name;
  }
}

// There z of W, x forward and y up as well, points into the wheel: the same pictures in that frame V.
TEST_F(Wheel, OnTheOtherSideOfTheCar) {
  const WheelPictures pictures = exposed(clean(), noise_);
  std::vector<WheelSensor> sensors = sensors_of(cell(), pictures);
  const Pose X_VW = from_six_numbers({0, 0, 0, 0, 180, 0});
  for (WheelSensor& sensor : sensors) {
    sensor.left.X_WC = X_VW * sensor.left.X_WC;
    sensor.right.X_WC = X_VW * sensor.right.X_WC;
    sensor.angle_rad = 180 / degrees_per_radian - sensor.angle_rad;
  }
  WheelProblem problem;
  problem.sensors = sensors;
  problem.tyre = expected(cell().tyre);
  const WheelResult result = measure_wheel(problem);
  ASSERT_EQ(result.status, WheelStatus::ok) << result.reason;
  EXPECT_NEAR(result.camber_rad * degrees_per_radian, 1.2, aim_deg);  // x is turned round, y is not
  EXPECT_NEAR(result.toe_rad * degrees_per_radian, 0.8, aim_deg);
}

TEST_F(Wheel, AgainstItself_IsZero) {
  const WheelPictures pictures = exposed(clean(), noise_);
  const WheelResult zero = measured(cell(), pictures);
  ASSERT_EQ(zero.status, WheelStatus::ok) << zero.reason;
  const WheelResult again = measured(cell(), pictures, zero.X_WO, zero.profile_radius_mm);
  ASSERT_EQ(again.status, WheelStatus::ok) << again.reason;
  EXPECT_NEAR(again.camber_rad, 0, 1e-12);
  EXPECT_NEAR(again.toe_rad, 0, 1e-12);
}

TEST_F(Wheel, MissingLinesAreNamed) {
  struct Missing {
    std::size_t line;
    LineArrayStatus order;
    const char* words;
  };
  const Missing all[] = {{0, LineArrayStatus::radial_missing, "left or the middle one is missing"},
                         {1, LineArrayStatus::radial_missing, "left or the middle one is missing"},
                         {2, LineArrayStatus::radial_missing, "the right one is missing"},
                         {first_across, LineArrayStatus::across_missing, "2 of 3 lines across"},
                         {first_across + 1, LineArrayStatus::across_missing, "the control line is missing"},
                         {first_across + 2, LineArrayStatus::across_missing, "2 of 3 lines across"}};
  for (const Missing& missing : all) {
    WheelCell faulty = cell();
    faulty.projectors[1].lines[missing.line].brightness = 0;
    expect_refused(with_fault(faulty, 1), missing.order, missing.words);
  }
}

TEST_F(Wheel, LinesTooManyAreAmbiguous) {
  WheelCell radial = cell();
  ProjectedLine between = radial.projectors[1].lines[0];
  between.n_P = (between.n_P + radial.projectors[1].lines[1].n_P).normalized();
  radial.projectors[1].lines.push_back(between);
  expect_refused(with_fault(radial, 1), LineArrayStatus::order_ambiguous, "4 radial lines");
  WheelCell across = cell();
  ProjectedLine other = across.projectors[1].lines[first_across];
  other.n_P = (other.n_P + across.projectors[1].lines[first_across + 1].n_P).normalized();
  across.projectors[1].lines.push_back(other);
  expect_refused(with_fault(across, 1), LineArrayStatus::order_ambiguous, "4 lines across");
  WheelCell controls = cell();  // another line reaches the right one
  controls.projectors[1].lines[first_across].to = controls.projectors[1].lines[first_across + 1].to;
  expect_refused(with_fault(controls, 1), LineArrayStatus::order_ambiguous, "2 lines cross all three");
}

// A bright line between two pixels, as wide as the projector's.
void draw_line(std::vector<float>& picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr double sigma_px = 1.7, grey = 60;
  const Eigen::Vector2d along = (to - from).normalized(), across(-along.y(), along.x());
  for (int v = 0; v < 572; ++v)
    for (int u = 0; u < 768; ++u) {
      const Eigen::Vector2d off = Eigen::Vector2d(u, v) - from;
      if (off.dot(along) < 0 || off.dot(along) > (to - from).norm()) continue;
      const double beside = off.dot(across) / sigma_px;
      picture[static_cast<std::size_t>(v) * 768 + static_cast<std::size_t>(u)] +=
          static_cast<float>(grey * std::exp(-beside * beside / 2));
    }
}

// Edges of what stands beyond the tyre cross each other too. Only another whole array is ambiguous.
TEST_F(Wheel, LinesBeyondTheTyreAreLeftOut) {
  CleanPictures pictures = clean();
  std::vector<float>& picture = pictures[2];
  for (const double v : {30.0, 80.0}) draw_line(picture, {20, v}, {140, v});
  for (const double u : {40.0, 80.0}) draw_line(picture, {u, 10}, {u, 100});
  expect_true(measured(cell(), exposed(pictures, noise_)));
  draw_line(picture, {20, 55}, {160, 55});
  draw_line(picture, {150, 10}, {150, 100});
  expect_refused(measured(cell(), exposed(pictures, noise_)), LineArrayStatus::order_ambiguous,
                 "one is too many");
}

TEST_F(Wheel, WrongOrderIsNamed) {
  WheelCell mirrored = cell();  // the others stop before the left line instead
  for (const std::size_t line : {first_across, first_across + 2}) {
    ProjectedLine& across = mirrored.projectors[1].lines[line];
    across = {across.n_P, across.along_P, -across.to, -across.from, 1};
  }
  expect_refused(with_fault(mirrored, 1), LineArrayStatus::wrong_order, "is the left one");
  WheelCell control = cell();  // the outer line crosses all three, the middle one stops
  std::swap(control.projectors[1].lines[first_across].to, control.projectors[1].lines[first_across + 1].to);
  expect_refused(with_fault(control, 1), LineArrayStatus::wrong_order, "is not line 2");
  WheelCell cut = cell();  // the control line stops as well: nothing crosses the right one
  cut.projectors[1].lines[first_across + 1].to = cut.projectors[1].lines[first_across].to;
  expect_refused(with_fault(cut, 1), LineArrayStatus::radial_missing, "2 of 3 radial lines");
}

TEST_F(Wheel, DirtOnLinesIsNamed) {
  WheelCell crossing = cell();  // the middle line and the control line
  crossing.stains[1] = {{place_before(crossing, 1, 262, 0), 7, 0.03}};
  expect_refused(with_fault(crossing, 1), LineArrayStatus::crossing_missing, "covered");
  WheelCell spots = cell();  // a quarter of the left line, in spots that it is joined over
  const double left_mm = -std::tan(8 / degrees_per_radian);
  for (const double radius_mm : {224.0, 236.5, 287.0, 299.0})
    spots.stains[1].push_back({place_before(spots, 1, radius_mm, radius_mm * left_mm), 3.8, 0.03});
  CleanPictures pictures = clean();
  render_sensor(spots, X_WO(), 1, pictures);
  const WheelPictures seen = exposed(pictures, noise_);
  LineArrayProblem array;
  array.image = sensors_of(spots, seen)[1].left_image;
  EXPECT_EQ(order_lines(array).status, LineArrayStatus::ok);
  array.min_share_seen = 0.85;
  const LineArrayResult dirty = order_lines(array);
  EXPECT_EQ(dirty.status, LineArrayStatus::too_dirty) << dirty.reason;
  EXPECT_NE(dirty.reason.find("% of the left radial line"), std::string::npos) << dirty.reason;
  WheelCell broken = cell();  // the inner third of the left line
  broken.stains[1] = {{place_before(broken, 1, 236, 236 * left_mm), 17, 0.03}};
  const WheelResult result = with_fault(broken, 1);
  EXPECT_EQ(result.status, WheelStatus::lines_not_ordered) << result.reason;
}

TEST_F(Wheel, DirtOnAProfileTakesAnotherOneOrIsNamed) {
  WheelCell dirty = cell();  // the outer ridge on the middle line of the second sensor
  dirty.stains[1] = {{place_before(dirty, 1, 284, 0), 3, 0.03}};
  CleanPictures pictures = clean();
  render_sensor(dirty, X_WO(), 1, pictures);
  const WheelPictures seen = exposed(pictures, noise_);
  const WheelResult other = measured(dirty, seen);
  expect_true(other);
  EXPECT_GT(std::abs(other.profile_radius_mm - 284), 8);
  const WheelResult wanted = measured(dirty, seen, {}, 284.2);
  EXPECT_EQ(wanted.status, WheelStatus::no_common_profile) << wanted.reason;
  EXPECT_NE(wanted.reason.find("the middle radial line of sensor s2"), std::string::npos) << wanted.reason;
}

// On the ridge that is used, 235 mm: 1.2 mm are 1.2 / 0.15 * sqrt(0.6) = 6 sigmas. What is not noticed, 0.3
// mm at one of nine points, turns the plane by about 0.3 * 235 / (4.5 * 235^2) rad = 0.016 degrees.
TEST_F(Wheel, ALumpIsNamedOrSmall) {
  for (const double height_mm : {0.3, 1.2}) {
    WheelCell lumpy = cell();
    lumpy.tyre.lumps = {{place_before(lumpy, 1, 235, 0), height_mm, 4}};
    CleanPictures pictures = clean();
    render_sensor(lumpy, X_WO(), 1, pictures);
    const WheelResult result = measured(lumpy, exposed(pictures, noise_), {}, 235);
    if (height_mm < 1) {
      expect_true(result);
      continue;
    }
    EXPECT_EQ(result.status, WheelStatus::contradiction) << result.reason;
    EXPECT_NE(result.reason.find("the middle radial line of sensor s2"), std::string::npos) << result.reason;
  }
}

TEST_F(Wheel, SwappedImagesDoNotMeet) {
  WheelPictures pictures = exposed(clean(), noise_);
  std::swap(pictures[2], pictures[3]);
  const WheelResult result = measured(cell(), pictures);
  EXPECT_EQ(result.status, WheelStatus::pairs_disagree) << result.reason;
  EXPECT_NE(result.reason.find("sensor s2"), std::string::npos) << result.reason;
}

TEST_F(Wheel, BeyondItsRangeIsRefused) {
  const WheelPictures pictures = exposed(clean(), noise_);
  const std::vector<WheelSensor> sensors = sensors_of(cell(), pictures);
  WheelProblem problem;
  problem.sensors = sensors;
  problem.tyre = expected(cell().tyre);
  problem.max_tilt_rad = 1.0 / degrees_per_radian;  // it is tilted by 1.4
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::out_of_range);
}

TEST_F(Wheel, TooLittleOfALineIsNamed) {
  const WheelPictures pictures = exposed(clean(), noise_);
  const std::vector<WheelSensor> sensors = sensors_of(cell(), pictures);
  WheelProblem problem;
  problem.sensors = sensors;
  problem.tyre.min_radius_mm = 254, problem.tyre.max_radius_mm = 268;  // 14 mm of 0.35 mm, less a crossing
  const WheelResult result = measure_wheel(problem);
  EXPECT_EQ(result.status, WheelStatus::line_too_short) << result.reason;
  EXPECT_NE(result.reason.find("left radial line"), std::string::npos) << result.reason;
}

TEST_F(Wheel, NonsenseIsRefused) {
  const WheelPictures pictures = exposed(clean(), noise_);
  std::vector<WheelSensor> sensors = sensors_of(cell(), pictures);
  WheelProblem problem;
  problem.tyre = expected(cell().tyre);
  problem.sensors = std::span(sensors).first(2);
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::wrong_problem);
  problem.sensors = sensors;
  problem.tyre.max_radius_mm = problem.tyre.min_radius_mm;
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::wrong_problem);
  problem.tyre = expected(cell().tyre);
  problem.layout.control = 3;
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::wrong_problem);
  problem.layout = {};
  sensors[1].angle_rad += 1;  // its cameras look elsewhere
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::wrong_problem);
  sensors[1].angle_rad -= 1;
  sensors[1].left_image.data = nullptr;
  EXPECT_EQ(measure_wheel(problem).status, WheelStatus::wrong_problem);
  EXPECT_EQ(WheelResult{}.status, WheelStatus::failed);
}

}  // namespace
}  // namespace zeropose::test
