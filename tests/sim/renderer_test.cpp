#include "sim/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "example_cells.h"
#include "outline.h"
#include "sim/random.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Outline;
using test::outline_of;
using Picture = std::vector<float>;

// Distance to the outline, negative inside.
double distance_px(const Outline& outline, const Vector2d& u_px) {
  const Vector2d nearest = *std::ranges::min_element(
      outline.points, {}, [&](const Vector2d& point) { return (point - u_px).norm(); });
  const bool inside = (u_px - outline.centroid).norm() < (nearest - outline.centroid).norm();
  return (inside ? -1 : 1) * (nearest - u_px).norm();
}

// Calls visit(pixel index, pixel) for the pixels within `reach_px` of a place.
template <typename Visit>
void for_pixels_round(const CameraModel& camera, const Vector2d& middle, double reach_px, Visit visit) {
  const auto from = [reach_px](double x) { return std::max(0, static_cast<int>(std::ceil(x - reach_px))); };
  const auto to = [reach_px](double x, int size) {
    return std::min(size - 1, static_cast<int>(std::floor(x + reach_px)));
  };
  for (int v = from(middle.y()); v <= to(middle.y(), camera.height_px); ++v)
    for (int u = from(middle.x()); u <= to(middle.x(), camera.width_px); ++u)
      if ((Vector2d(u, v) - middle).norm() <= reach_px)
        visit(static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width_px) +
                  static_cast<std::size_t>(u),
              Vector2d(u, v));
}

float grey_at(const CameraModel& camera, const Picture& picture, const Vector2d& u_px) {
  return picture[static_cast<std::size_t>(std::lround(u_px.y())) * static_cast<std::size_t>(camera.width_px) +
                 static_cast<std::size_t>(std::lround(u_px.x()))];
}

// Where the darkness round `middle` has its centre of gravity. Needs an even surface and even light.
Vector2d darkness_centroid(const CameraModel& camera, const Picture& picture, const Vector2d& middle,
                           double radius_px) {
  const double surface = grey_at(camera, picture, middle + Vector2d(radius_px + 6, 0));
  double sum = 0;
  Vector2d moment = Vector2d::Zero();
  for_pixels_round(camera, middle, radius_px + 6.5, [&](std::size_t i, const Vector2d& u) {
    sum += surface - picture[i];
    moment += (surface - picture[i]) * u;
  });
  return moment / sum;
}

const Mark& mark_of(const Scene& scene, const View& view) { return scene.marks[view.mark]; }
const CameraModel& model_of(const Scene& scene, const View& view) { return scene.cameras[view.camera].model; }

std::vector<Picture> all_pictures(const Scene& scene, const Pose& X_WO, const Faults& faults = {}) {
  std::vector<Picture> pictures;
  for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera)
    pictures.push_back(CameraRenderer(scene, camera).clean_picture(X_WO, faults));
  return pictures;
}

// Extremes of the range of poses that cars come in.
const std::vector<SixNumbers> extremes{{30, 30, 30, 0.2, 0.2, 0.2}, {-30, -30, -30, -0.2, -0.2, -0.2}};

TEST(Renderer, MovesTheMarksAsProjected) {
  const Scene scene = test::flat_car_body();
  for (const SixNumbers& six : {SixNumbers{}, SixNumbers{12.3, -27.1, 18.7, 0.17, -0.08, 0.2}}) {
    const auto pictures = all_pictures(scene, from_six_numbers(six));
    for (const View& view : scene.views) {
      const Outline outline =
          outline_of(scene.cameras[view.camera], mark_of(scene, view), from_six_numbers(six));
      const Vector2d found = darkness_centroid(model_of(scene, view), pictures[view.camera], outline.centroid,
                                               outline.radius_px);
      EXPECT_LT((found - outline.centroid).norm(), 0.002) << mark_of(scene, view).name;
    }
  }
}

TEST(Renderer, RepeatsItselfBitByBitAlsoFromSeveralThreads) {
  const Scene scene = test::car_body();
  const CameraRenderer renderer(scene, 1);
  const Pose X_WO = from_six_numbers({1, 2, 3, 0.1, 0, 0});
  const Picture first = renderer.clean_picture(X_WO);
  Picture second, third;
  std::thread one([&] { second = renderer.clean_picture(X_WO); });
  std::thread two([&] { third = CameraRenderer(scene, 1).clean_picture(X_WO); });
  one.join();
  two.join();
  EXPECT_EQ(first.size(), 768U * 572U);
  EXPECT_TRUE(first == second);
  EXPECT_TRUE(first == third);
  EXPECT_FALSE(first == renderer.clean_picture(from_six_numbers({1, 2, 3.01, 0.1, 0, 0})));
}

