// What the other objects of the example cells look like: balls before a lit plate, a sheet on a conveyor.
#include <gtest/gtest.h>

#include <cmath>

#include "example_cells.h"
#include "outline.h"
#include "sim/renderer.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Outline;

// Which share of each pixel something fills: by how much the picture changes when its grey level does. Needs
// even light.
class Shares {
 public:
  Shares(const Scene& scene, std::size_t camera, const Pose& X_WO, double PictureSettings::*grey,
         const Faults& faults = {})
      : model_(scene.cameras[camera].model) {
    constexpr double change = 40;
    Scene other = scene;
    other.picture.*grey += change;
    const auto one = CameraRenderer(scene, camera).clean_picture(X_WO, faults);
    const auto two = CameraRenderer(other, camera).clean_picture(X_WO, faults);
    for (std::size_t i = 0; i < one.size(); ++i) shares_.push_back((two[i] - one[i]) / change);
  }

  double at(int u, int v) const {
    return shares_[static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width_px) +
                   static_cast<std::size_t>(u)];
  }

  // The sum within the radius, or of what is missing to 1, and its centre of gravity.
  struct Blob {
    double area_px2 = 0;
    Vector2d centroid = Vector2d::Zero();
  };
  Blob blob(const Vector2d& middle, double radius_px, bool of_what_is_missing) const {
    Blob blob;
    for (int v = static_cast<int>(middle.y() - radius_px); v <= middle.y() + radius_px; ++v)
      for (int u = static_cast<int>(middle.x() - radius_px); u <= middle.x() + radius_px; ++u) {
        if ((Vector2d(u, v) - middle).norm() > radius_px) continue;
        const double share = of_what_is_missing ? 1 - at(u, v) : at(u, v);
        blob.area_px2 += share;
        blob.centroid += share * Vector2d(u, v);
      }
    blob.centroid /= blob.area_px2;
    return blob;
  }

 private:
  CameraModel model_;
  std::vector<double> shares_;
};

void expect_outline(const Shares::Blob& blob, const Outline& outline, const std::string& name) {
  EXPECT_LT((blob.centroid - outline.centroid).norm(), 0.002) << name;
  EXPECT_NEAR(std::sqrt(blob.area_px2 / outline.area_px2), 1, 1e-4) << name;
}

Scene flat(const char* cell) { return test::flat(test::example(cell)); }

bool in_view(const CameraModel& model, const Outline& outline) {
  const double margin = outline.radius_px + 8;
  return (outline.centroid.array() > margin).all() && outline.centroid.x() < model.width_px - margin &&
         outline.centroid.y() < model.height_px - margin;
}

bool clear_of_others(const std::vector<Outline>& outlines, std::size_t i) {
  for (std::size_t j = 0; j < outlines.size(); ++j)
    if (j != i && (outlines[i].centroid - outlines[j].centroid).norm() <
                      outlines[i].radius_px + outlines[j].radius_px + 12)
      return false;
  return true;
}

TEST(BallPlate, ShowsBallsAsTheirTangentCones) {
  const Scene scene = flat("gun-check");
  int seen = 0;
  for (const SixNumbers& six : {SixNumbers{}, SixNumbers{-6, -4, 40, 6, -8, 70}}) {
    const Pose X_WO = scene.X_WO_nominal * from_six_numbers(six);
    const Shares shares(scene, 0, X_WO, &PictureSettings::mark_grey);
    std::vector<Outline> outlines;
    for (const Mark& mark : scene.marks)
      outlines.push_back(test::ball_outline_of(scene.cameras[0], mark, X_WO));
    for (std::size_t i = 0; i < outlines.size(); ++i) {
      if (!in_view(scene.cameras[0].model, outlines[i]) || !clear_of_others(outlines, i)) continue;
      ++seen;
      expect_outline(shares.blob(outlines[i].centroid, outlines[i].radius_px + 6, false), outlines[i],
                     scene.marks[i].name);
    }
  }
  EXPECT_GE(seen, 16);
}

// A ball seen obliquely is no circle, and its middle not where its centre projects: what a disc of its size
// facing the camera would show is wrong by far more than the tests allow.
TEST(BallPlate, OutlineIsNotThatOfADisc) {
  const Scene scene = flat("gun-check");
  const Mark& mark = scene.marks[10];
  const Outline outline = test::ball_outline_of(scene.cameras[0], mark, scene.X_WO_nominal);
  const auto centre = project(scene.cameras[0].model, scene.cameras[0].X_WC.inverse() * mark.p_O_mm);
  EXPECT_GT((*centre - outline.centroid).norm(), 0.01);
}

