// The calibration body in rendered pictures: every disc gets its right number, or there is no answer.
#include "measure/body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <chrono>
#include <cstdlib>
#include <fstream>

#include "tests/support/body_scene.h"

namespace zeropose {
namespace {

using Eigen::Vector3d;
using test::BodyScene;

BodyProblem problem_of(const std::vector<BodyMark>& marks, double focal_px) {
  BodyProblem problem;
  problem.marks = marks;
  problem.focal_px = focal_px;
  return problem;
}

// Marks that were given the wrong disc: farther from their place than the discs' image could be.
std::size_t wrong_numbers(const BodyScene& scene, const BodyResult& result) {
  const std::vector<BodyMark> marks = scene.marks();
  return std::size_t(std::count_if(result.points.begin(), result.points.end(), [&](const BodyPoint& point) {
    return scene.hidden.contains(point.mark) ||
           (point.u_px - scene.centre_px(marks[point.mark])).norm() > 0.5;
  }));
}

TEST(Body, Explore) {
  const char* env = std::getenv("DUMP");
  int n = 0;
  for (const auto& [from, distance, roll, focal] :
       {std::tuple(Vector3d(1, 1, 1), 3000., 0., 4235.), std::tuple(Vector3d(1, 1, 1), 3000., 180., 4235.),
        std::tuple(Vector3d(1, .3, .6), 3000., 70., 4235.), std::tuple(Vector3d(.3, .25, 1), 3000., -50., 4235.),
        std::tuple(Vector3d(.2, 1, .3), 2800., 10., 4235.), std::tuple(Vector3d(.5, 1, .8), 6000., 110., 4235.),
        std::tuple(Vector3d(1, 1, 1), 800., 30., 1200.), std::tuple(Vector3d(.25, .5, 1), 700., 200., 1000.)}) {
    BodyScene scene;
    scene.camera.fx_px = focal, scene.camera.fy_px = focal * 0.998;
    scene.X_CB = test::looking_at_body(from, distance, roll);
    if (n % 2) scene.hidden = {3, 8, 9, 25, 38}, scene.false_discs = 12;
    const test::Pixels pixels = test::photograph(scene);
    if (env) {
      std::ofstream out(std::string(env) + std::to_string(n) + ".pgm", std::ios::binary);
      out << "P5\n" << pixels.width_px << " " << pixels.height_px << "\n255\n";
      for (int v = 0; v < pixels.height_px; ++v) out.write(reinterpret_cast<const char*>(pixels.grey.data() + v * pixels.stride_bytes), pixels.width_px);
    }
    ++n;
    for (double share : {1.0, 0.8, 1.2, 0.0}) {
      const auto marks = test::published_body(share == 1 ? scene.radius_mm : 0, false);
      const auto before = std::chrono::steady_clock::now();
      const BodyResult r = find_body(pixels.view(), problem_of(marks, focal * share));
      const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
      std::cout << name_of(r.status) << " " << r.reason << " points " << r.points.size() << " discs " << r.discs << " best "
                << r.explained << " next " << r.next_best << " rms " << r.rms_px << " wrong " << wrong_numbers(scene, r)
                << " f " << r.rough_model.fx_px << " ms " << ms << "\n";
    }
  }
}

}  // namespace
}  // namespace zeropose
