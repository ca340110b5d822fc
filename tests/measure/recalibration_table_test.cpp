// Table 5.9 built anew: errors of the three methods for the three published changes beside the published
// differences to a laser tracker, and layouts of reference points compared. Prints the figures of
// docs/recalibration.md.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/measure/recalibration_scene.h"
#include "tests/support/csv.h"
#include "tests/support/sanitized.h"

namespace zeropose {
namespace {

using test::CsvTable;
using test::KnockedCamera;
using test::Random;
using Method = RecalibrationMethod;

const int trials = test::sanitized() ? 30 : 200;

KnockedCamera knocked(const Pose& X_CoCn, std::vector<test::FixedPoint> layout) {
  KnockedCamera camera;
  camera.model = test::long_lens(Division{-0.29});
  camera.X_CoCn = X_CoCn;
  camera.layout = std::move(layout);
  return camera;
}

// Root mean square of the errors of the six numbers.
Vector6 errors_of(const KnockedCamera& camera, Method method, double sigma_px) {
  Random random(59);
  const SixNumbers truth = to_six_numbers(camera.X_CoCn);
  Vector6 squares = Vector6::Zero();
  int refused = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const RecalibrationResult result = camera.recalibrated(method, sigma_px, random);
    // By chance one in a thousand; plates of three whose tilt 0.1 px leaves open more often.
    refused += result.code != Code::ok;
    if (result.code != Code::ok) continue;
    const SixNumbers found = to_six_numbers(result.X_CoCn);
    Vector6 error;
    error << found.x_mm - truth.x_mm, found.y_mm - truth.y_mm, found.z_mm - truth.z_mm,
        found.rx_deg - truth.rx_deg, found.ry_deg - truth.ry_deg, found.rz_deg - truth.rz_deg;
    squares += error.cwiseAbs2();
  }
  EXPECT_LE(refused, trials / 20);
  return (squares / (trials - refused)).cwiseSqrt();
}

void print_row(const char* first, const char* second, const Vector6& e, bool translation) {
  std::printf("| %s | %s |", first, second);
  for (int k = 0; k < 6; ++k)
    if (k < 3 && !translation)
      std::printf(" |");
    else
      std::printf(k < 3 ? " %.3f |" : " %.4f |", e(k));
  std::printf("\n");
}

// What a row of Table 5.9 is off from the tracker's of the same change.
Vector6 published_difference(const CsvTable& table, std::size_t row, std::size_t tracker) {
  Vector6 d = Vector6::Zero();
  const char* columns[] = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};
  for (int k = 0; k < 6; ++k)
    if (!table.text(row, columns[k]).empty())
      d(k) = std::abs(table.number(row, columns[k]) - table.number(tracker, columns[k]));
  return d;
}

struct Published {
  const char* name;
  Method method;
  std::vector<test::FixedPoint> layout;
};

// Points of the published kind and number: two arbitrary ones, three known ones, two plates of three.
std::vector<Published> published_methods() {
  auto two = test::three_points();
  two.pop_back();
  return {{"two-points", Method::arbitrary_points, two},
          {"three-points", Method::known_points, test::three_points()},
          {"two-groups", Method::groups, test::two_plates()}};
}

// The published differences contain the tracker's and the calibration's errors, ours the noise of the pixels
// alone: what is left of them when the layout is good and the camera calibrated well.
TEST(TableFivePointNine, KnownPointsAndGroupsAreFarBelowThePublishedDifferences) {
  const CsvTable table("tests/golden/recalibration.csv");
  for (std::size_t row = 0, tracker = 0; row < table.size(); ++row) {
    if (table.text(row, "method") == "tracker") {
      tracker = row;
      continue;
    }
    const std::string& change = table.text(row, "change");
    const Vector6 d = published_difference(table, row, tracker);
    for (const Published& ours : published_methods()) {
      if (table.text(row, "method") != ours.name) continue;
      const bool whole = ours.method != Method::arbitrary_points;
      print_row(change.c_str(), (std::string(ours.name) + ", published").c_str(), d, whole);
      for (const double sigma_px : {0.02, 0.1}) {
        const Vector6 e = errors_of(knocked(test::pose(table, tracker), ours.layout), ours.method, sigma_px);
        print_row(change.c_str(),
                  (std::string(ours.name) + (sigma_px < 0.05 ? ", 0.02 px" : ", 0.1 px")).c_str(), e, whole);
        if (!whole) continue;
        EXPECT_LT(e.head<3>().norm(), d.head<3>().norm()) << change << " " << ours.name;
        EXPECT_LT(e.tail<3>().norm(), d.tail<3>().norm()) << change << " " << ours.name;
      }
    }
  }
}

