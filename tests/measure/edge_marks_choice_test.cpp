// Edges, corners, slots and crosses: every reason, what lies over and beside them, what must not be taken.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <source_location>

#include "measure/edge_marks.h"
#include "tests/support/outline_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::drawing_of;
using test::expose;
using test::find_shape;
using test::paint;
using test::Pixels;
using test::Polygon;
using test::PolygonDrawing;
using test::search_of;
using test::ShapeScene;

constexpr double pi = std::numbers::pi, noise = 2;

Vector2d unit(double angle) { return {std::cos(angle), std::sin(angle)}; }

ShapeScene edge_scene(double offset = 0.3, double angle = 0.4) {
  return {MarkKind::edge, {offset, angle}, 60};
}
ShapeScene corner_scene(double opening = pi / 2) {
  return {MarkKind::corner, {0.2, -0.3, 0.5, 0.5 + opening}, 60};
}
ShapeScene slot_scene(double angle = 0.5, double r = 7, double half = 10 / 7.0) {
  return {
      MarkKind::slot,
      {0.2, 0.1, r * std::cos(angle), r * std::sin(angle), -r * std::sin(angle), r * std::cos(angle), half},
      60};
}
ShapeScene cross_scene() { return {MarkKind::cross, {0.3, -0.2, 0.3, 0.3 + pi / 2, 4, 22, 22, 22, 22}, 60}; }
const std::array<ShapeScene, 4> every_scene{edge_scene(), corner_scene(), slot_scene(), cross_scene()};

Pixels pixels_of(const PolygonDrawing& drawing, unsigned seed = 3) {
  std::mt19937_64 random(seed);
  return expose(paint(drawing), noise, random);
}
MarkFinding find_in(const PolygonDrawing& drawing, const MarkSearch& search, unsigned seed = 3) {
  return find_shape(pixels_of(drawing, seed).view(), search);
}

// A rectangle about a place: half its sides along and across a direction.
Polygon block(const Vector2d& at, double angle, double along, double across, double grey) {
  const Vector2d a = along * unit(angle), b = across * unit(angle + pi / 2);
  return {{at - a - b, at + a - b, at + a + b, at - a + b}, grey};
}

double error_of(const MarkFinding& finding, const ShapeScene& scene) {
  const Vector2d off = finding.u_px - scene.truth_px();
  if (scene.kind != MarkKind::edge) return std::sqrt(off.dot(finding.covariance_px2.inverse() * off));
  const Vector2d n = unit(finding.direction_rad);
  return std::abs(off.dot(n)) / std::sqrt(n.dot(finding.covariance_px2 * n));
}

void expect_status(const MarkFinding& finding, MarkStatus wanted,
                   std::source_location at = std::source_location::current()) {
  EXPECT_EQ(name_of(finding.status), name_of(wanted)) << "line " << at.line();
}

// Four and a half sigma of one or two coordinates: one in 10^4 or less.
constexpr double most_sigmas = 4.5;

// Two of a kind in one row, so that their edges lie on common lines.
PolygonDrawing twice(const ShapeScene& scene) {
  PolygonDrawing drawing = drawing_of(scene);
  drawing.width_px = 2 * scene.side_px;
  const auto first = drawing.polygons;
  for (Polygon polygon : first) {
    for (Vector2d& corner : polygon.corners_px) corner.x() += scene.side_px;
    drawing.polygons.push_back(polygon);
  }
  return drawing;
}

MarkSearch search_in(const PolygonDrawing& drawing, MarkKind kind) {
  MarkSearch search;
  search.kind = kind;
  search.expected_px = search.half_window_px = 0.5 * Vector2d(drawing.width_px - 1, drawing.height_px - 1);
  search.min_diameter_px = 15;
  search.max_diameter_px = 60;
  search.min_axis_ratio = 0.1;
  return search;
}

// Each of the places is found once within five sigma, and nothing else.
void expect_places(const PolygonDrawing& drawing, MarkKind kind, const std::vector<Vector2d>& places) {
  const std::vector<MarkFinding> found =
      find_all_marks(pixels_of(drawing).view(), search_in(drawing, kind)).found;
  EXPECT_EQ(found.size(), places.size()) << name_of(kind);
  for (const Vector2d& place : places) {
    const auto there = std::count_if(found.begin(), found.end(), [&](const MarkFinding& mark) {
      const Vector2d off = mark.u_px - place;
      return off.dot(mark.covariance_px2.inverse() * off) < 25;
    });
    EXPECT_EQ(there, 1) << name_of(kind) << ' ' << place.transpose();
  }
}

