// Rings, balls and what is neither; what is said about things that are not found.
#include <gtest/gtest.h>

#include <cmath>

#include "calib/eccentricity.h"
#include "measure/marks.h"
#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Drawing;
using test::ellipse;
using test::Pixels;

const Vector2d middle(80.37, 70.81);

Drawing surface() {
  Drawing drawing;
  drawing.width_px = 160;
  drawing.height_px = 140;
  drawing.background = 170;
  return drawing;
}

MarkSearch search_of(MarkKind kind) {
  MarkSearch search;
  search.kind = kind;
  search.expected_px = {80, 70};
  search.half_window_px = {60, 60};
  search.min_diameter_px = 30;
  search.max_diameter_px = 60;
  if (kind == MarkKind::ring) search.inner_shares = {0.6};
  return search;
}

MarkFinding find(const Drawing& drawing, const MarkSearch& search, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  const Pixels pixels = expose(paint(drawing), 2, random);
  return find_marks(pixels.view(), {&search, 1}).front();
}

// Circles about one centre, of alternating grey.
Drawing ring(std::initializer_list<double> diameters, double first_grey, double other_grey) {
  Drawing drawing = surface();
  drawing.background = other_grey;
  double grey = first_grey;
  for (const double diameter : diameters) {
    drawing.figures.push_back(ellipse(middle, diameter, 0.85, 0.6, grey));
    grey = grey == first_grey ? other_grey : first_grey;
  }
  return drawing;
}

TEST(Rings, AreMeasuredByAllTheirCirclesTogether) {
  struct Case {
    std::initializer_list<double> diameters;
    std::vector<double> shares;
    bool bright;
  };
  for (const Case& c : {Case{{46, 27.6}, {0.6}, false}, Case{{46, 27.6}, {0.6}, true},
                        Case{{52, 36.4, 18.2}, {0.7, 0.35}, false}, Case{{40, 28}, {0.7}, false}}) {
    MarkSearch search = search_of(MarkKind::ring);
    search.bright = c.bright;
    search.inner_shares = c.shares;
    const Drawing drawing = ring(c.diameters, c.bright ? 170 : 70, c.bright ? 70 : 170);
    double squares = 0, held = 0;
    constexpr int draws = 60;
    double share = 0, sigma2 = 0;
    for (unsigned draw = 0; draw < draws; ++draw) {
      const MarkFinding finding = find(drawing, search, draw);
      ASSERT_EQ(finding.status, MarkStatus::found) << reason_text(finding, search);
      const Vector2d error = finding.u_px - middle;
      squares += error.squaredNorm() / 2 / draws;
      sigma2 += finding.covariance_px2.trace() / 2 / draws;
      held += error.dot(finding.covariance_px2.inverse() * error) < 5.991 ? 1.0 / draws : 0;
      share = finding.radius_share;
      EXPECT_NEAR(finding.diameter_px, *c.diameters.begin(), 0.3);
    }
    // 120 numbers: the scatter is known to 6.5 %, four sigma; the share that is held to 2.8 %.
    EXPECT_NEAR(std::sqrt(squares / sigma2), 1, 0.26);
    EXPECT_GT(held, 0.95 - 4 * 0.028);
    // Information of a circle grows with its length: the mean square radius by it.
    double sum = 0, weights = 0;
    for (const double diameter : c.diameters) {
      const double r = diameter / *c.diameters.begin();
      sum += r * r * r;
      weights += r;
    }
    EXPECT_NEAR(share, std::sqrt(sum / weights), 0.05);
  }
}