// --- layouts

std::vector<test::FixedPoint> ring_of(int count, double near_mm, double far_mm) {
  std::vector<test::FixedPoint> points;
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * std::numbers::pi * k / count;
    points.push_back(test::point_at(std::string("P").append(std::to_string(k + 1)),
                                    383.5 + 300 * std::cos(angle), 285.5 + 220 * std::sin(angle),
                                    k % 2 == 0 ? near_mm : far_mm));
  }
  return points;
}

struct Bound {
  double shift_mm = 0, turn_deg = 0;  // root of the sum of the three variances
};

Bound bound_of(Method method, const std::vector<test::FixedPoint>& layout, double sigma_px) {
  const KnockedCamera camera = knocked(from_six_numbers({1, 1, 1, 0.05, 0.05, 0.05}), layout);
  for (const test::FixedPoint& point : layout)
    EXPECT_TRUE(in_image(camera.model, *project(camera.model, point.p_Co_mm))) << point.name;
  const Eigen::MatrixXd C = test::cramer_rao(camera, method, sigma_px);
  return {std::sqrt(C.topLeftCorner<3, 3>().trace()),
          std::sqrt(C.bottomRightCorner<3, 3>().trace()) * degrees_per_radian};
}

Bound print_bound(const char* name, Method method, const std::vector<test::FixedPoint>& layout) {
  const Bound good = bound_of(method, layout, 0.02), bad = bound_of(method, layout, 0.1);
  std::printf("| %s | %.3f mm %.4f deg | %.3f mm %.4f deg |\n", name, good.shift_mm, good.turn_deg,
              bad.shift_mm, bad.turn_deg);
  return bad;
}

// The bounds are reached (recalibration_test.cpp), so layouts are compared by them.
TEST(Layouts, DepthDecides) {
  const Method known = Method::known_points;
  const Bound flat = print_bound("6 points, all at 2500 mm", known, ring_of(6, 2500, 2500));
  const Bound little = print_bound("6 points, 2400 and 2600 mm", known, ring_of(6, 2400, 2600));
  const Bound deep = print_bound("6 points, 2000 and 3000 mm", known, ring_of(6, 2000, 3000));
  const Bound deeper = print_bound("6 points, 1500 and 3500 mm", known, ring_of(6, 1500, 3500));
  const Bound four = print_bound("4 points, 2000 and 3000 mm", known, ring_of(4, 2000, 3000));
  const Bound twelve = print_bound("12 points, 2000 and 3000 mm", known, ring_of(12, 2000, 3000));
  const Bound near = print_bound("6 points, 1000 and 1500 mm", known, ring_of(6, 1000, 1500));
  auto plates = test::two_plates();
  const Bound two_plates =
      print_bound("2 plates of 3, 150 and 220 mm, 2050 and 2950 mm", Method::groups, plates);
  plates = test::plate("near", 220, 240, 2050, 150, 30, 5);
  for (const auto& point : test::plate("far", 540, 320, 2950, 220, -35, 5)) plates.push_back(point);
  print_bound("2 plates of 5, the same places", Method::groups, plates);
  plates = test::plate("near", 220, 240, 2050, 60, 30);
  for (const auto& point : test::plate("far", 540, 320, 2950, 80, -35)) plates.push_back(point);
  const Bound small_plates = print_bound("2 plates of 3, 60 and 80 mm", Method::groups, plates);
  plates = test::plate("near", 220, 240, 2400, 150, 30);
  for (const auto& point : test::plate("far", 540, 320, 2600, 180, -35)) plates.push_back(point);
  const Bound flat_plates =
      print_bound("2 plates of 3, 150 and 180 mm, 2400 and 2600 mm", Method::groups, plates);

  EXPECT_GT(flat.shift_mm, 3 * deep.shift_mm);
  EXPECT_GT(little.shift_mm, 2 * deep.shift_mm);
  EXPECT_LT(deeper.shift_mm, deep.shift_mm);
  EXPECT_LT(twelve.shift_mm, four.shift_mm);
  EXPECT_LT(near.shift_mm, deep.shift_mm);
  EXPECT_GT(small_plates.shift_mm, two_plates.shift_mm);
  EXPECT_GT(flat_plates.shift_mm, two_plates.shift_mm);
  // The published 0.5 mm and 0.01 degrees at their best.
  EXPECT_LT(deep.shift_mm, 0.5);
  EXPECT_LT(deep.turn_deg, 0.01);
}

}  // namespace
}  // namespace zeropose