TEST(ShapeLists, AllSlotsCrossesAndCornersOfAWindowAreListed) {
  const Vector2d step(60, 0);
  const ShapeScene slot = slot_scene(), cross{MarkKind::cross, {0.3, -0.2, 0, pi / 2, 4, 20, 20, 20, 20}, 60};
  for (const ShapeScene& scene : {slot, cross})
    expect_places(twice(scene), scene.kind, {scene.truth_px(), scene.truth_px() + step});
  PolygonDrawing blocks = drawing_of(slot);
  blocks.width_px = 120;
  blocks.polygons = {block({30.2, 29.6}, 0, 18, 15, 60), block({90.2, 29.6}, 0, 18, 15, 60)};
  std::vector<Vector2d> corners;
  for (const Polygon& polygon : blocks.polygons)
    corners.insert(corners.end(), polygon.corners_px.begin(), polygon.corners_px.end());
  expect_places(blocks, MarkKind::corner, corners);
}

// Pieces of one line are one edge: their place along it is open.
TEST(ShapeLists, AllEdgesOfAWindowAreListed) {
  PolygonDrawing blocks = drawing_of(slot_scene());
  blocks.width_px = 120;
  blocks.polygons = {block({30.2, 29.6}, 0, 18, 15, 60), block({90.2, 29.6}, 0, 18, 15, 60)};
  std::vector<double> upright, level;
  for (const MarkFinding& edge :
       find_all_marks(pixels_of(blocks).view(), search_in(blocks, MarkKind::edge)).found)
    std::abs(std::cos(edge.direction_rad)) > 0.7 ? upright.push_back(edge.u_px.x())
                                                 : level.push_back(edge.u_px.y());
  std::sort(upright.begin(), upright.end());
  std::sort(level.begin(), level.end());
  // Five sigma of 0.01 px: noise 2, contrast 100, 24 px and more of an edge.
  const std::vector<double> places_u{12.2, 48.2, 72.2, 108.2}, places_v{14.6, 44.6};
  EXPECT_THAT(upright, ::testing::Pointwise(::testing::DoubleNear(0.05), places_u));
  EXPECT_THAT(level, ::testing::Pointwise(::testing::DoubleNear(0.05), places_v));
}

TEST(ShapeReasons, SearchesThatMakeNoSense) {
  for (const ShapeScene& scene : every_scene) {
    const Pixels pixels = pixels_of(drawing_of(scene));
    MarkSearch search = search_of(scene);
    search.expected_px.x() = std::numeric_limits<double>::quiet_NaN();
    expect_status(find_shape(pixels.view(), search), MarkStatus::not_searched);
    search = search_of(scene);
    search.min_contrast = 0;
    expect_status(find_shape(pixels.view(), search), MarkStatus::not_searched);
    if (scene.kind == MarkKind::edge || scene.kind == MarkKind::corner) continue;
    search = search_of(scene);
    search.max_diameter_px = 0.5 * search.min_diameter_px;
    expect_status(find_shape(pixels.view(), search), MarkStatus::not_searched);
  }
}

TEST(ShapeReasons, OutsideTheImage) {
  for (const ShapeScene& scene : every_scene) {
    MarkSearch search = search_of(scene);
    expect_status(find_shape(ImageView{}, search), MarkStatus::outside_image);
    search.expected_px = {500, 20};
    expect_status(find_in(drawing_of(scene), search), MarkStatus::outside_image);
  }
}

TEST(ShapeReasons, NothingThere) {
  for (const ShapeScene& scene : every_scene) {
    PolygonDrawing drawing = drawing_of(scene);
    drawing.polygons.clear();
    MarkSearch search = search_of(scene);
    search.min_contrast = 25;
    expect_status(find_in(drawing, search), MarkStatus::low_contrast);
    drawing.polygons = {{{{20, 20}, {26, 22}, {22, 26}}, 60}};  // a speck
    search.min_diameter_px = std::max(15.0, search.min_diameter_px);
    EXPECT_NE(find_in(drawing, search).status, MarkStatus::found);
  }
}

TEST(ShapeReasons, LowContrastWithItsNumber) {
  for (ShapeScene scene : every_scene) {
    scene.mark = scene.background - 14;
    MarkSearch search = search_of(scene);
    search.min_contrast = 20;
    const MarkFinding finding = find_in(drawing_of(scene), search);
    expect_status(finding, MarkStatus::low_contrast);
    EXPECT_NEAR(finding.contrast, 14, 1.5);
  }
}

