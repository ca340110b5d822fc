// Lines of light: centres, their sigmas, the points of both cameras. Truth by other ways than the renderer's.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "measure/light_lines.h"
#include "measure/stereo_lines.h"
#include "measure/triangulation.h"
#include "measure/wheel_axis.h"
#include "tests/measure/wheel_scene.h"
#include "tests/support/sanitized.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int side_px = 200;

// A straight line of light u = at + slope v, its section the bell curve of `sigma_px` across the line, by its
// formula at the pixels' centres.
std::vector<std::uint8_t> straight(double at, double slope, double contrast, double sigma_px,
                                   double noise_grey, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, noise_grey);
  std::vector<std::uint8_t> pixels;
  for (int v = 0; v < side_px; ++v) {
    for (int u = 0; u < side_px; ++u) {
      const double off = (u - at - slope * v) / std::hypot(1, slope) / sigma_px;
      pixels.push_back(
          static_cast<std::uint8_t>(std::lround(30 + contrast * std::exp(-off * off / 2) + noise(random))));
    }
  }
  return pixels;
}

ImageView view(const std::vector<std::uint8_t>& pixels) { return {pixels.data(), side_px, side_px, side_px}; }

TEST(LightLines, CentresHaveTheirSigmasAndNoBias) {
  std::mt19937_64 random(1);
  const LightLineSearch search;
  double sum = 0, squares = 0, mean_squares = 0;
  int count = 0;
  const int lines = trials(80);
  for (int i = 0; i < lines; ++i) {
    const double slope = 0.6 * (i % 9 - 4) / 4, at = 100 + 0.013 * i - 100 * slope;
    const auto pixels = straight(at, slope, 40, search.sigma_px, 2, random);
    const LightLines found = find_light_lines(view(pixels), search);
    ASSERT_EQ(found.upright.size(), 1U) << slope;
    double mean = 0, mean_sigma = 0;
    int used = 0;
    for (const LineCentre& centre : found.upright.front().centres) {
      if (centre.at < 10 || centre.at > side_px - 10) continue;
      const double off = centre.place - (at + slope * centre.at);
      sum += off, squares += std::pow(off / centre.sigma_px, 2), ++count;
      mean += off, mean_sigma += centre.sigma_px, ++used;
    }
    EXPECT_GT(used, 175);
    mean /= used, mean_sigma /= used;
    mean_squares += mean * mean / (mean_sigma * mean_sigma / used) / lines;
  }
  std::cout << "bias " << sum / count << " px, error / sigma " << std::sqrt(squares / count)
            << ", of the mean of a line (neighbours gain) " << mean_squares << " of "
            << neighbours_gain(search) << "\n";
  // 80 lines of about 30 independent places: 5 sigmas of the scale are 5 / sqrt(2 * 2400) = 7 %; the noise of
  // the second derivative and of the pixels' rounding is not in the sigmas.
  EXPECT_NEAR(std::sqrt(squares / count), 1, trials(80) == 80 ? 0.12 : 0.25);
  EXPECT_LT(std::abs(sum / count), 0.005);
  // The mean square of 80 normal variables has the relative sigma sqrt(2 / 80) = 16 %; 4 sigmas.
  EXPECT_NEAR(mean_squares / neighbours_gain(search), 1, 0.64 * std::sqrt(80.0 / lines));
}

TEST(LightLines, AreFoundInBothCoursesAndNotInNoise) {
  std::mt19937_64 random(2);
  auto pixels = straight(60, 0.1, 40, 1.7, 2, random);
  const LightLines upright = find_light_lines(view(pixels), {});
  EXPECT_EQ(upright.upright.size(), 1U);
  EXPECT_EQ(upright.level.size(), 0U);
  std::vector<std::uint8_t> turned(pixels.size());
  for (std::size_t v = 0; v < side_px; ++v)
    for (std::size_t u = 0; u < side_px; ++u) turned[u * side_px + v] = pixels[v * side_px + u];
  const LightLines level = find_light_lines(view(turned), {});
  EXPECT_EQ(level.upright.size(), 0U);
  ASSERT_EQ(level.level.size(), 1U);
  const LightLine &a = upright.upright.front(), &b = level.level.front();
  for (double at = 20; at < 180; at += 1) EXPECT_NEAR(*a.place_at(at), *b.place_at(at), 1e-6);
  const auto nothing = straight(60, 0.1, 0, 1.7, 6, random);
  EXPECT_TRUE(find_light_lines(view(nothing), {}).upright.empty());
}

