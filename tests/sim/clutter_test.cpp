#include "sim/clutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "example_cells.h"
#include "sim/backdrop.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;

// The shapes, as sets of points: inside by definition against the sign of the distance.
TEST(Shapes, SignedDistanceIsNegativeInside) {
  const Shape box =
      rounded_box({10, 5}, std::numbers::pi / 2, {4, 2}, 1);  // upright: 2 wide, 4 high, each way
  EXPECT_NEAR(signed_distance_mm(box, {10, 5}), -2, 1e-12);
  EXPECT_NEAR(signed_distance_mm(box, {10, 12}), 3, 1e-12);
  EXPECT_NEAR(signed_distance_mm(box, {13, 5}), 1, 1e-12);
  EXPECT_NEAR(signed_distance_mm(box, {12, 9}), std::numbers::sqrt2 - 1, 1e-12);  // the rounded corner
  EXPECT_NEAR(signed_distance_mm(disc({1, 2}, 3), {1, 7}), 2, 1e-12);
  const Shape nut = hexagon({0, 0}, 0, 5);
  EXPECT_NEAR(signed_distance_mm(nut, {6, 0}), 1, 1e-12);
  EXPECT_NEAR(signed_distance_mm(nut, {0, 10 / std::numbers::sqrt3}), 0, 1e-12);  // a corner
  const Shape half = half_disc({0, 0}, 0, 5);
  EXPECT_NEAR(signed_distance_mm(half, {0, 4}), -1, 1e-12);
  EXPECT_NEAR(signed_distance_mm(half, {0, -2}), 2, 1e-12);
}

// Painting skips pixels by it: no distance may change by more than the way gone.
TEST(Shapes, SignedDistanceChangesNoMoreThanTheWayGone) {
  Random random(1);
  for (const Shape& shape : {rounded_box({3, -2}, 0.4, {30, 6}, 2), disc({1, 1}, 7), hexagon({0, 2}, 0.3, 9),
                             half_disc({0, 0}, 1, 8)}) {
    for (int trial = 0; trial < 2000; ++trial) {
      const Vector2d a(random.uniform(-40, 40), random.uniform(-40, 40));
      const Vector2d b = a + Vector2d(random.uniform(-5, 5), random.uniform(-5, 5));
      EXPECT_LE(std::abs(signed_distance_mm(shape, a) - signed_distance_mm(shape, b)),
                (a - b).norm() + 1e-12);
      if ((a - shape.centre_mm).norm() > bounding_radius_mm(shape)) {
        EXPECT_GT(signed_distance_mm(shape, a), 0);
      }
    }
  }
}

bool is_disc(const Shape& shape) {
  return shape.kind == ShapeKind::rounded_box && shape.half_mm.x() == shape.half_mm.y() &&
         shape.corner_mm > 0.5 * shape.half_mm.x();
}

TEST(Clutter, IsNeverADarkDiscOfAMarksSize) {
  constexpr double base_grey = 95, smallest_mark_mm = 10;
  Random random(1);
  int dark_discs = 0;
  for (int piece = 0; piece < 4000; ++piece) {
    for (const Thing& thing : make_clutter(piece, base_grey, random)) {
      if (!is_disc(thing.shape) || thing.paint.grey > base_grey) continue;
      ++dark_discs;
      EXPECT_LT(thing.shape.half_mm.x(), 0.3 * smallest_mark_mm);
    }
  }
  EXPECT_GE(dark_discs, 500);  // the small holes
}

TEST(Clutter, PlacesAreFree) {
  const CameraModel camera{768, 572, 4000, 4000, 384, 286, Division{}};
  std::vector<Taken> taken{{{200, 200}, 60}};
  Random random(3);
  for (int piece = 0; piece < 20; ++piece) {
    const auto place = free_place(camera, 20, taken, random);
    ASSERT_TRUE(place);
    for (const Taken& other : taken) EXPECT_GE((other.centre_px - *place).norm(), other.radius_px + 20);
    taken.push_back({*place, 20});
  }
  taken.push_back({{384, 286}, 1000});
  EXPECT_FALSE(free_place(camera, 20, taken, random));
}

TEST(Clutter, SomeMovesWithTheObjectAndSomeStands) {
  const Scene scene = test::car_body();
  Scene bare = scene;
  bare.picture.clutter = 0;
  for (std::size_t camera = 0; camera < 4; ++camera) {
    const Backdrop full = make_backdrop(scene, camera), empty = make_backdrop(bare, camera);
    EXPECT_GE(full.in_front.size(), 2U) << camera;
    EXPECT_TRUE(empty.in_front.empty());
    EXPECT_GE(full.on_object.back().things.size(), empty.on_object.back().things.size() + 5) << camera;
  }
}

}  // namespace
}  // namespace zeropose
