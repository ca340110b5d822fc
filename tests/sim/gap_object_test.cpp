// The truth of the pane-gaps cell against computations of its own: gaps by many points of the outlines, edges
// in the pictures where they project.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "config/config_error.h"
#include "example_cells.h"
#include "sim/renderer.h"
#include "sim/simulated_cell.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Points of a rectangle with round corners every hundredth of a mm or so, by angles alone.
std::vector<Vector2d> points_of(const RoundedBox& box, const Vector2d& near, double within_mm) {
  std::vector<Vector2d> points;
  const Vector2d inner = box.half_mm - Vector2d::Constant(box.corner_mm);
  const auto add = [&](const Vector2d& p) {
    if ((p - near).norm() < within_mm) points.push_back(p);
  };
  constexpr int steps = 100000;
  for (int i = 0; i <= steps; ++i) {
    const double t = -1 + 2.0 * i / steps;
    for (const double side : {-1.0, 1.0}) {
      add({side * box.half_mm.x(), t * inner.y()});
      add({t * inner.x(), side * box.half_mm.y()});
      for (const double other : {-1.0, 1.0}) {
        const double angle = (t + 1) / 4 * M_PI;
        add({side * (inner.x() + box.corner_mm * std::cos(angle)),
             other * (inner.y() + box.corner_mm * std::sin(angle))});
      }
    }
  }
  return points;
}

Pose random_motion(std::mt19937_64& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  return from_six_numbers({2 * any(random), 2 * any(random), any(random), 0.05 * any(random),
                           0.05 * any(random), 0.5 * any(random)});
}

TEST(GapTruth, IsTheDistanceOfTheOutlines) {
  const Scene scene = test::example("pane-gaps");
  const auto& object = std::get<GapsObject>(scene.object);
  ASSERT_EQ(object.places.size(), 6u);
  std::mt19937_64 random(3);
  for (int draw = 0; draw < 4; ++draw) {
    const Pose X_OT = draw == 0 ? Pose::Identity() : random_motion(random);
    for (const RimPlace& place : object.places) {
      const Vector3d p = X_OT * Vector3d(place.p_T_mm.x(), place.p_T_mm.y(), 0);
      double nearest = INFINITY;
      for (const Vector2d& q : points_of(object.opening, p.head<2>(), 30))
        nearest = std::min(nearest, (q - p.head<2>()).norm());
      // Half a step of 0.012 mm beside the foot is 0.00001 mm.
      EXPECT_NEAR(true_gap_mm(object, place, X_OT), nearest, 1e-4) << place.name;
      if (draw > 0) continue;
      EXPECT_NEAR(nearest, 7, 1e-4);
    }
  }
}

TEST(GapTruth, PlacesLieOnTheRimWhereTheCamerasLook) {
  const Scene scene = test::example("pane-gaps");
  const auto& object = std::get<GapsObject>(scene.object);
  const Vector2d expected[] = {{-450, 350}, {150, 350}, {-600, 40}, {600, -30}, {-150, -350}, {450, -350}};
  for (std::size_t i = 0; i < object.places.size(); ++i)
    EXPECT_LT((object.places[i].p_T_mm - expected[i]).norm(), 2) << object.places[i].name;
}

TEST(GapTruth, APaneOverTheFrameIsANegativeGap) {
  const Scene scene = test::example("pane-gaps");
  const auto& object = std::get<GapsObject>(scene.object);
  const Pose X_OT = from_six_numbers({-9, 0, 0, 0, 0, 0});
  EXPECT_NEAR(true_gap_mm(object, object.places[2], X_OT), -2, 1e-9);
  EXPECT_NEAR(true_unevenness_mm(object, X_OT), 9, 1e-9);
}

TEST(GapTruth, KnowsWhatMayLieOverAnEdge) {
  const Scene scene = test::example("pane-gaps");
  const auto& object = std::get<GapsObject>(scene.object);
  const auto spot = gap_spot(object, "upper right dirt 12");
  ASSERT_TRUE(spot);
  EXPECT_EQ(spot->place, 1u);
  EXPECT_EQ(spot->kind, "dirt");
  EXPECT_EQ(spot->number, 12u);
  EXPECT_TRUE(gap_spot(object, "left taped"));
  for (const char* wrong : {"", "left", "left ", "left rust", "middle dirt", "left dirt x", "left dirt 3 4"})
    EXPECT_FALSE(gap_spot(object, wrong)) << wrong;
}

// Grey levels along a row of the clean picture.
class GapPicture {
 public:
  GapPicture(const Scene& scene, std::size_t camera, const Pose& X_OT, const Faults& faults = {})
      : camera_(scene.cameras[camera]) {
    const auto& object = std::get<GapsObject>(scene.object);
    X_WT_ = object.X_WR * object.X_RH * object.X_HT;
    X_WO_ = X_WT_ * X_OT.inverse();
    pixels_ = CameraRenderer(scene, camera).clean_picture(X_WO_, faults, CarriedPane{X_WT_});
  }

