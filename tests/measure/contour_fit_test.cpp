// The engine under the marks with straight edges: its outlines, their derivatives, and the fit itself.
#include "measure/contour_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "measure/edge_mark_judge.h"
#include "measure/normal_bell.h"
#include "tests/support/outline_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Polygon;
using test::PolygonDrawing;
using test::ShapeScene;

struct Family {
  std::string name;
  std::shared_ptr<ContourShape> shape;
  ShapeParameters at = ShapeParameters::Zero();
  ShapeScene scene;  // the same about the middle of a picture
};

ShapeParameters parameters(std::initializer_list<double> values) {
  ShapeParameters at = ShapeParameters::Zero();
  Eigen::Index k = 0;
  for (const double value : values) at(k++) = value;
  return at;
}

std::vector<Family> families() {
  std::vector<Family> all;
  all.push_back({"edge",
                 std::make_shared<EdgeShape>(-25, 25),
                 parameters({0.3, 0.7}),
                 {MarkKind::edge, {0.3, 0.7}, 61}});
  for (const double opening : {0.9, 1.5, 2.4}) {
    all.push_back({"corner",
                   std::make_shared<CornerShape>(25, 25),
                   parameters({0.2, -0.4, -2.1, -2.1 + opening}),
                   {MarkKind::corner, {0.2, -0.4, -2.1, -2.1 + opening}, 61}});
  }
  // M is the inverse of the half axes (9, 2) and (-3, 5).
  const double d = 9 * 5 + 3 * 2;
  const ShapeParameters slot = parameters({-0.3, 0.1, 5 / d, 3 / d, -2 / d, 9 / d, 1.3});
  all.push_back(
      {"slot", std::make_shared<SlotShape>(slot), slot, {MarkKind::slot, {-0.3, 0.1, 9, 2, -3, 5, 1.3}, 61}});
  for (const double opening : {1.0, std::numbers::pi / 2, 2.0}) {
    all.push_back({"cross",
                   std::make_shared<CrossShape>(std::array<double, 4>{25, 25, 25, 25}),
                   parameters({0.4, 0.3, 0.5, 0.5 + opening, 3.4}),
                   {MarkKind::cross, {0.4, 0.3, 0.5, 0.5 + opening, 3.4, 90, 90, 90, 90}, 61}});
  }
  return all;
}

double blur_of_picture(double lens_px) { return std::hypot(lens_px, std::sqrt(1.0 / 12)); }

ContourBlock row_of(const Family& family, double x0, double y, const ShapeParameters& at, double blur_px) {
  ContourBlock block{};
  for (std::size_t i = 0; i < contour_block; ++i) {
    block.x[i] = static_cast<float>(x0 + double(i));
    block.y[i] = static_cast<float>(y);
  }
  family.shape->evaluate(at, blur_px, block);
  return block;
}

// How far, px, a point of the outline goes per unit of a parameter, at most.
double lever_of(const Family& family, int k) {
  if (family.name == "slot") return k < 2 ? 1 : k < 6 ? 150 : 10;
  if (family.name == "edge") return k == 0 ? 1 : 30;
  return k == 2 || k == 3 ? 30 : 1;
}

// The cover at parameter k moved by a step; k beyond the last one: the blur.
ContourBlock moved(const Family& family, double x0, double y, int k, double step) {
  ShapeParameters at = family.at;
  const bool blur = k == family.shape->size();
  if (!blur) at(k) += step;
  return row_of(family, x0, y, at, blur ? 0.8 + step : 0.8);
}

void expect_derivatives(const Family& family, double x0, double y, int k) {
  const double lever = k == family.shape->size() ? 1 : lever_of(family, k), h = 0.04 / lever;
  const ContourBlock block = row_of(family, x0, y, family.at, 0.8);
  const ContourBlock a = moved(family, x0, y, k, h), b = moved(family, x0, y, k, -h),
                     c = moved(family, x0, y, k, 2 * h), d = moved(family, x0, y, k, -2 * h);
  for (std::size_t i = 0; i < contour_block; ++i) {
    const double numeric =
        (8 * (double(a.cover[i]) - double(b.cover[i])) - double(c.cover[i]) + double(d.cover[i])) / (12 * h);
    const double analytic = k == family.shape->size() ? block.by_blur[i] : block.by_shape[k][i];
    EXPECT_NEAR(analytic, numeric, 3e-4 * lever)
        << family.name << " parameter " << k << " at " << x0 + double(i) << ' ' << y;
  }
}