TEST(Renderer, ShowsMarksAndSurfacesInTheirGreyAndStaysInRange) {
  const Scene scene = test::car_body();
  const auto pictures = all_pictures(scene, scene.X_WO_nominal);
  const double light = scene.picture.illumination_gradient / 2;  // at most, either way
  for (const View& view : scene.views) {
    const Outline outline = outline_of(scene.cameras[view.camera], mark_of(scene, view), scene.X_WO_nominal);
    const float grey = grey_at(model_of(scene, view), pictures[view.camera], outline.centroid);
    EXPECT_GE(grey, scene.picture.mark_grey * (1 - light)) << mark_of(scene, view).name;
    EXPECT_LE(grey, scene.picture.mark_grey * (1 + light)) << mark_of(scene, view).name;
  }
  for (const Picture& picture : pictures) {
    const auto [darkest, brightest] = std::ranges::minmax(picture);
    EXPECT_GE(darkest, 0);
    EXPECT_LT(std::ranges::count_if(picture, [](float grey) { return grey > 250; }), 400);  // a few glints
    EXPECT_LT(brightest, 300);
  }
}

TEST(Renderer, LightChangesByTheGradientOverThePicture) {
  Scene scene = test::flat_car_body();
  const Picture even = CameraRenderer(scene, 0).clean_picture(scene.X_WO_nominal);
  scene.picture.illumination_gradient = 0.3;
  const Picture lit = CameraRenderer(scene, 0).clean_picture(scene.X_WO_nominal);
  double least = 10, most = 0;
  for (std::size_t i = 0; i < lit.size(); ++i) {
    if (even[i] < 20) continue;
    least = std::min(least, static_cast<double>(lit[i] / even[i]));
    most = std::max(most, static_cast<double>(lit[i] / even[i]));
  }
  EXPECT_GT(most - least, 0.3 * 572 / 957);  // along the shorter side at least
  EXPECT_LT(most - least, 0.3 + 0.01);
}

// 12 px round every outline nothing depends on the clutter, and without light's gradient it is one grey.
TEST(Renderer, ClutterKeepsAwayFromTheMarks) {
  const Scene cluttered = test::car_body();
  Scene bare = cluttered;
  bare.picture.clutter = 0;
  for (const SixNumbers& six : extremes) {
    const Pose X_WO = from_six_numbers(six);
    const auto with = all_pictures(cluttered, X_WO), without = all_pictures(bare, X_WO);
    for (const View& view : cluttered.views) {
      const Outline outline = outline_of(cluttered.cameras[view.camera], mark_of(cluttered, view), X_WO);
      const Picture &a = with[view.camera], &b = without[view.camera];
      double largest = 0;
      for_pixels_round(model_of(cluttered, view), outline.centroid, outline.radius_px + 12,
                       [&](std::size_t i, const Vector2d& u) {
                         if (distance_px(outline, u) < 12)
                           largest = std::max(largest, static_cast<double>(std::abs(a[i] - b[i])));
                       });
      EXPECT_LT(largest, 0.01) << mark_of(cluttered, view).name;
    }
    for (std::size_t camera = 0; camera < with.size(); ++camera) {
      int different = 0;
      for (std::size_t i = 0; i < with[camera].size(); ++i)
        different += std::abs(with[camera][i] - without[camera][i]) > 5 ? 1 : 0;
      EXPECT_GT(different, 1000) << "no clutter in camera " << camera;
    }
  }
}

TEST(Renderer, MarksSitOnEvenSurfaces) {
  const Scene scene = test::flat_car_body();
  const auto pictures = all_pictures(scene, from_six_numbers(extremes.front()));
  for (const View& view : scene.views) {
    const Outline outline =
        outline_of(scene.cameras[view.camera], mark_of(scene, view), from_six_numbers(extremes.front()));
    float darkest = 1000, brightest = 0;
    for_pixels_round(model_of(scene, view), outline.centroid, outline.radius_px + 12,
                     [&](std::size_t i, const Vector2d& u) {
                       const double away = distance_px(outline, u);
                       if (away < 4 || away > 12) return;
                       darkest = std::min(darkest, pictures[view.camera][i]);
                       brightest = std::max(brightest, pictures[view.camera][i]);
                     });
    EXPECT_GE(darkest, 0.9F * 165) << mark_of(scene, view).name;
    EXPECT_LT(brightest - darkest, 0.5F) << mark_of(scene, view).name;
  }
}