  Vector2d pixel_of(const Pose& X_WF, const Vector2d& q_F) const {
    return *project(camera_.model, camera_.X_WC.inverse() * X_WF * Vector3d(q_F.x(), q_F.y(), 0));
  }
  Vector2d of_pane(const Vector2d& q) const { return pixel_of(X_WT_, q); }
  Vector2d of_car(const Vector2d& q) const { return pixel_of(X_WO_, q); }

  // Where the grey level between the means on both sides is passed in a row, by the sum over 2 * 12 pixels.
  double crossing_px(const Vector2d& near) const {
    const int v = static_cast<int>(std::lround(near.y())), middle = static_cast<int>(std::lround(near.x()));
    const double left = at(middle - 12, v), right = at(middle + 12, v);
    double sum = 0;
    for (int u = middle - 12; u < middle + 12; ++u) sum += (at(u, v) - right) / (left - right);
    return middle - 12.5 + sum;
  }
  double at(int u, int v) const {
    return pixels_[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.model.width_px) +
                   static_cast<std::size_t>(u)];
  }

 private:
  CalibratedCamera camera_;
  Pose X_WT_, X_WO_;
  std::vector<float> pixels_;
};

// A point of the edge in the row of pixels nearest to it: along the edge by Newton's method.
template <typename Project>
Vector2d in_a_row(Vector2d q_mm, const Vector2d& along, const Project& project_px) {
  const double v = std::round(project_px(q_mm).y());
  for (int i = 0; i < 5; ++i) {
    const double slope = (project_px(q_mm + 0.01 * along).y() - project_px(q_mm).y()) / 0.01;
    q_mm += (v - project_px(q_mm).y()) / slope * along;
  }
  return project_px(q_mm);
}

TEST(GapPictures, ShowTheEdgesWhereTheyProject) {
  Scene scene = test::flat(test::example("pane-gaps"));
  const auto& object = std::get<GapsObject>(scene.object);
  const Pose X_OT = from_six_numbers({1.3, -0.8, 0.2, 0.02, -0.03, 0.2});
  for (const std::size_t camera : {0u, 3u, 4u}) {
    const RimPlace& place = object.places[camera];
    const Vector2d along(-place.outward_T.y(), place.outward_T.x());
    const GapPicture picture(scene, camera, X_OT);
    const Vector2d side = place.outward_T.cwiseAbs().cwiseProduct(object.opening.half_mm);
    for (double step = -8; step <= 8; step += 4) {
      const Vector2d pane = place.p_T_mm + step * along;
      const Vector2d seen_pane = in_a_row(pane, along, [&](const Vector2d& q) { return picture.of_pane(q); });
      // Texture and shading of the surfaces: 2 of 60 grey levels over some px.
      EXPECT_NEAR(picture.crossing_px(seen_pane), seen_pane.x(), 0.15) << place.name;
      Vector2d frame = pane;
      for (int k = 0; k < 2; ++k)
        if (place.outward_T(k) != 0) frame(k) = place.outward_T(k) * side(k);
      const Vector2d seen_frame =
          in_a_row(frame, along, [&](const Vector2d& q) { return picture.of_car(q); });
      EXPECT_NEAR(picture.crossing_px(seen_frame), seen_frame.x(), 0.15) << place.name;
    }
  }
}

TEST(GapPictures, ShowWhatLiesOverAnEdgeInItsCameraAlone) {
  const Scene scene = test::flat(test::example("pane-gaps"));
  for (const char* name :
       {"upper left dirt 1", "upper left glint 1", "upper left hidden", "upper left taped"}) {
    const GapPicture clean(scene, 0, Pose::Identity()), spoilt(scene, 0, Pose::Identity(), {{name}, {}});
    const GapPicture other(scene, 1, Pose::Identity()), same(scene, 1, Pose::Identity(), {{name}, {}});
    int changed = 0, elsewhere = 0;
    for (int v = 0; v < 480; ++v)
      for (int u = 0; u < 640; ++u) {
        changed += std::abs(clean.at(u, v) - spoilt.at(u, v)) > 10 ? 1 : 0;
        elsewhere += other.at(u, v) != same.at(u, v) ? 1 : 0;
      }
    EXPECT_GT(changed, 100) << name;
    EXPECT_EQ(elsewhere, 0) << name;
  }
}

TEST(GapScenes, AreRefusedWhereCellAndTruthDoNotFit) {
  const Cell gaps = load_cell(test::cells + "pane-gaps.json"),
             marks = load_cell(test::cells + "hand-camera.json");
  Scene scene = test::example("pane-gaps");
  auto object = std::get<GapsObject>(scene.object);
  EXPECT_THROW(complete(object, marks, marks.jobs.front(), scene.cameras), ConfigError);
  // From behind the cameras.
  object.X_HT.translation().z() = -4000;
  EXPECT_THROW(complete(object, gaps, gaps.jobs.front(), gaps.calibration), ConfigError);
}

}  // namespace
}  // namespace zeropose