// ---- on the tyre: the curve where a plane of light cuts the side wall, by bisection round the axis

const TyreSurface& plain_surface() {
  static const TyreSurface surface(example_tyres()[1]);
  return surface;
}

Vector3d on_tyre(double radius_mm, double angle) {
  return {radius_mm * std::cos(angle), radius_mm * std::sin(angle), plain_surface().section(radius_mm).z_mm};
}

double centre_angle(const WheelCell& cell, const Pose& X_WO, std::size_t sensor, std::size_t line,
                    double radius_mm) {
  const LineProjector& projector = cell.projectors[sensor];
  const Vector3d n_W = projector.X_WP.linear() * projector.lines[line].n_P;
  const auto off = [&](double angle) {
    const Vector3d p_W = X_WO * on_tyre(radius_mm, angle);
    return n_W.dot(p_W - projector.X_WP.translation());
  };
  double low = cell.angles_rad[sensor] - 0.3, high = cell.angles_rad[sensor] + 0.3;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    ((off(middle) < 0) == (off(low) < 0) ? low : high) = middle;
  }
  return low;
}

WheelCell plain_cell() {
  TyreShape tyre = example_tyres()[1];
  tyre.lettering.clear();
  return wheel_cell(tyre);
}

// Lens and search smooth along the line as well, with 1.7 and 0.8 px, about 0.65 mm: at the sharpest ridge
// (bend 0.66 / mm) that takes 0.65^2 / 2 * 0.66 = 0.14 mm off its top, about 0.1 px here, alike on all lines.
// Another projection (bisection of the lens) than the renderer's rays.
TEST(WheelPictures, LinesAreWhereTheirPlanesCutTheTyre) {
  const WheelCell cell = plain_cell();
  const Pose X_WO = tilted_wheel(-2.4, 1.7, {4, -3, 5});
  CleanPictures clean = rendered(cell, X_WO);
  std::uint64_t noise = 1;
  const WheelPictures pictures = exposed(clean, noise, 0);
  double sum = 0, worst = 0;
  int count = 0;
  for (std::size_t c = 0; c < wheel_cameras; ++c) {
    const CameraModel& model = cell.cameras[c].model;
    LineArrayProblem problem;
    problem.image = {pictures[c].data(), model.width_px, model.height_px, model.width_px};
    const LineArrayResult array = order_lines(problem);
    ASSERT_EQ(array.status, LineArrayStatus::ok) << array.reason;
    for (std::size_t r = 0; r < radial_lines; ++r) {
      for (double radius_mm = cell.tyre.bead_mm + 8; radius_mm < cell.tyre.tread_mm - 8; radius_mm += 1.3) {
        const double angle = centre_angle(cell, X_WO, c / 2, r, radius_mm);
        const Vector2d u = photograph(model, cell.cameras[c].X_WC, X_WO * on_tyre(radius_mm, angle));
        bool near_crossing = false;
        for (const auto& row : array.crossings) near_crossing |= row[r] && std::abs(row[r]->y() - u.y()) < 8;
        if (near_crossing) continue;
        const auto found = array.radial[r].place_at(u.y());
        ASSERT_TRUE(found);
        sum += *found - u.x(), ++count;
        worst = std::max(worst, std::abs(*found - u.x()));
      }
    }
  }
  std::cout << count << " places: mean " << sum / count << " px, worst " << worst << " px\n";
  EXPECT_GT(count, 900);
  EXPECT_LT(std::abs(sum / count), 0.01);
  EXPECT_LT(worst, 0.2);
}