TEST(BallPlate, ACoveredBallIsGoneAndADisplacedOneIsThatFarOff) {
  const Scene scene = flat("gun-check");
  const Outline outline = test::ball_outline_of(scene.cameras[0], scene.marks[7], scene.X_WO_nominal);
  const CameraRenderer renderer(scene, 0);
  const auto seen = renderer.clean_picture(scene.X_WO_nominal);
  const auto covered = renderer.clean_picture(scene.X_WO_nominal, {{"ball 8"}, {}});
  int changed = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) changed += std::abs(seen[i] - covered[i]) > 20 ? 1 : 0;
  EXPECT_GT(changed, 0.3 * outline.area_px2);
  EXPECT_LT(changed, 5 * outline.area_px2);
  const Shares shares(scene, 0, scene.X_WO_nominal, &PictureSettings::mark_grey, {{}, {{"ball 8", 12.5}}});
  const Vector2d expected = outline.centroid + Vector2d(12.5, 0);
  // A ball elsewhere has another shape.
  EXPECT_LT((shares.blob(expected, outline.radius_px + 6, false).centroid - expected).norm(), 0.05);
}

TEST(SteelSheet, HasItsHolesWhereTheyProject) {
  const Scene scene = flat("press-shop");
  const Pose X_WO = scene.X_WO_nominal * from_six_numbers({31, -17, 0, 0, 0, 1.4});
  for (std::size_t camera = 0; camera < 2; ++camera) {
    const Shares shares(scene, camera, X_WO, &PictureSettings::surface_grey);
    for (const View& view : scene.views) {
      const Mark& mark = scene.marks[view.mark];
      if (view.camera != camera || mark.kind != MarkKind::disc) continue;
      const Outline outline = test::outline_of(scene.cameras[camera], mark, X_WO);
      expect_outline(shares.blob(outline.centroid, outline.radius_px + 6, true), outline, mark.name);
    }
  }
}

// Where an edge of the sheet crosses a row of pixels: as many pixels from the row's start as their shares
// add up to. Blur takes on one side what it adds on the other.
double crossing_px(const Shares& shares, int v, int u_inside, int u_outside) {
  const int step = u_outside > u_inside ? 1 : -1;
  double sum = 0;
  for (int u = u_inside; u != u_outside; u += step) sum += shares.at(u, v);
  return u_inside + step * (sum - 0.5);
}

TEST(SteelSheet, HasItsEdgesWhereTheyProject) {
  const Scene scene = flat("press-shop");
  const Pose X_WO = scene.X_WO_nominal * from_six_numbers({-22, 13, 0, 0, 0, -1.1});
  const CalibratedCamera& camera = scene.cameras[0];
  const Shares shares(scene, 0, X_WO, &PictureSettings::surface_grey);
  // The columns of this camera run along the sheet's width: rows cross its long edges.
  for (const double side_mm : {-950.0, 950.0}) {
    for (double x_mm = -1900; x_mm < -700; x_mm += 90) {
      const auto place = [&](double x) {
        return *project(camera.model, camera.X_WC.inverse() * X_WO * Vector3d(x, side_mm, 0));
      };
      const Vector2d near = place(x_mm), before = place(x_mm - 3), after = place(x_mm + 3);
      const int v = static_cast<int>(std::lround(near.y()));
      const double u = near.x() + (v - near.y()) * (after.x() - before.x()) / (after.y() - before.y());
      const int inside = static_cast<int>(u) + (u > 640 ? -15 : 15);
      EXPECT_NEAR(crossing_px(shares, v, inside, static_cast<int>(u) + (u > 640 ? 15 : -15)), u, 0.002)
          << x_mm << ' ' << side_mm;
    }
  }
}

TEST(SteelSheet, ADisplacedCornerIsThatFarOffAndACoveredOneIsGone) {
  const Scene scene = flat("press-shop");
  const CalibratedCamera& camera = scene.cameras[0];
  const Vector2d corner = *project(camera.model, camera.X_WC.inverse() * Vector3d(-2100, -950, 0));
  const auto share_round = [&](const Vector2d& middle, const Faults& faults) {
    return Shares(scene, 0, scene.X_WO_nominal, &PictureSettings::surface_grey, faults)
               .blob(middle, 9, false)
               .area_px2 /
           (std::numbers::pi * 81);
  };
  EXPECT_NEAR(share_round(corner, {}), 0.25, 0.03);
  EXPECT_NEAR(share_round(corner + Vector2d(-25, 0), {{}, {{"left/corner 1", -25}}}), 0.25, 0.03);
  EXPECT_GT(share_round(corner, {{"left/corner 1"}, {}}), 0.8);
}

TEST(Looks, RefuseMarksThatTheyCannotShow) {
  Scene scene = test::example("press-shop");
  scene.marks[0].p_O_mm.x() += 20;
  EXPECT_THROW(CameraRenderer(scene, 0), std::invalid_argument);
  scene = test::example("press-shop");
  scene.object = BallPlateObject{};
  EXPECT_THROW(CameraRenderer(scene, 0), std::invalid_argument);
  scene = test::example("gun-check");
  scene.object = PlatesObject{};
  EXPECT_THROW(CameraRenderer(scene, 0), std::invalid_argument);
}

}  // namespace
}  // namespace zeropose
