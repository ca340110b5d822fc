// What find_marks() says of windows that are not as they should be (spec 50 M0).
#include "measure/marks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Drawing;
using test::ellipse;
using test::expose;
using test::paint;
using test::Pixels;

constexpr int width = 160, height = 140;

Drawing surface() {
  Drawing drawing;
  drawing.width_px = width;
  drawing.height_px = height;
  return drawing;
}

Pixels picture_of(const Drawing& drawing, double noise = 2) {
  std::mt19937_64 random(4);
  return expose(paint(drawing), noise, random);
}

MarkSearch search_at(const Vector2d& expected) {
  MarkSearch search;
  search.expected_px = expected;
  search.half_window_px = Vector2d(50, 50);
  search.min_diameter_px = 20;
  search.max_diameter_px = 40;
  return search;
}

MarkFinding find(const Pixels& pixels, const MarkSearch& search) {
  return find_marks(pixels.view(), {&search, 1}).front();
}

Pixels with_disc(const Vector2d& at, double diameter = 30, double grey = 60) {
  Drawing drawing = surface();
  drawing.figures = {ellipse(at, diameter, 0.9, 0.4, grey)};
  return picture_of(drawing);
}

constexpr double middle_u = 80, middle_v = 70;
const Vector2d middle(middle_u, middle_v);

TEST(FindMarks, DarkAndBright) {
  const Vector2d truth(77.3, 71.8);
  MarkSearch search = search_at(middle);
  const Pixels dark = with_disc(truth), bright = with_disc(truth, 30, 230);
  EXPECT_EQ(find(dark, search).status, MarkStatus::found);
  EXPECT_LT((find(dark, search).u_px - truth).norm(), 0.03);  // 5 sigma
  EXPECT_EQ(find(bright, search).status, MarkStatus::no_candidate);
  search.bright = true;
  EXPECT_EQ(find(bright, search).status, MarkStatus::found);
  EXPECT_LT((find(bright, search).u_px - truth).norm(), 0.04);
  EXPECT_EQ(find(dark, search).status, MarkStatus::no_candidate);
}

TEST(FindMarks, FindingsInTheOrderOfTheSearches) {
  Drawing drawing = surface();
  drawing.figures = {ellipse({40, 70}, 30, 1, 0, 60), ellipse({120, 70}, 26, 1, 0, 60)};
  const Pixels pixels = picture_of(drawing);
  std::vector<MarkSearch> searches{search_at({120, 70}), search_at({40, 70}), search_at({80, 20})};
  for (auto& search : searches) search.half_window_px = {30, 40};
  searches[2].half_window_px = {20, 15};
  const auto findings = find_marks(pixels.view(), searches);
  ASSERT_EQ(findings.size(), 3U);
  EXPECT_NEAR(findings[0].u_px.x(), 120, 0.1);
  EXPECT_NEAR(findings[1].u_px.x(), 40, 0.1);
  EXPECT_NE(findings[2].status, MarkStatus::found);
  EXPECT_TRUE(find_marks(pixels.view(), {}).empty());
}

TEST(FindMarks, CutOffByImageOrWindow) {
  EXPECT_EQ(find(with_disc({10, 70}), search_at({20, 70})).status, MarkStatus::cut_off);
  EXPECT_EQ(find(with_disc({16, 70}), search_at({30, 70})).status, MarkStatus::cut_off);  // its band is
  EXPECT_EQ(find(with_disc({80, 134}), search_at({80, 110})).status, MarkStatus::cut_off);
  MarkSearch beside = search_at({40, 70});
  beside.half_window_px = {40, 40};
  EXPECT_EQ(find(with_disc(middle), beside).status, MarkStatus::cut_off);
}

TEST(FindMarks, Saturated) {
  Drawing drawing = surface();
  drawing.background = 300;
  drawing.figures = {ellipse(middle, 30, 1, 0, 60)};
  EXPECT_EQ(find(picture_of(drawing), search_at(middle)).status, MarkStatus::saturated);
  drawing.background = 100;
  drawing.figures = {ellipse(middle, 30, 1, 0, 300)};
  MarkSearch search = search_at(middle);
  search.bright = true;
  EXPECT_EQ(find(picture_of(drawing), search).status, MarkStatus::saturated);
}

TEST(FindMarks, ContrastOfFiveLevels) {
  EXPECT_EQ(find(with_disc(middle, 30, 155), search_at(middle)).status, MarkStatus::low_contrast);
}

TEST(FindMarks, ContrastJustAboveTheLimit) {
  const MarkFinding found = find(with_disc(middle, 30, 160 - 20), search_at(middle));
  EXPECT_EQ(found.status, MarkStatus::found);
  EXPECT_LT((found.u_px - middle).norm(), 0.13);  // 5 sigma of 0.025 px
}

TEST(FindMarks, PlainSurfaceHasNoContrast) {
  EXPECT_EQ(find(picture_of(surface()), search_at(middle)).status, MarkStatus::low_contrast);
  EXPECT_EQ(find(picture_of(surface(), 0), search_at(middle)).status, MarkStatus::low_contrast);
}