TEST(StereoLines, GiveThePointsThatTriangulateGives) {
  const WheelCell cell = plain_cell();
  const Pose X_WO = tilted_wheel(1.4, -1.7);
  // Both lines by projection, at whole rows as a finder gives them.
  const auto line_in = [&](std::size_t c) {
    LightLine line;
    std::vector<Vector2d> u;
    for (double radius_mm = 225; radius_mm < 305; radius_mm += 0.1)
      u.push_back(photograph(cell.cameras[c].model, cell.cameras[c].X_WC,
                             X_WO * on_tyre(radius_mm, centre_angle(cell, X_WO, 0, 1, radius_mm))));
    std::ranges::sort(u, {}, [](const Vector2d& p) { return p.y(); });
    for (std::size_t i = 0; i + 1 < u.size(); ++i) {
      const double row = std::floor(u[i + 1].y());
      if (row < u[i].y()) continue;
      const double part = (row - u[i].y()) / (u[i + 1].y() - u[i].y());
      line.centres.push_back({row, u[i].x() + part * (u[i + 1].x() - u[i].x()), 0.05});
    }
    return line;
  };
  const LightLine left = line_in(0), right = line_in(1);
  const SideLine points = points_on_line(cell.cameras[0], left, cell.cameras[1], right);
  ASSERT_GT(points.size(), 150U);
  const CalibratedCamera cameras[] = {cell.cameras[0], cell.cameras[1]};
  for (const SidePoint& point : points) {
    // Where both cameras see it, from nothing but the point; triangulate() must return it.
    Observation observations[2];
    for (std::size_t c = 0; c < 2; ++c) {
      observations[c].camera = c;
      observations[c].u_px = photograph(cameras[c].model, cameras[c].X_WC, point.p_W_mm);
    }
    const LightLine& l = left;
    EXPECT_NEAR(*l.place_at(observations[0].u_px.y()), observations[0].u_px.x(), 1e-6);
    EXPECT_NEAR(right.place_at(observations[1].u_px.y()).value_or(0), observations[1].u_px.x(), 2e-3);
    const TriangulatedPoint triangulated = triangulate({cameras, observations, 0});
    ASSERT_EQ(triangulated.code, Code::ok) << triangulated.reason;
    EXPECT_LT((triangulated.p_W_mm - point.p_W_mm).norm(), 1e-5);
    // And it is on the tyre: rows a third of a millimetre apart, straight between them.
    const Vector3d p_O = X_WO.inverse() * point.p_W_mm;
    EXPECT_NEAR(p_O.z(), plain_surface().section(p_O.head<2>().norm()).z_mm, 0.03);
  }
}

// ---- the axis of a surface of revolution

std::vector<SideLine> nine_lines(const Pose& X_WO, const std::function<double(double)>& section) {
  std::vector<SideLine> lines;
  for (int i = 0; i < 9; ++i) {
    const double angle = (90 + 120 * (i / 3) + 8 * (i % 3 - 1)) / degrees_per_radian;
    SideLine& line = lines.emplace_back();
    for (double r = 220; r < 310; r += 0.5)
      line.push_back({X_WO * Vector3d(r * std::cos(angle), r * std::sin(angle), section(r)), Vector3d::Zero(),
                      Vector3d::Zero()});
  }
  return lines;
}

TEST(WheelAxis, IsFoundFromAFarStart) {
  const Pose X_WO = tilted_wheel(-3, 2, {12, -9, 15});
  const auto lines = nine_lines(X_WO, [](double r) { return plain_surface().section(r).z_mm; });
  const auto axis = fit_axis(lines, {});
  ASSERT_TRUE(axis);
  EXPECT_LT(axis->n_W.cross(X_WO.linear().col(2)).norm(), 1e-4);  // 0.006 deg: of its spline
  EXPECT_LT(axis->place(X_WO.translation()).radius_mm, 0.05);
}

TEST(WheelAxis, OfAFlatDiscIsNotDetermined) {
  const auto lines = nine_lines(tilted_wheel(1, 1), [](double) { return 3.0; });
  EXPECT_FALSE(fit_axis(lines, {}));
}

}  // namespace
}  // namespace zeropose::test
