// Edges, corners, slots and crosses: laws, accuracy against the bound, every reason, what must not be taken.
#include "measure/edge_marks.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "tests/support/outline_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::bound_of;
using test::DeepPixels;
using test::drawing_of;
using test::expose;
using test::expose_deep;
using test::find_shape;
using test::paint;
using test::Picture;
using test::Pixels;
using test::Polygon;
using test::PolygonDrawing;
using test::random_scene;
using test::search_of;
using test::ShapeScene;

constexpr double pi = std::numbers::pi, noise = 2;

Vector2d unit(double angle) { return {std::cos(angle), std::sin(angle)}; }

// What is known of the place: for an edge the part across it.
Vector2d known(const MarkFinding& finding, const MarkSearch& search, const Vector2d& off) {
  if (search.kind != MarkKind::edge) return off;
  return {off.dot(unit(finding.direction_rad)), 0};
}

// Square of the error in units of its own covariance, and its degrees of freedom.
double mahalanobis2(const MarkFinding& finding, const MarkSearch& search, const Vector2d& off) {
  if (search.kind != MarkKind::edge) return off.dot(finding.covariance_px2.inverse() * off);
  const Vector2d n = unit(finding.direction_rad);
  return off.dot(n) * off.dot(n) / n.dot(finding.covariance_px2 * n);
}

double sigma_of(const MarkFinding& finding, const MarkSearch& search) {
  if (search.kind != MarkKind::edge) return std::sqrt(finding.covariance_px2.trace());
  const Vector2d n = unit(finding.direction_rad);
  return std::sqrt(n.dot(finding.covariance_px2 * n));
}

class Shapes : public testing::TestWithParam<MarkKind> {
 protected:
  std::mt19937_64 random_{21};
};
INSTANTIATE_TEST_SUITE_P(Kinds, Shapes,
                         testing::Values(MarkKind::edge, MarkKind::corner, MarkKind::slot, MarkKind::cross),
                         [](const auto& kind) {
                           return kind.param == MarkKind::edge     ? "edge"
                                  : kind.param == MarkKind::corner ? "corner"
                                  : kind.param == MarkKind::slot   ? "slot"
                                                                   : "cross";
                         });

// ---- accuracy

// 480 marks: the error of the ratio is 1 / sqrt(2 n), n 480 for an edge and 960 else: 3.2 and 2.3 %.
TEST_P(Shapes, NearTheBoundWithHonestCovariance) {
  constexpr int phases = 12, draws = 40;
  double squares = 0, bound = 0, held = 0;
  const double chi2 = GetParam() == MarkKind::edge ? 3.841 : 5.991;
  for (int phase = 0; phase < phases; ++phase) {
    const ShapeScene scene = random_scene(GetParam(), random_);
    const MarkSearch search = search_of(scene);
    const Picture picture = paint(drawing_of(scene));
    bound += bound_of(scene, noise).trace() / phases;
    for (int draw = 0; draw < draws; ++draw) {
      const MarkFinding finding = find_shape(expose(picture, noise, random_).view(), search);
      ASSERT_EQ(finding.status, MarkStatus::found) << name_of(finding.status);
      const Vector2d off = finding.u_px - scene.truth_px();
      squares += known(finding, search, off).squaredNorm();
      held += mahalanobis2(finding, search, off) < chi2 ? 1 : 0;
    }
  }
  constexpr double count = phases * draws;
  const double ratio = std::sqrt(squares / count / bound), spread = 1 / std::sqrt(2 * count);
  EXPECT_LE(ratio, 1.2 * (1 + 2 * spread));
  EXPECT_GE(ratio, 1 - 4 * spread);  // below the bound something is wrong with the bound
  EXPECT_NEAR(held / count, 0.95, 4 * std::sqrt(0.95 * 0.05 / count));
}

// Sixteen bits and no noise leave the model's own errors.
TEST_P(Shapes, NoiseFreeBiasIsSmall) {
  for (int phase = 0; phase < 20; ++phase) {
    const ShapeScene scene = random_scene(GetParam(), random_);
    const MarkSearch search = search_of(scene);
    const DeepPixels pixels = expose_deep(paint(drawing_of(scene)), 65535, 0, random_);
    const MarkFinding finding = find_shape(pixels.view(), search);
    ASSERT_EQ(finding.status, MarkStatus::found) << name_of(finding.status);
    EXPECT_LE(known(finding, search, finding.u_px - scene.truth_px()).norm(), 0.0005);
  }
}