// Differences over 0.04 px of movement: single precision leaves 1e-6 / 0.04, the polynomials of the normal
// distribution as much, the fifth derivative 0.04^4 / 30 of it. A slot's outline bends suddenly where its
// caps begin and at its middle line: there differences tell nothing.
TEST(ContourShapes, DerivativesAgreeWithFiniteDifferences) {
  for (const Family& family : families()) {
    for (double y = -20; y <= 20; y += 1) {
      for (const double x0 : {-20.0, -4.0, 5.0}) {
        for (int k = 0; k <= family.shape->size(); ++k) expect_derivatives(family, x0, y, k);
      }
    }
  }
}

// The cover is the blurred picture, but for pixels being squares: 0.003 of the contrast at a straight edge of
// this blur. The slot's caps are taken as straight across the outline: s^2 / (2 r) of shift,
// r 3.6 px there, is 0.12 px of 0.4 per px of slope.
TEST(ContourShapes, CoverIsThePaintedPicture) {
  for (Family family : families()) {
    family.scene.blur_px = 0.9;
    family.scene.mark = 0;
    family.scene.background = 1;
    const test::Picture picture = paint(drawing_of(family.scene));
    const double room = family.name == "slot" ? 0.07 : 0.006;
    for (int j = 5; j < 56; ++j) {
      for (int i = 3; i + 16 < 58; i += 13) {
        const ContourBlock block = row_of(family, i - 30, j - 30, family.at, blur_of_picture(0.9));
        for (std::size_t k = 0; k < contour_block; ++k) {
          EXPECT_NEAR(block.cover[k], picture.grey[std::size_t(j * 61 + i) + k], room)
              << family.name << ' ' << i + int(k) << ' ' << j;
        }
      }
    }
  }
}

TEST(Binormal, ExcessIsTheIntegralOfTheDensity) {
  for (const double rho : {-0.85, -0.3, 0.1, 0.39, 0.41, 0.88}) {
    EXPECT_NEAR(BinormalExcess(rho)(0, 0), std::asin(rho) / (2 * std::numbers::pi), 1e-6) << rho;
    for (const double h : {-1.2, 0.4, 2.0}) {
      for (const double k : {-0.7, 1.1}) {
        // P(X < h, Y < k) by rows: density of X times P(Y < k | X), midpoint rule.
        double sum = 0;
        constexpr double step = 1e-3;
        const auto below = [](double t) { return 0.5 * std::erfc(-t / std::numbers::sqrt2); };
        for (double x = -8 + step / 2; x < h; x += step) {
          sum += step * std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi) *
                 below((k - rho * x) / std::sqrt(1 - rho * rho));
        }
        EXPECT_NEAR(BinormalExcess(rho)(h, k), sum - below(h) * below(k), 1e-5)
            << rho << ' ' << h << ' ' << k;
      }
    }
  }
}

GreyWindow window_of(const ImageView& image) {
  GreyWindow window;
  window.pixels = {0, 0, image.width_px - 1, image.height_px - 1};
  copy_greys(image, window.pixels, window.grey);
  window.rounding_variance = image.grey_per_count() * image.grey_per_count() / 12;
  return window;
}

ContourFit fit_of(const Family& family, const GreyWindow& window, double off = 0.2) {
  ContourStart start;
  start.origin_i = start.origin_j = 30;
  start.shape = family.at;
  start.shape(0) += off;
  ContourWorkspace workspace;
  return fit_contour(window, *family.shape, start, workspace);
}

