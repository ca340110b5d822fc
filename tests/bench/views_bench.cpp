// calibrate_views() beside cv::calibrateCamera: the same points, the same model (k1 k2 p1 p2, k3 held), one
// thread, each with its own start. 11 x 11 points per view, 0.1 px of noise.
#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "calib/views.h"
#include "tests/calib/views_scene.h"

namespace {

using namespace zeropose;

// OpenCV takes floats: both get the same rounded pixels.
test::ViewsScene scene_with(std::int64_t views) {
  test::Random random(1);
  auto scene =
      test::scene_of({test::camera_with(BrownConrady{-0.21, 0.12, 0.0011, -0.0007, 0})}, {Pose::Identity()},
                     test::board(11, 20), static_cast<std::size_t>(views), 30, random);
  test::add_noise(scene, 0.1, random);
  for (ViewPoint& seen : scene.points) seen.point.u_px = seen.point.u_px.cast<float>().cast<double>();
  scene.cameras[0].fixed = {Parameter::k3};
  return scene;
}

void zeropose_views(benchmark::State& state) {
  const test::ViewsScene scene = scene_with(state.range(0));
  ViewsResult result;
  for (auto _ : state) benchmark::DoNotOptimize(result = calibrate_views(scene.problem()));
  if (result.status != CalibrationStatus::ok) state.SkipWithError(result.reason.c_str());
  state.counters["rms_px"] = result.rms_px;
  state.counters["iterations_inside"] = result.iterations;
}

void opencv_calibrate_camera(benchmark::State& state) {
  cv::setNumThreads(1);
  const test::ViewsScene scene = scene_with(state.range(0));
  std::vector<std::vector<cv::Point3f>> objects(scene.views.size());
  std::vector<std::vector<cv::Point2f>> images(scene.views.size());
  for (const ViewPoint& seen : scene.points) {
    const Eigen::Vector3f p = seen.point.p_W_mm.cast<float>();
    const Eigen::Vector2f u = seen.point.u_px.cast<float>();
    objects[seen.view].emplace_back(p.x(), p.y(), p.z());
    images[seen.view].emplace_back(u.x(), u.y());
  }
  double rms = 0;
  for (auto _ : state) {
    cv::Mat A, lens;
    std::vector<cv::Mat> r, t;
    rms = cv::calibrateCamera(objects, images, {1280, 1024}, A, lens, r, t, cv::CALIB_FIX_K3);
  }
  state.counters["rms_px"] = rms;
}

BENCHMARK(zeropose_views)->Arg(20)->Arg(3)->Unit(benchmark::kMillisecond);
BENCHMARK(opencv_calibrate_camera)->Arg(20)->Arg(3)->Unit(benchmark::kMillisecond);

}  // namespace