TEST(ShapeReasons, BlurredWithItsNumber) {
  for (ShapeScene scene : every_scene) {
    scene.blur_px = 2.2;
    MarkSearch search = search_of(scene);
    search.max_blur_px = 1.8;
    const MarkFinding finding = find_in(drawing_of(scene), search);
    expect_status(finding, MarkStatus::blurred);
    EXPECT_NEAR(finding.blur_px, 2.22, 0.15);
  }
}

TEST(ShapeReasons, Saturated) {
  for (ShapeScene scene : every_scene) {
    scene.background = 290;
    expect_status(find_in(drawing_of(scene), search_of(scene)), MarkStatus::saturated);
  }
}

TEST(ShapeReasons, TooSmallWithItsSize) {
  PolygonDrawing plate = drawing_of(edge_scene());
  plate.polygons = {block({29, 29}, 0.4, 12, 12, 60)};
  MarkSearch search = search_of(edge_scene());
  search.direction_tolerance_rad = 0.3;
  search.direction_rad = 0.4;
  search.min_diameter_px = 35;
  MarkFinding finding = find_in(plate, search);
  expect_status(finding, MarkStatus::too_small);
  EXPECT_NEAR(finding.diameter_px, 24, 3);
  search = search_of(corner_scene());
  search.direction_rad = 0.4 + pi / 4;
  search.direction_tolerance_rad = 0.3;
  search.min_diameter_px = 35;
  expect_status(find_in(plate, search), MarkStatus::too_small);
  for (const ShapeScene& scene : {slot_scene(), cross_scene()}) {
    search = search_of(scene);
    search.min_diameter_px += 12;
    search.max_diameter_px += 12;
    finding = find_in(drawing_of(scene), search);
    expect_status(finding, MarkStatus::too_small);
  }
}

TEST(ShapeReasons, CutOffByTheWindow) {
  MarkSearch search = search_of(edge_scene(0.3, 0));
  search.half_window_px = {20, 20};
  search.expected_px.x() += 17.5;  // the edge is 2.8 px inside
  expect_status(find_in(drawing_of(edge_scene(0.3, 0)), search), MarkStatus::cut_off);
  search = search_of(slot_scene(0));
  search.half_window_px = {20, 20};
  search.expected_px.x() += 8;
  expect_status(find_in(drawing_of(slot_scene(0)), search), MarkStatus::cut_off);
}

TEST(ShapeReasons, TwoAlikeAreAmbiguous) {
  PolygonDrawing drawing = drawing_of(edge_scene());
  const Vector2d middle = edge_scene().middle();
  drawing.polygons = {block(middle - 10 * unit(0.4), 0.4, 8, 90, 60),
                      block(middle + 12 * unit(0.4), 0.4, 4, 90, 70)};
  MarkSearch search = search_of(edge_scene());
  search.direction_rad = 0.4;
  search.direction_tolerance_rad = 0.5;
  expect_status(find_in(drawing, search), MarkStatus::ambiguous);
  drawing.polygons.back().grey = 130;  // less than half of the other's contrast
  expect_status(find_in(drawing, search), MarkStatus::found);
  drawing.polygons = {block(middle, 0.4, 14, 14, 60)};
  search = search_of(corner_scene());
  expect_status(find_in(drawing, search), MarkStatus::ambiguous);  // four corners
  search.direction_rad = 0.4 + pi / 4;
  search.direction_tolerance_rad = 0.5;
  expect_status(find_in(drawing, search), MarkStatus::found);
  for (ShapeScene scene : {slot_scene(), cross_scene()}) {
    scene.side_px = 120;
    scene.parameters[0] = -28;
    drawing = drawing_of(scene);
    scene.parameters[0] = 28;
    drawing.polygons.push_back(drawing_of(scene).polygons.front());
    expect_status(find_in(drawing, search_of(scene)), MarkStatus::ambiguous);
  }
}

// ---- over and beside it

// A place on the outline and its normal, away from corners.
struct OnOutline {
  Vector2d at, normal;
};
OnOutline on_outline(const ShapeScene& s) {
  const auto& p = s.parameters;
  const Vector2d truth = s.truth_px();
  if (s.kind == MarkKind::edge) return {truth + 9 * unit(p[1] + pi / 2), unit(p[1])};
  if (s.kind == MarkKind::corner) return {truth + 15 * unit(p[2]), unit(p[2] - pi / 2)};
  if (s.kind == MarkKind::slot) return {truth + Vector2d(p[4], p[5]), Vector2d(p[4], p[5]).normalized()};
  return {truth + 14 * unit(p[2]) + p[4] * unit(p[2] + pi / 2), unit(p[2] + pi / 2)};
}