TEST(ContourFitting, FindsShapeLevelsBlurAndNoise) {
  for (Family family : families()) {
    for (const double blur : {0.5, 0.9, 2.0}) {
      std::mt19937_64 random(4);
      family.scene.blur_px = blur;
      const ContourFit fit =
          fit_of(family, window_of(expose(paint(drawing_of(family.scene)), 2, random).view()));
      ASSERT_TRUE(fit.converged) << family.name << ' ' << blur;
      // Four sigma; the scene is in other numbers than the slot's, and its size is a little off (see above).
      const int checked = family.name == "slot" ? 2 : family.shape->size();
      for (int k = 0; k < checked; ++k) {
        EXPECT_NEAR(fit.shape(k), family.at(k), 4.5 * std::sqrt(fit.covariance(k, k)))
            << family.name << ' ' << blur << ' ' << k;
      }
      EXPECT_NEAR(fit.mark_grey, 60, 3) << family.name << ' ' << blur;
      EXPECT_NEAR(fit.background_grey, 160, 3) << family.name << ' ' << blur;
      EXPECT_NEAR(fit.blur_px, blur_of_picture(blur), 0.08) << family.name;
      EXPECT_NEAR(fit.edge_rms, 2, 0.3) << family.name << ' ' << blur;
      EXPECT_EQ(fit.outline_share, 1) << family.name << ' ' << blur;
    }
  }
}

// Without noise the residuals of a deep picture are far below a count of eight bits, but its counts are
// rounded all the same: the covariance says so.
TEST(ContourFitting, CovarianceIsNeverBelowThatOfRounding) {
  for (const Family& family : families()) {
    std::mt19937_64 random(4);
    GreyWindow window = window_of(expose_deep(paint(drawing_of(family.scene)), 65535, 0, random).view());
    const double fine = fit_of(family, window).covariance(0, 0);
    window.rounding_variance = 4;
    const ContourFit coarse = fit_of(family, window);
    ASSERT_TRUE(coarse.converged) << family.name;
    const double bound = bound_of(family.scene, std::sqrt(4 - 1.0 / 12))(0, 0);
    EXPECT_GT(coarse.covariance(0, 0), 0.9 * bound) << family.name;
    EXPECT_LT(fine, 0.05 * bound) << family.name;
  }
}

// Something laid over a piece of the outline is left out, stretch by stretch; what remains fits as before.
class ContourPieces : public testing::TestWithParam<double> {};

TEST_P(ContourPieces, CoveredOnesAreLeftOut) {
  const double grey = GetParam();
  const Family family = families()[0];
  PolygonDrawing drawing = drawing_of(family.scene);
  const Vector2d n(std::cos(0.7), std::sin(0.7)), t(-n.y(), n.x()), at = family.scene.middle() + 8 * t;
  const auto covered = [&](double half) {
    PolygonDrawing more = drawing;
    more.polygons.push_back(
        {{at - half * t - 3 * n, at + half * t - 3 * n, at + half * t + 3 * n, at - half * t + 3 * n}, grey});
    std::mt19937_64 random(8);
    return fit_of(family, window_of(expose(paint(more), 2, random).view()));
  };
  const ContourFit little = covered(4);
  ASSERT_TRUE(little.converged);
  EXPECT_LT(little.outline_share, 0.9);
  EXPECT_GE(little.outline_share, contour_least_share);
  EXPECT_NEAR(little.shape(0), 0.3, 4.5 * std::sqrt(little.covariance(0, 0)));
  const ContourFit much = covered(11);  // 44 %
  EXPECT_TRUE(!much.converged || much.edge_rms > 8);
}
INSTANTIATE_TEST_SUITE_P(Greys, ContourPieces, testing::Values(0.0, 110.0, 250.0));

TEST(ContourFitting, RepeatsBitByBit) {
  for (const Family& family : families()) {
    std::mt19937_64 random(4);
    const GreyWindow window = window_of(expose(paint(drawing_of(family.scene)), 2, random).view());
    const ContourFit a = fit_of(family, window), b = fit_of(family, window);
    EXPECT_EQ(a.shape, b.shape);
    EXPECT_EQ(a.covariance, b.covariance);
  }
}

TEST(ContourFitting, FlatPictureDoesNotConverge) {
  for (const Family& family : families()) {
    std::mt19937_64 random(4);
    PolygonDrawing drawing = drawing_of(family.scene);
    drawing.polygons.clear();
    const ContourFit fit = fit_of(family, window_of(expose(paint(drawing), 2, random).view()));
    EXPECT_TRUE(!fit.converged || std::abs(fit.background_grey - fit.mark_grey) < 4) << family.name;
  }
}

}  // namespace
}  // namespace zeropose