TEST_P(Shapes, ShadingDoesNotShift) {
  for (const double gradient : {0.0004, 0.003}) {
    for (int phase = 0; phase < 8; ++phase) {
      ShapeScene scene = random_scene(GetParam(), random_);
      scene.shading_per_px = gradient * unit(2.0 * phase);
      const MarkSearch search = search_of(scene);
      const MarkFinding finding =
          find_shape(expose_deep(paint(drawing_of(scene)), 65535, 0, random_).view(), search);
      ASSERT_EQ(finding.status, MarkStatus::found) << name_of(finding.status);
      EXPECT_LE(known(finding, search, finding.u_px - scene.truth_px()).norm(), 0.002);
    }
  }
}

TEST_P(Shapes, SoftAndFaintOnesAreFoundAsWell) {
  for (const double blur : {0.5, 1.5, 2.5}) {
    for (const double contrast : {25.0, 60.0, -60.0}) {
      ShapeScene scene = random_scene(GetParam(), random_);
      scene.mark = 100;
      scene.background = scene.mark + contrast;
      scene.blur_px = blur;
      const MarkSearch search = search_of(scene);
      const MarkFinding finding = find_shape(expose(paint(drawing_of(scene)), noise, random_).view(), search);
      ASSERT_EQ(finding.status, MarkStatus::found)
          << name_of(finding.status) << " blur " << blur << " contrast " << contrast;
      // Chance of 1e-4 with two degrees of freedom, and what rounded tips shift.
      EXPECT_LT(mahalanobis2(finding, search, finding.u_px - scene.truth_px()), 18.4) << blur << contrast;
      EXPECT_NEAR(finding.blur_px, std::hypot(blur, 0.29), 0.1 + 20 / std::abs(contrast) * 0.2);
      EXPECT_NEAR(finding.contrast, std::abs(contrast), 4);
    }
  }
}

// One end of the edge is covered, and the place is asked for far beyond the other one: its angle counts. The
// scatter across against the covariance, on either side.
TEST(ShapeEdge, TheCovarianceIsThatOfThePlaceAskedFor) {
  for (const double expected_v : {8.0, 51.0}) {
    PolygonDrawing drawing;
    drawing.width_px = drawing.height_px = 60;
    drawing.background = 60;
    drawing.polygons = {{{{30.3, -20}, {90, -20}, {90, 90}, {30.3, 90}}, 160},
                        {{{-20, 34}, {90, 34}, {90, 90}, {-20, 90}}, 100}};
    const test::Picture picture = paint(drawing);
    MarkSearch search;
    search.kind = MarkKind::edge;
    search.expected_px = {30, expected_v};
    search.half_window_px = {40, 60};
    search.min_diameter_px = 10;
    search.max_diameter_px = 100;
    search.direction_tolerance_rad = 0.3;
    std::mt19937_64 random(7);
    constexpr int draws = 300;
    double squares = 0, variances = 0, found = 0;
    for (int draw = 0; draw < draws; ++draw) {
      const test::Pixels pixels = expose(picture, 2, random);
      const MarkFinding finding = find_marks(pixels.view(), {&search, 1}).front();
      if (finding.status != MarkStatus::found) continue;
      ++found;
      const Vector2d n = unit(finding.direction_rad);
      squares += std::pow(n.dot(finding.u_px - Vector2d(30.3, expected_v)), 2);
      variances += n.dot(finding.covariance_px2 * n);
    }
    EXPECT_GT(found, 0.97 * draws);
    // Three hundred draws know a scatter to 4 %: four sigma.
    EXPECT_NEAR(std::sqrt(squares / variances), 1, 0.17) << expected_v;
  }
}

