// What must not change the result, and what must change it exactly (spec 50 M0).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "measure/marks.h"
#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Drawing;
using test::ellipse;
using test::Pixels;

constexpr int side = 161;  // odd: its middle is a pixel
const Vector2d middle(80, 80);

Drawing scene(const Vector2d& at, double diameter, bool covered) {
  Drawing drawing;
  drawing.width_px = drawing.height_px = side;
  drawing.background = 170;
  drawing.figures = {ellipse(at, diameter, 0.8, 0.5, 70)};
  if (!covered) return drawing;
  const double edge = at.x() + 0.35 * diameter;
  drawing.figures.push_back({});
  drawing.figures.back().corners_px = {
      {edge, at.y() - 60}, {edge + 20, at.y() - 60}, {edge + 20, at.y() + 60}, {edge, at.y() + 60}};
  drawing.figures.back().grey = 130;
  return drawing;
}

MarkSearch search_for(double diameter) {
  MarkSearch search;
  search.expected_px = middle;
  search.half_window_px = {64, 64};  // a whole number of tiles on both sides of every shift below
  search.min_diameter_px = 0.7 * diameter;
  search.max_diameter_px = 1.3 * diameter;
  return search;
}

MarkFinding find(const Pixels& pixels, const MarkSearch& search) {
  return find_marks(pixels.view(), {&search, 1}).front();
}

Pixels mapped(const Pixels& from, const std::function<int(int u, int v)>& grey) {
  Pixels to = from;
  for (int v = 0; v < to.height_px; ++v)
    for (int u = 0; u < to.width_px; ++u)
      to.grey[std::size_t(v * to.width_px + u)] = static_cast<std::uint8_t>(grey(u, v));
  return to;
}

int at(const Pixels& pixels, int u, int v) { return pixels.grey[std::size_t(v * pixels.width_px + u)]; }

class MarkLaws : public ::testing::TestWithParam<std::tuple<double, bool>> {
 protected:
  void SetUp() override {
    const auto [diameter, covered] = GetParam();
    std::mt19937_64 random(static_cast<unsigned>(diameter) + (covered ? 1 : 0));
    pixels_ = expose(paint(scene(middle + Vector2d(0.31, -0.22), diameter, covered)), 2, random);
    search_ = search_for(diameter);
    found_ = find(pixels_, search_);
    ASSERT_EQ(found_.status, MarkStatus::found) << reason_text(found_, search_);
  }
  // How near two minima of the same pixels come: the fit stops a tenth of its sigma before, and pixels at the
  // rim of its band come and go. Where a part is covered, a stretch of the outline at its end may count or
  // not.
  double same_px() const {
    return (std::get<1>(GetParam()) ? 1 : 0.3) * std::sqrt(found_.covariance_px2.trace() / 2);
  }

  Pixels pixels_;
  MarkSearch search_;
  MarkFinding found_;
};

TEST_P(MarkLaws, AShiftOfTheImageShiftsTheResultExactly) {
  for (const auto& [du, dv] : {std::pair(7, -3), std::pair(-8, 5)}) {
    const Pixels moved = mapped(pixels_, [&](int u, int v) {
      return at(pixels_, std::clamp(u - du, 0, side - 1), std::clamp(v - dv, 0, side - 1));
    });
    MarkSearch search = search_;
    search.expected_px += Vector2d(du, dv);
    const MarkFinding finding = find(moved, search);
    EXPECT_EQ((finding.u_px - found_.u_px - Vector2d(du, dv)).norm(), 0);
    EXPECT_LT((finding.covariance_px2 - found_.covariance_px2).norm(), 1e-9 * found_.covariance_px2.norm());
  }
}