TEST(FindMarks, TwoEqualDiscsAreAmbiguous) {
  Drawing drawing = surface();
  drawing.figures = {ellipse({60, 70}, 28, 1, 0, 60), ellipse({101, 70}, 28, 1, 0, 70)};
  EXPECT_EQ(find(picture_of(drawing), search_at(middle)).status, MarkStatus::ambiguous);
}

TEST(FindMarks, RingOfTwoSizesIsAmbiguous) {
  Drawing drawing = surface();
  drawing.figures = {ellipse(middle, 39, 1, 0, 110), ellipse(middle, 22, 1, 0, 50)};
  EXPECT_EQ(find(picture_of(drawing), search_at(middle)).status, MarkStatus::ambiguous);
}

TEST(FindMarks, WrongSizes) {
  EXPECT_EQ(find(with_disc(middle, 17), search_at(middle)).status, MarkStatus::too_small);
  EXPECT_EQ(find(with_disc(middle, 46), search_at(middle)).status, MarkStatus::no_candidate);
}

TEST(FindMarks, TooFlat) {
  Drawing drawing = surface();
  drawing.figures = {ellipse(middle, 36, 0.35, 0.4, 60)};
  MarkSearch search = search_at(middle);
  EXPECT_EQ(find(picture_of(drawing), search).status, MarkStatus::found);
  search.min_axis_ratio = 0.6;
  EXPECT_EQ(find(picture_of(drawing), search).status, MarkStatus::no_candidate);
}

// A straight edge over it: a third of the outline behind it at most.
TEST(FindMarks, HalfCoveredIsNotFoundALittleCoveredInItsPlace) {
  Drawing drawing = surface();
  drawing.figures = {ellipse(middle, 30, 1, 0, 60), {}};
  int found = 0;
  for (const double edge : {middle_u - 9, middle_u, middle_u + 9, middle_u + 12}) {
    drawing.figures[1].corners_px = {{edge, -20}, {edge + 30, -20}, {edge + 30, 200}, {edge, 200}};
    for (const double grey : {20.0, 60.0, 120.0, 160.0, 220.0}) {
      drawing.figures[1].grey = grey;
      const MarkFinding finding = find(picture_of(drawing), search_at(middle));
      if (finding.status != MarkStatus::found) continue;
      EXPECT_GT(edge, middle_u + 5) << grey;
      EXPECT_LT((finding.u_px - middle).norm(), 0.1) << edge << ' ' << grey;  // ten sigma
      ++found;
    }
  }
  EXPECT_EQ(found, 10);
}

TEST(FindMarks, OutsideOfTheImage) {
  const Pixels pixels = with_disc(middle);
  for (const Vector2d& at :
       {Vector2d(-80, 70), Vector2d(80, 300), Vector2d(1e300, 70), Vector2d(80, -1e300)}) {
    EXPECT_EQ(find(pixels, search_at(at)).status, MarkStatus::outside_image);
  }
  const MarkSearch search = search_at(middle);
  EXPECT_EQ(find_marks(ImageView{}, {&search, 1}).front().status, MarkStatus::outside_image);
}

TEST(FindMarks, NonsenseIsNotSearched) {
  const Pixels pixels = with_disc(middle);
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  std::vector<MarkSearch> searches(8, search_at(middle));
  searches[0].expected_px.x() = nan;
  searches[1].half_window_px.y() = inf;
  searches[2].min_diameter_px = 0;
  searches[3].max_diameter_px = 10;
  searches[4].min_axis_ratio = nan;
  searches[5].min_contrast = -1;
  searches[6].half_window_px.x() = -5;
  searches[7].max_diameter_px = nan;
  for (const auto& finding : find_marks(pixels.view(), searches)) {
    EXPECT_EQ(finding.status, MarkStatus::not_searched);
  }
}

// The gap between rows is filled with what would disturb, and the last row ends with its last pixel.
TEST(FindMarks, StrideLargerThanWidth) {
  const Pixels plain = with_disc({81.2, 69.4});
  constexpr int stride = 203;
  std::vector<std::uint8_t> wide(static_cast<std::size_t>(stride * (height - 1) + width), 0);
  for (int v = 0; v < height; ++v) {
    std::copy_n(plain.view().row(v), width, wide.begin() + std::ptrdiff_t{v} * stride);
  }
  MarkSearch search = search_at(middle);
  search.half_window_px = {200, 200};
  const MarkFinding a = find(plain, search);
  const MarkFinding b = find_marks(ImageView{wide.data(), width, height, stride}, {&search, 1}).front();
  EXPECT_EQ(a.status, MarkStatus::found);
  EXPECT_EQ(b.status, MarkStatus::found);
  EXPECT_EQ(a.u_px, b.u_px);
}

TEST(FindMarks, TinyImages) {
  for (int w = 1; w < 12; ++w) {
    const std::vector<std::uint8_t> grey(static_cast<std::size_t>(w * w), 90);
    const MarkSearch search = search_at({0.5 * w, 0.5 * w});
    EXPECT_NE(find_marks(ImageView{grey.data(), w, w, w}, {&search, 1}).front().status, MarkStatus::found);
  }
}

}  // namespace
}  // namespace zeropose