// A gap: two edges of opposite sense. 300 edges: the mean squares of 1 +- sqrt(2 / 300), against their own
// covariance and against the bound (which the whole picture has, the band has not).
TEST(ShapeGap, BothEdgesReachTheBound) {
  double own = 0, squares = 0, bound = 0;
  constexpr int phases = 15, draws = 20, count = phases * draws;
  std::mt19937_64 random(12);
  for (int phase = 0; phase < phases; ++phase) {
    const ShapeScene scene{MarkKind::edge, {3.3 + 0.07 * phase, 0.3 * phase, 7.5 + 0.5 * phase}, 60};
    MarkSearch search = search_of(scene);
    search.direction_tolerance_rad = 0.3;
    search.direction_rad = scene.parameters[1];
    const Picture picture = paint(drawing_of(scene));
    bound += bound_of(scene, noise)(0, 0) / phases;
    for (int draw = 0; draw < draws; ++draw) {
      const MarkFinding finding = find_marks(expose(picture, noise, random).view(), {&search, 1}).front();
      ASSERT_EQ(finding.status, MarkStatus::found) << name_of(finding.status) << ' ' << phase;
      const Vector2d off = finding.u_px - scene.truth_px();
      own += mahalanobis2(finding, search, off) / count;
      squares += known(finding, search, off).squaredNorm() / count;
    }
  }
  EXPECT_NEAR(own, 1, 4 * std::sqrt(2.0 / count));
  EXPECT_LT(squares / bound, 1.2 * 1.2 * (1 + 2 * std::sqrt(2.0 / count)));
}

// ---- laws

Pixels pixels_of(const ShapeScene& scene, std::mt19937_64& random) {
  return expose(paint(drawing_of(scene)), noise, random);
}

Pixels canvas_with(const Pixels& pixels, int at_u, int at_v) {
  Pixels canvas{100, 100, 100, std::vector<std::uint8_t>(100 * 100, 128)};
  for (int v = 0; v < pixels.height_px; ++v) {
    for (int u = 0; u < pixels.width_px; ++u) {
      canvas.grey[std::size_t((v + at_v) * 100 + u + at_u)] =
          pixels.grey[std::size_t(v * pixels.width_px + u)];
    }
  }
  return canvas;
}

TEST_P(Shapes, ShiftByWholePixelsIsExact) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  const Pixels pixels = pixels_of(scene, random_);
  const auto at = [&](int u, int v) {
    MarkSearch search = search_of(scene);
    search.expected_px += Vector2d(u, v);
    return find_shape(canvas_with(pixels, u, v).view(), search);
  };
  const MarkFinding a = at(3, 31), b = at(24, 11);
  ASSERT_EQ(a.status, MarkStatus::found) << name_of(a.status);
  EXPECT_LT((b.u_px - a.u_px - Vector2d(21, -20)).norm(), 1e-12);
  EXPECT_EQ(a.covariance_px2, b.covariance_px2);
}

// The search goes by rows and the sums in single precision; what is left is far below the noise.
TEST_P(Shapes, TurnsWithThePicture) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  const MarkSearch search = search_of(scene);
  const Pixels pixels = pixels_of(scene, random_);
  Pixels turned = pixels;  // (u, v) goes to (side - 1 - v, u)
  const int side = scene.side_px;
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) {
      turned.grey[std::size_t(u * side + side - 1 - v)] = pixels.grey[std::size_t(v * side + u)];
    }
  }
  const MarkFinding a = find_shape(pixels.view(), search), b = find_shape(turned.view(), search);
  ASSERT_EQ(a.status, MarkStatus::found) << name_of(a.status);
  ASSERT_EQ(b.status, MarkStatus::found) << name_of(b.status);
  const Vector2d expected(side - 1 - a.u_px.y(), a.u_px.x());
  EXPECT_LT(known(b, search, b.u_px - expected).norm(), 0.1 * sigma_of(a, search));
}

// Without noise: relative shading of the inverse is not the inverse of relative shading, so that the two take
// noise up differently, by half of its sigma.
TEST_P(Shapes, InverseOfThePictureIsTheSameMark) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  MarkSearch search = search_of(scene);
  DeepPixels pixels = expose_deep(paint(drawing_of(scene)), 65535, 0, random_);
  const MarkFinding a = find_shape(pixels.view(), search);
  for (auto& count : pixels.count) count = static_cast<std::uint16_t>(65535 - count);
  search.bright = true;
  const MarkFinding b = find_shape(pixels.view(), search);
  ASSERT_EQ(a.status, MarkStatus::found) << name_of(a.status);
  ASSERT_EQ(b.status, MarkStatus::found) << name_of(b.status);
  EXPECT_LT(known(a, search, a.u_px - b.u_px).norm(), 0.0005);
  const double turn = std::remainder(b.direction_rad - a.direction_rad, 2 * pi);
  EXPECT_NEAR(std::abs(turn), GetParam() == MarkKind::edge ? pi : 0, 0.01);
  if (GetParam() == MarkKind::edge) return;
  search.bright = false;
  EXPECT_NE(find_shape(pixels.view(), search).status, MarkStatus::found);
}

