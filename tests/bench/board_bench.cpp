// A board of 11 x 11 circles in one image: our way against OpenCV's findCirclesGrid in the same run, one
// thread each; how many centres, and how far from the truth (spec 88).
#include <benchmark/benchmark.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "measure/board.h"
#include "tests/support/board_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::BoardScene;
using test::Pixels;

// 0: 768 x 572, 1: 2448 x 2048; tilted by 25 degrees, noise of 2 grey levels.
struct Case {
  BoardScene scene;
  Pixels pixels;
  explicit Case(bool large) {
    if (large) scene.camera = {2448, 2048, 3800, 3800, 1220, 1030, Division{-0.1}};
    scene.X_CB = test::board_pose(scene, 330, 0.45, 0.7, 0.15);
    std::mt19937_64 random(1);
    pixels = expose(paint(scene), 2, random);
  }
};

const Case& case_of(const benchmark::State& state) {
  static const Case small(false), large(true);
  return state.range(0) == 0 ? small : large;
}

// Each point against the nearest true one. OpenCV knows nothing of eccentricity either: both are compared to
// where the outline's centre is seen.
void report(benchmark::State& state, const BoardScene& scene, const std::vector<Vector2d>& found) {
  double squares = 0;
  for (const Vector2d& u : found) {
    double nearest = std::numeric_limits<double>::max();
    for (int row = 0; row < scene.rows; ++row)
      for (int col = 0; col < scene.cols; ++col)
        nearest = std::min(nearest, (scene.seen_px({row, col}) - u).squaredNorm());
    squares += nearest / 2;
  }
  state.counters["found of 121"] = double(found.size());
  state.counters["error_px"] = found.empty() ? 0 : std::sqrt(squares / double(found.size()));
}

void zeropose_find_board(benchmark::State& state) {
  const Case& one = case_of(state);  // drawn before the clock runs
  BoardResult result;
  for (auto _ : state) result = find_board(one.pixels.view(), one.scene.problem());
  std::vector<Vector2d> found;
  for (const BoardPoint& point : result.points) found.push_back(point.u_px);
  report(state, one.scene, found);
}
BENCHMARK(zeropose_find_board)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void opencv_circles_grid(benchmark::State& state) {
  const Case& one = case_of(state);
  cv::setNumThreads(1);
  const cv::Mat grey(one.pixels.height_px, one.pixels.width_px, CV_8UC1,
                     const_cast<std::uint8_t*>(one.pixels.grey.data()));
  cv::SimpleBlobDetector::Params params;
  params.maxArea = 50000;  // the default leaves out the large image's circles
  const auto detector = cv::SimpleBlobDetector::create(params);
  std::vector<cv::Point2f> centres;
  bool good = false;
  for (auto _ : state)
    good = cv::findCirclesGrid(grey, {one.scene.cols, one.scene.rows}, centres, cv::CALIB_CB_SYMMETRIC_GRID,
                               detector);
  std::vector<Vector2d> found;
  if (good)
    for (const cv::Point2f& c : centres) found.emplace_back(double{c.x}, double{c.y});
  report(state, one.scene, found);
}
BENCHMARK(opencv_circles_grid)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace zeropose