// By a right angle about the middle pixel: the pixels come in another order, sums differ in their last
// digits.
TEST_P(MarkLaws, ARightAngleTurnsTheResult) {
  const Pixels turned = mapped(pixels_, [&](int u, int v) { return at(pixels_, v, side - 1 - u); });
  const MarkFinding finding = find(turned, search_);
  const Vector2d off = found_.u_px - middle;
  EXPECT_LT((finding.u_px - middle - Vector2d(-off.y(), off.x())).norm(), same_px());
}

// Light multiplies: the slope of it that the noise feigns acts on the brighter side more, and that is the
// other one after an inversion or an offset. So without noise; what remains is rounding, some thousandths of
// a grey level per pixel.
TEST_P(MarkLaws, InvertedGreyLevelsAndOffsetsChangeNothing) {
  const auto [diameter, covered] = GetParam();
  std::mt19937_64 random(1);
  const Pixels clean = expose(paint(scene(middle + Vector2d(0.31, -0.22), diameter, covered)), 0, random);
  const Vector2d centre = find(clean, search_).u_px;
  const Pixels inverse = mapped(clean, [&](int u, int v) { return 255 - at(clean, u, v); });
  MarkSearch bright = search_;
  bright.bright = true;
  EXPECT_LT((find(inverse, bright).u_px - centre).norm(), 0.5 * same_px());
  const Pixels darker = mapped(clean, [&](int u, int v) { return at(clean, u, v) - 50; });
  EXPECT_LT((find(darker, search_).u_px - centre).norm(), 0.5 * same_px());
}

TEST_P(MarkLaws, GainChangesNothing) {
  // Doubled from half the range, so that rounding has no part in it.
  const Pixels half = mapped(pixels_, [&](int u, int v) { return at(pixels_, u, v) / 2; });
  const Pixels again = mapped(half, [&](int u, int v) { return 2 * at(half, u, v); });
  EXPECT_LT((find(half, search_).u_px - find(again, search_).u_px).norm(), same_px());
}

TEST_P(MarkLaws, SixteenBitsAgreeWithEight) {
  std::vector<std::uint16_t> wide(pixels_.grey.size());
  for (std::size_t i = 0; i < wide.size(); ++i) wide[i] = static_cast<std::uint16_t>(257 * pixels_.grey[i]);
  ImageView view{reinterpret_cast<const std::uint8_t*>(wide.data()), side, side, 2 * side, 65535};
  // The search rounds the reduced picture once instead of twice, so that the fit begins elsewhere.
  const MarkFinding finding = find_marks(view, {&search_, 1}).front();
  EXPECT_LT((finding.u_px - found_.u_px).norm(), same_px());
  EXPECT_NEAR(finding.contrast, found_.contrast, 0.1);
  EXPECT_LT((finding.covariance_px2 - found_.covariance_px2).norm(), 0.05 * found_.covariance_px2.norm());
  // Twelve bits, as cameras give them.
  for (std::size_t i = 0; i < wide.size(); ++i) wide[i] = static_cast<std::uint16_t>(16 * pixels_.grey[i]);
  view.white = 255 * 16;
  EXPECT_LT((find_marks(view, {&search_, 1}).front().u_px - found_.u_px).norm(), same_px());
}

// Other windows begin the search in other places; the fit ends in the same minimum within its own limit.
// Where a part is covered, a stretch of the outline at its end may count or not.
TEST_P(MarkLaws, TheWindowHasNoPartInTheResult) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    MarkSearch search = search_;
    search.expected_px += 8 * Vector2d(unit(random), unit(random));
    search.half_window_px = {60 + 10 * unit(random), 60 + 10 * unit(random)};
    const MarkFinding finding = find(pixels_, search);
    ASSERT_EQ(finding.status, MarkStatus::found) << reason_text(finding, search);
    EXPECT_LT((finding.u_px - found_.u_px).norm(), same_px());
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, MarkLaws,
                         ::testing::Values(std::tuple(12.0, false), std::tuple(24.0, false),
                                           std::tuple(50.0, false), std::tuple(24.0, true),
                                           std::tuple(50.0, true)));

}  // namespace
}  // namespace zeropose