TEST_P(Shapes, GainAndOffsetDoNotMatter) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  const MarkSearch search = search_of(scene);
  DeepPixels pixels = expose_deep(paint(drawing_of(scene)), 65535, noise, random_);
  const MarkFinding a = find_shape(pixels.view(), search);
  DeepPixels half = pixels;
  for (auto& count : half.count) count = static_cast<std::uint16_t>(count / 2);
  const MarkFinding b = find_shape(half.view(), search);
  for (auto& count : pixels.count) count = static_cast<std::uint16_t>(count / 2 + 9000);
  const MarkFinding c = find_shape(pixels.view(), search);
  ASSERT_EQ(a.status, MarkStatus::found) << name_of(a.status);
  ASSERT_EQ(b.status, MarkStatus::found) << name_of(b.status);
  ASSERT_EQ(c.status, MarkStatus::found) << name_of(c.status);
  EXPECT_LT(known(a, search, a.u_px - b.u_px).norm(), 0.02 * sigma_of(a, search));
  EXPECT_LT(known(a, search, a.u_px - c.u_px).norm(), 0.3 * sigma_of(a, search));
  EXPECT_NEAR(sigma_of(b, search), sigma_of(a, search), 0.01 * sigma_of(a, search));
}

// The same picture in both depths differs by rounding: sqrt(1/12) of the 2 grey levels of noise.
TEST_P(Shapes, EightAndSixteenBitsAgree) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  const MarkSearch search = search_of(scene);
  const DeepPixels deep = expose_deep(paint(drawing_of(scene)), 4095, noise, random_);
  Pixels flat{scene.side_px, scene.side_px, scene.side_px, {}};
  for (const auto count : deep.count) flat.grey.push_back(std::uint8_t(std::lround(count * 255.0 / 4095)));
  const MarkFinding a = find_shape(deep.view(), search), b = find_shape(flat.view(), search);
  ASSERT_EQ(a.status, MarkStatus::found) << name_of(a.status);
  ASSERT_EQ(b.status, MarkStatus::found) << name_of(b.status);
  EXPECT_LT(known(a, search, a.u_px - b.u_px).norm(), 4 * 0.15 * sigma_of(a, search));
}

// A smaller window sees less of the mark: the places differ by what the part that is gone had to say.
TEST_P(Shapes, WindowMattersOnlyByWhatItHolds) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  MarkSearch search = search_of(scene);
  const Pixels pixels = pixels_of(scene, random_);
  const MarkFinding whole = find_shape(pixels.view(), search);
  search.half_window_px = {26.3, 25.6};
  search.min_diameter_px *= 0.8;
  const MarkFinding part = find_shape(pixels.view(), search);
  ASSERT_EQ(whole.status, MarkStatus::found) << name_of(whole.status);
  ASSERT_EQ(part.status, MarkStatus::found) << name_of(part.status);
  const double more =
      std::max(0.0, std::pow(sigma_of(part, search), 2) - std::pow(sigma_of(whole, search), 2));
  EXPECT_LT(known(whole, search, whole.u_px - part.u_px).norm(),
            4 * std::sqrt(more) + 0.5 * sigma_of(whole, search));
}

TEST_P(Shapes, RepeatBitByBit) {
  const ShapeScene scene = random_scene(GetParam(), random_);
  const Pixels pixels = pixels_of(scene, random_);
  const MarkFinding a = find_shape(pixels.view(), search_of(scene)),
                    b = find_shape(pixels.view(), search_of(scene));
  EXPECT_EQ(a.u_px, b.u_px);
  EXPECT_EQ(a.covariance_px2, b.covariance_px2);
  EXPECT_EQ(a.quality, b.quality);
}

}  // namespace
}  // namespace zeropose