TEST(ShapeRobustness, GlintDirtAndBiteOnTheOutlineAreLeftOut) {
  for (const ShapeScene& scene : every_scene) {
    const OnOutline on = on_outline(scene);
    const double angle = std::atan2(on.normal.y(), on.normal.x());
    for (const double grey : {10.0, scene.mark, scene.background, 250.0}) {
      PolygonDrawing drawing = drawing_of(scene);
      drawing.polygons.push_back(block(on.at, angle, 2, 2, grey));
      const MarkFinding finding = find_in(drawing, search_of(scene));
      expect_status(finding, MarkStatus::found);
      EXPECT_LT(finding.outline_share, 0.99) << int(scene.kind) << ' ' << grey;
      EXPECT_GE(finding.outline_share, 0.7);
      EXPECT_LT(error_of(finding, scene), most_sigmas) << int(scene.kind) << ' ' << grey;
    }
  }
}

TEST(ShapeRobustness, MuchOfItCoveredIsNoMark) {
  for (const ShapeScene& scene : every_scene) {
    PolygonDrawing drawing = drawing_of(scene);
    const Vector2d n = on_outline(scene).normal;
    const Vector2d along(-n.y(), n.x());
    drawing.polygons.push_back(block(on_outline(scene).at, std::atan2(along.y(), along.x()), 9, 4, 105));
    const MarkFinding finding = find_in(drawing, search_of(scene));
    if (finding.status == MarkStatus::found) {
      EXPECT_LT(error_of(finding, scene), most_sigmas) << int(scene.kind);
    }
  }
}

TEST(ShapeRobustness, NeighboursBesideTheBandDoNotShift) {
  for (const ShapeScene& scene : every_scene) {
    for (const double gap : {4.5, 6.0, 8.0}) {
      for (const double grey : {60.0, 110.0, 220.0}) {
        const OnOutline on = on_outline(scene);
        PolygonDrawing drawing = drawing_of(scene);
        const double angle = std::atan2(on.normal.y(), on.normal.x());
        drawing.polygons.push_back(block(on.at + (gap + 3) * on.normal, angle, 3, 5, grey));
        const MarkFinding finding = find_in(drawing, search_of(scene));
        expect_status(finding, MarkStatus::found);
        EXPECT_LT(error_of(finding, scene), most_sigmas) << int(scene.kind) << ' ' << gap << ' ' << grey;
      }
    }
  }
}

// ---- limits and wrong kinds

TEST(ShapeLimits, DirectionCounts) {
  for (const ShapeScene& scene : every_scene) {
    MarkSearch search = search_of(scene);
    const double truth = find_in(drawing_of(scene), search).direction_rad;
    search.direction_tolerance_rad = 0.2;
    search.direction_rad = truth + 0.15;
    const MarkFinding near = find_in(drawing_of(scene), search);
    expect_status(near, MarkStatus::found);
    EXPECT_NEAR(near.direction_rad, truth, 0.01) << int(scene.kind);
    search.direction_rad = truth + 0.5;
    expect_status(find_in(drawing_of(scene), search), MarkStatus::no_candidate);
  }
}

TEST(ShapeLimits, SizesAndDirectionsAreThoseOfThePicture) {
  const MarkFinding slot = find_in(drawing_of(slot_scene()), search_of(slot_scene()));
  EXPECT_NEAR(slot.diameter_px, 34, 0.3);
  EXPECT_NEAR(slot.axis_ratio, 14.0 / 34, 0.01);
  EXPECT_NEAR(std::remainder(slot.direction_rad - 0.5, pi), 0, 0.01);
  const MarkFinding cross = find_in(drawing_of(cross_scene()), search_of(cross_scene()));
  EXPECT_NEAR(cross.diameter_px, 44, 3);
  EXPECT_NEAR(cross.axis_ratio * cross.diameter_px, 8, 0.05);
  const MarkFinding corner = find_in(drawing_of(corner_scene()), search_of(corner_scene()));
  EXPECT_NEAR(corner.direction_rad, 0.5 + pi / 4, 0.01);
  const MarkFinding edge = find_in(drawing_of(edge_scene()), search_of(edge_scene()));
  EXPECT_NEAR(edge.direction_rad, 0.4, 0.01);
  EXPECT_GT(edge.diameter_px, 45);
  const Vector2d n = unit(edge.direction_rad), along(-n.y(), n.x());
  EXPECT_NEAR(along.dot(edge.covariance_px2 * along), unknown_along_px2, 1);
  EXPECT_LT(std::abs(along.dot(edge.u_px - search_of(edge_scene()).expected_px)), 1e-9);
}