TEST(Rings, OtherThingsAreNone) {
  const MarkSearch search = search_of(MarkKind::ring);
  Drawing disc = surface();
  disc.figures = {ellipse(middle, 46, 0.85, 0.6, 70)};
  EXPECT_NE(find(disc, search).status, MarkStatus::found);
  EXPECT_NE(find(ring({46, 20}, 70, 170), search).status, MarkStatus::found);    // a share of 0.43
  EXPECT_NE(find(ring({46, 36}, 70, 170), search).status, MarkStatus::found);    // of 0.78
  EXPECT_NE(find(ring({46, 27.6}, 170, 70), search).status, MarkStatus::found);  // bright
  EXPECT_NE(find(ring({20, 12}, 70, 170), search).status, MarkStatus::found);
  Drawing off = ring({46, 27.6}, 70, 170);
  off.figures[1].centre_px += Vector2d(5, 0);
  EXPECT_NE(find(off, search).status, MarkStatus::found);
  EXPECT_NE(find(surface(), search).status, MarkStatus::found);
}

TEST(Rings, ADiscIsSearchedInVainInARing) {
  const MarkFinding finding = find(ring({46, 27.6}, 70, 170), search_of(MarkKind::disc));
  EXPECT_NE(finding.status, MarkStatus::found) << finding.diameter_px;
}

TEST(Rings, PartlyCovered) {
  Drawing drawing = ring({46, 27.6}, 70, 170);
  const double edge = middle.x() + 15;
  drawing.figures.push_back({});
  drawing.figures.back().corners_px = {{edge, 0}, {edge + 40, 0}, {edge + 40, 140}, {edge, 140}};
  drawing.figures.back().grey = 120;
  const MarkFinding finding = find(drawing, search_of(MarkKind::ring));
  ASSERT_EQ(finding.status, MarkStatus::found) << reason_text(finding, search_of(MarkKind::ring));
  EXPECT_LT((finding.u_px - middle).norm(), 5 * std::sqrt(finding.covariance_px2.trace()));
  EXPECT_LT(finding.outline_share, 0.9);
}

// A ball far off the axis: its outline is no circle and not about its centre. The outline is sampled from the
// rays that touch the ball, independently of the closed form.
TEST(Balls, TheOutlineIsWhereTheClosedFormSays) {
  const CameraModel camera{768, 572, 1200, 1200, 383.5, 285.5, Division{}};
  const Eigen::Vector3d p_C(250, -160, 1000);
  const double radius = 25;
  const Eigen::Vector3d axis = p_C.normalized(), side = axis.unitOrthogonal(), up = axis.cross(side);
  const double d = p_C.norm(), touch = d - radius * radius / d,
               wide = radius * std::sqrt(1 - radius * radius / (d * d));
  Drawing drawing;
  drawing.width_px = 768;
  drawing.height_px = 572;
  drawing.background = 170;
  // The image of the touching circle as an ellipse: its centre and half axes from the sampled outline's area.
  test::Figure ball;
  ball.grey = 70;
  constexpr int corners = 720;
  for (int k = 0; k < corners; ++k) {
    const double angle = -2 * 3.14159265358979323846 * k / corners;
    const Eigen::Vector3d p = touch * axis + wide * (std::cos(angle) * side + std::sin(angle) * up);
    ball.corners_px.push_back(*project(camera, p));
  }
  drawing.figures = {ball};
  MarkSearch search = search_of(MarkKind::ball);
  search.expected_px = *project(camera, p_C);
  search.min_diameter_px = 50;
  search.max_diameter_px = 75;
  const MarkFinding finding = find(drawing, search);
  ASSERT_EQ(finding.status, MarkStatus::found) << reason_text(finding, search);
  const Vector2d offset = finding.u_px - *project(camera, p_C),
                 closed = ball_centre_offset(camera, p_C, radius);
  EXPECT_GT(closed.norm(), 0.2);
  EXPECT_LT((offset - closed).norm(), 5 * std::sqrt(finding.covariance_px2.trace()));
}

