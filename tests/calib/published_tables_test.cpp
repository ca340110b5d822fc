// Poses and internals against the published tables (tests/golden/README.md).
#include <gtest/gtest.h>

#include <cmath>

#include "calib/data_sheet.h"
#include "calib/rigid.h"
#include "tests/support/csv.h"
#include "tests/support/poses.h"

namespace zeropose {
namespace {

using test::CsvTable;

constexpr double sy_mm = 0.008325;  // JAI CV-M50

TEST(PublishedTables, CameraInWorldIsBodyInWorldTimesCameraInBody) {
  const CsvTable body("tests/golden/body-in-world.csv"), in_body("tests/golden/camera-in-body.csv"),
      in_world("tests/golden/camera-in-world.csv");
  ASSERT_EQ(in_world.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(in_world.text(i, "camera"));
    const Pose X_WC = test::pose(body, i) * test::pose(in_body, i);
    test::expect_six_near(to_six_numbers(X_WC), test::six_numbers(in_world, i), 0.05, 0.002);
  }
}

TEST(PublishedTables, InternalsAsTheDataSheetStatesThem) {
  const CsvTable in_body("tests/golden/camera-in-body.csv"), in_world("tests/golden/camera-in-world.csv");
  for (std::size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(in_world.text(i, "camera"));
    const CameraModel camera{768,
                             572,
                             in_body.number(i, "fx_px"),
                             in_body.number(i, "fy_px"),
                             in_body.number(i, "cx_px"),
                             in_body.number(i, "cy_px"),
                             Division{in_body.number(i, "K")}};
    const DataSheet sheet = data_sheet(camera, sy_mm);
    // Half a unit of the last printed digit, and what the rounding of Sy to 6 digits leaves open.
    EXPECT_NEAR(sheet.f_mm, in_world.number(i, "f_mm"), 0.0075);
    EXPECT_NEAR(sheet.sx_mm, in_world.number(i, "Sx_mm"), 1.01e-6);
    EXPECT_EQ(sheet.sy_mm, in_world.number(i, "Sy_mm"));
    EXPECT_NEAR(sheet.k_per_mm2, in_world.number(i, "k_per_mm2"), 5.5e-7);
    EXPECT_NEAR(sheet.origin_from_centre_px.x(), in_world.number(i, "cx_from_centre_px"), 0.0101);
    EXPECT_NEAR(sheet.origin_from_centre_px.y(), in_world.number(i, "cy_from_centre_px"), 0.0101);
  }
}

TEST(PublishedTables, BrownHasNoK) {
  const CameraModel camera{768, 572, 4200, 4200, 384, 286, BrownConrady{0.1, 0, 0, 0, 0}};
  EXPECT_EQ(data_sheet(camera, sy_mm).k_per_mm2, 0);
}

// Rows 3 (z) and 10 (rz) of Table 5.1 are misprinted: only with these values does Table 5.2 follow.
Pose mono_pose(const CsvTable& table, std::size_t row) {
  SixNumbers six = test::six_numbers(table, row);
  if (table.text(row, "position") == "3") six.z_mm = 262.53;
  if (table.text(row, "position") == "10") six.rz_deg = -135.9412;
  return from_six_numbers(six);
}

TEST(PublishedTables, MonoRelativePosesFollowFromTheAbsoluteOnes) {
  const CsvTable absolute("tests/golden/mono-15-poses.csv"), relative("tests/golden/mono-15-relative.csv");
  ASSERT_EQ(relative.size(), 15u);
  const Pose X_T0C = mono_pose(absolute, 0);
  for (std::size_t i = 0; i < 15; ++i) {
    SCOPED_TRACE(relative.text(i, "position"));
    const Pose X_T0Ti = X_T0C * mono_pose(absolute, i).inverse();
    test::expect_six_near(to_six_numbers(X_T0Ti), test::six_numbers(relative, i), 0.01, 0.0002);
  }
}

TEST(PublishedTables, RelativePoseOfTheShiftedCar) {
  const CsvTable table("tests/golden/zero-and-shift.csv");
  const Pose X_WO0 = test::pose(table, 0), X_WO = test::pose(table, 1);
  // All four rows are rounded to 0.01.
  test::expect_six_near(to_six_numbers(X_WO0.inverse() * X_WO), test::six_numbers(table, 2), 0.0151, 0.0151);
}

}  // namespace
}  // namespace zeropose