TEST(Renderer, ACoveredMarkIsGoneAndNothingElseChanges) {
  const Scene scene = test::car_body();
  const Pose X_WO = from_six_numbers({5, 6, -7, 0, 0, 0.1});
  const CameraRenderer renderer(scene, 1);
  const Picture seen = renderer.clean_picture(X_WO),
                covered = renderer.clean_picture(X_WO, {{"camera2/2"}, {}});
  for (const View& view : scene.views) {
    if (view.camera != 1) continue;
    const Mark& mark = mark_of(scene, view);
    const Outline outline = outline_of(scene.cameras[1], mark, X_WO);
    float darkest = 1000, change = 0;
    for_pixels_round(model_of(scene, view), outline.centroid, outline.radius_px,
                     [&](std::size_t i, const Vector2d&) {
                       darkest = std::min(darkest, covered[i]);
                       change = std::max(change, std::abs(covered[i] - seen[i]));
                     });
    if (mark.name == "camera2/2") {
      EXPECT_GT(darkest, 130) << "something of the mark shows";
    } else {
      EXPECT_EQ(change, 0) << mark.name;
    }
  }
}

TEST(Renderer, ADisplacedMarkSitsThatFarToTheRight) {
  const Scene scene = test::flat_car_body();
  const Pose X_WO = from_six_numbers({-3, 8, 2, 0, 0.1, 0});
  const CameraRenderer renderer(scene, 2);
  for (const double displaced_px : {20.0, -7.5}) {
    const Picture picture = renderer.clean_picture(X_WO, {{}, {{"camera3/2", displaced_px}}});
    for (const View& view : scene.views) {
      if (view.camera != 2) continue;
      const Mark& mark = mark_of(scene, view);
      const Outline outline = outline_of(scene.cameras[2], mark, X_WO);
      const Vector2d off(mark.name == "camera3/2" ? displaced_px : 0, 0);
      const Vector2d found =
          darkness_centroid(model_of(scene, view), picture, outline.centroid + off, outline.radius_px);
      // The eccentricity of an ellipse changes a little with its place.
      EXPECT_LT((found - outline.centroid - off).norm(), 0.01) << mark.name;
    }
  }
}

TEST(Renderer, FaultsOfUnknownMarksChangeNothing) {
  const Scene scene = test::car_body();
  const CameraRenderer renderer(scene, 0);
  EXPECT_TRUE(renderer.clean_picture(scene.X_WO_nominal) ==
              renderer.clean_picture(scene.X_WO_nominal, {{"no such mark"}, {{"nor this", 5}}}));
}

// Sigma of an edge from the profile of a rendered one: the second moment of its derivative is that of the
// blur plus 1/12 for the pixel's box.
TEST(Renderer, EdgesAreAsSoftAsTheBlurAndThePixel) {
  Scene scene = test::flat_car_body();
  for (const double blur_px : {0.5, 0.7, 1.2}) {
    scene.picture.blur_sigma_px = blur_px;
    const Outline outline = outline_of(scene.cameras[0], scene.marks[0], scene.X_WO_nominal);
    const Picture picture = CameraRenderer(scene, 0).clean_picture(scene.X_WO_nominal);
    double sum = 0, first = 0, second = 0;
    const double v = std::round(outline.centroid.y());
    for (int step = 0; step < 40; ++step) {
      const double u = std::round(outline.centroid.x()) + step;
      const double rise = grey_at(scene.cameras[0].model, picture, {u + 1, v}) -
                          grey_at(scene.cameras[0].model, picture, {u, v});
      sum += rise;
      first += rise * step;
      second += rise * step * step;
    }
    const double variance = second / sum - (first / sum) * (first / sum);
    // Differences of neighbours add another box of 1/12; the outline's curvature blurs by less than 0.01.
    EXPECT_NEAR(variance, blur_px * blur_px + 2.0 / 12, 0.02) << blur_px;
  }
}

}  // namespace
}  // namespace zeropose