// Many things of more contrast than the mark, none of them round, must not hide a rival of it.
TEST(Rivals, BehindManyOtherThingsAreSeen) {
  Drawing drawing = surface();
  drawing.width_px = 260;
  const auto square = [&](double u, double v) {
    drawing.figures.push_back({});
    drawing.figures.back().grey = 20;
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      drawing.figures.back().corners_px.push_back({u + 7.0 * x, v + 7.0 * y});
  };
  for (int k = 0; k < 12; ++k) square(20 + 20.0 * k, 20);
  drawing.figures.push_back(ellipse({70, 80}, 20, 1, 0, 80));
  MarkSearch search = search_of(MarkKind::disc);
  search.expected_px = {130, 70};
  search.half_window_px = {126, 66};
  search.min_diameter_px = 14;
  search.max_diameter_px = 26;
  EXPECT_EQ(find(drawing, search).status, MarkStatus::found);
  drawing.figures.push_back(ellipse({190, 80}, 20, 1, 0, 90));
  EXPECT_EQ(find(drawing, search).status, MarkStatus::ambiguous);
}

TEST(Rings, TwoOfThemAreAmbiguousHoweverTheirDiscsDiffer) {
  Drawing drawing = surface();
  drawing.width_px = 260;
  drawing.background = 120;
  // Inner discs of contrast 130 and 60, rings of 30 and 60: the second one is the better ring.
  drawing.figures = {ellipse({70, 70}, 46, 1, 0, 90), ellipse({70, 70}, 27.6, 1, 0, 220),
                     ellipse({190, 70}, 46, 1, 0, 60), ellipse({190, 70}, 27.6, 1, 0, 120)};
  MarkSearch search = search_of(MarkKind::ring);
  search.expected_px = {130, 70};
  search.half_window_px = {126, 66};
  EXPECT_EQ(find(drawing, search).status, MarkStatus::ambiguous);
}

// With a highlight inside.
TEST(Balls, MayShine) {
  Drawing drawing = surface();
  drawing.figures = {ellipse(middle, 44, 1, 0, 60), ellipse(middle + Vector2d(-5, -6), 11, 1, 0, 240)};
  const MarkSearch search = search_of(MarkKind::ball);
  const MarkFinding finding = find(drawing, search);
  ASSERT_EQ(finding.status, MarkStatus::found) << reason_text(finding, search);
  EXPECT_LT((finding.u_px - middle).norm(), 5 * std::sqrt(finding.covariance_px2.trace()));
}

TEST(MarkReasons, CarryTheNumbers) {
  const MarkSearch search = search_of(MarkKind::disc);
  const auto reason = [&](const Drawing& drawing) {
    const MarkFinding finding = find(drawing, search);
    EXPECT_NE(finding.status, MarkStatus::found);
    return std::pair(finding.status, reason_text(finding, search));
  };
  Drawing drawing = surface();
  drawing.figures = {ellipse(middle, 27, 1, 0, 70)};
  EXPECT_EQ(reason(drawing).first, MarkStatus::too_small);
  EXPECT_NE(reason(drawing).second.find("27.0 px, at least 30.0 px"), std::string::npos)
      << reason(drawing).second;
  drawing.figures = {ellipse(middle, 44, 1, 0, 158)};
  EXPECT_EQ(reason(drawing).first, MarkStatus::low_contrast) << reason(drawing).second;
  drawing.figures = {ellipse(middle, 44, 1, 0, 70)};
  drawing.blur_sigma_px = 4.4;
  EXPECT_EQ(reason(drawing).first, MarkStatus::blurred) << reason(drawing).second;
  EXPECT_NE(reason(drawing).second.find("at most 4.00 px"), std::string::npos) << reason(drawing).second;
  drawing.blur_sigma_px = 0.7;
  drawing.figures = {ellipse(middle - Vector2d(27, 0), 40, 1, 0, 70),
                     ellipse(middle + Vector2d(27, 0), 40, 1, 0, 70)};
  EXPECT_EQ(reason(drawing).first, MarkStatus::ambiguous) << reason(drawing).second;
  EXPECT_NE(reason(drawing).second.find("one of them at ("), std::string::npos);
  drawing.figures = {ellipse(middle, 44, 1, 0, 70)};
  drawing.background = 300;
  EXPECT_EQ(reason(drawing).first, MarkStatus::saturated) << reason(drawing).second;
  EXPECT_EQ(reason(surface()).first, MarkStatus::low_contrast);
}

}  // namespace
}  // namespace zeropose