TEST(ShapeLimits, CornerOfMoreThanHalfATurn) {
  ShapeScene scene = corner_scene();
  std::swap(scene.mark, scene.background);  // the dark now fills 270 degrees
  MarkSearch search = search_of(corner_scene());
  search.opening_rad = 1.5 * pi;
  const MarkFinding finding = find_in(drawing_of(scene), search);
  expect_status(finding, MarkStatus::found);
  EXPECT_LT(error_of(finding, scene), most_sigmas);
  EXPECT_NEAR(std::remainder(finding.direction_rad - (0.5 + pi / 4 + pi), 2 * pi), 0, 0.01);
}

TEST(WrongKinds, CornerOfAnotherAngle) {
  for (const double opening : {pi / 3, 2.2}) {
    MarkSearch search = search_of(corner_scene(opening));
    expect_status(find_in(drawing_of(corner_scene(opening)), search), MarkStatus::no_candidate);
    search.opening_rad = opening;
    const MarkFinding finding = find_in(drawing_of(corner_scene(opening)), search);
    expect_status(finding, MarkStatus::found);
    EXPECT_LT(error_of(finding, corner_scene(opening)), most_sigmas);
  }
}

// A chessboard's crossing and an edge that another one meets go on behind the point.
TEST(WrongKinds, CrossingsAreNoCorner) {
  PolygonDrawing drawing = drawing_of(corner_scene());
  const Vector2d tip = corner_scene().truth_px();
  drawing.polygons.push_back(block(tip - 60 * unit(0.5) - 60 * unit(0.5 + pi / 2), 0.5, 60, 60, 60));
  expect_status(find_in(drawing, search_of(corner_scene())), MarkStatus::no_candidate);
  drawing = drawing_of(corner_scene());
  drawing.polygons.push_back(block(tip - 60 * unit(0.5) + 60 * unit(0.5 + pi / 2), 0.5, 60, 60, 105));
  expect_status(find_in(drawing, search_of(corner_scene())), MarkStatus::no_candidate);
}

TEST(WrongKinds, DiscsEllipsesAndBlocksAreNoSlot) {
  const MarkSearch search = search_of(slot_scene());
  for (const double ratio : {1.0, 0.8, 0.6, 0.45}) {
    PolygonDrawing drawing = drawing_of(slot_scene(0.5, 16, 0));
    for (Vector2d& corner : drawing.polygons.front().corners_px) {
      const Vector2d off = corner - slot_scene().middle(), n = unit(1.1);
      corner += (ratio - 1) * n.dot(off) * n;
    }
    EXPECT_NE(find_in(drawing, search).status, MarkStatus::found) << ratio;
  }
  PolygonDrawing drawing = drawing_of(slot_scene());
  drawing.polygons = {block(slot_scene().middle(), 0.5, 17, 7, 60)};
  EXPECT_NE(find_in(drawing, search).status, MarkStatus::found);
}

TEST(WrongKinds, SlotOfAnotherWidthOrLength) {
  MarkSearch search = search_of(slot_scene());  // 34 x 14: 0.41
  search.min_axis_ratio = 0.5;
  expect_status(find_in(drawing_of(slot_scene()), search), MarkStatus::no_candidate);
  search = search_of(slot_scene());
  search.min_diameter_px = 20;
  search.max_diameter_px = 30;
  expect_status(find_in(drawing_of(slot_scene()), search), MarkStatus::no_candidate);
}

TEST(WrongKinds, JunctionsAndOtherAnglesAreNoCross) {
  ShapeScene scene = cross_scene();
  scene.parameters[8] = 4.5;  // one arm is missing: a T
  expect_status(find_in(drawing_of(scene), search_of(scene)), MarkStatus::no_candidate);
  scene = cross_scene();
  scene.parameters[3] = 0.3 + pi / 3;
  MarkSearch search = search_of(scene);
  expect_status(find_in(drawing_of(scene), search), MarkStatus::no_candidate);
  search.opening_rad = pi / 3;
  const MarkFinding finding = find_in(drawing_of(scene), search);
  expect_status(finding, MarkStatus::found);
  EXPECT_LT(error_of(finding, scene), most_sigmas);
}

TEST(ShapeNoise, WindowsOfNoiseHoldNothing) {
  std::mt19937_64 random(9);
  for (int k = 0; k < 20; ++k) {
    for (const ShapeScene& scene : every_scene) {
      PolygonDrawing drawing = drawing_of(scene);
      drawing.polygons.clear();
      EXPECT_NE(find_shape(expose(paint(drawing), 6, random).view(), search_of(scene)).status,
                MarkStatus::found);
    }
  }
}

}  // namespace
}  // namespace zeropose
