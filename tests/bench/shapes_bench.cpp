// Marks with straight edges: time in one window against OpenCV's ways in the same run, what those miss the
// truth by, and the long statistics over 2400 marks of each kind (spec 88). OpenCV works on one thread.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "measure/edge_marks.h"
#include "tests/support/outline_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::bound_of;
using test::drawing_of;
using test::expose;
using test::expose_deep;
using test::find_shape;
using test::paint;
using test::Pixels;
using test::random_scene;
using test::search_of;
using test::ShapeScene;

constexpr double noise = 2;

// Windows of 60 x 60 px drawn before the clock runs.
struct Shots {
  std::vector<ShapeScene> scenes;
  std::vector<Pixels> pixels;
  std::vector<MarkSearch> searches;
};

Shots shots_of(MarkKind kind) {
  Shots shots;
  std::mt19937_64 random(5);
  for (int k = 0; k < 20; ++k) {
    shots.scenes.push_back(random_scene(kind, random));
    shots.pixels.push_back(expose(paint(drawing_of(shots.scenes.back())), noise, random));
    shots.searches.push_back(search_of(shots.scenes.back()));
  }
  return shots;
}

// Of an edge the part across it.
double square_error(const ShapeScene& scene, const Vector2d& place) {
  const Vector2d off = place - scene.truth_px();
  if (scene.kind != MarkKind::edge) return off.squaredNorm();
  return std::pow(off.dot(Vector2d(std::cos(scene.parameters[1]), std::sin(scene.parameters[1]))), 2);
}

// Places all of them again and again; reports the time of one and the rms error.
template <typename Place>
void time_places(benchmark::State& state, MarkKind kind, const Place& place) {
  cv::setNumThreads(1);
  const Shots shots = shots_of(kind);
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(place(shots.pixels[k], shots.searches[k], shots.scenes[k]));
    k = (k + 1) % shots.pixels.size();
  }
  double squares = 0;
  for (std::size_t i = 0; i < shots.pixels.size(); ++i) {
    squares += square_error(shots.scenes[i], place(shots.pixels[i], shots.searches[i], shots.scenes[i])) /
               double(shots.pixels.size());
  }
  state.counters["error_px"] = std::sqrt(squares);
}

void find(benchmark::State& state) {
  time_places(state, static_cast<MarkKind>(state.range(0)),
              [](const Pixels& pixels, const MarkSearch& search, const ShapeScene&) {
                return find_shape(pixels.view(), search).u_px;
              });
}
BENCHMARK(find)
    ->Arg(int(MarkKind::edge))
    ->Arg(int(MarkKind::corner))
    ->Arg(int(MarkKind::slot))
    ->Arg(int(MarkKind::cross))
    ->Unit(benchmark::kMicrosecond);

cv::Mat mat_of(const Pixels& pixels) {
  return {pixels.height_px, pixels.width_px, CV_8UC1, const_cast<std::uint8_t*>(pixels.grey.data())};
}

// Canny's points near the longest Hough line, then a line through them.
Vector2d opencv_edge(const Pixels& pixels, const MarkSearch& search, const ShapeScene&) {
  cv::Mat edges;
  cv::Canny(mat_of(pixels), edges, 60, 120);
  std::vector<cv::Vec4i> lines;
  cv::HoughLinesP(edges, lines, 1, CV_PI / 180, 20, 20, 5);
  if (lines.empty()) return search.expected_px;
  const auto longest =
      std::max_element(lines.begin(), lines.end(), [](const cv::Vec4i& a, const cv::Vec4i& b) {
        return std::hypot(a[2] - a[0], a[3] - a[1]) < std::hypot(b[2] - b[0], b[3] - b[1]);
      });
  const Vector2d p((*longest)[0], (*longest)[1]), q((*longest)[2], (*longest)[3]);
  const Vector2d along = (q - p).normalized(), normal(-along.y(), along.x());
  std::vector<cv::Point> on, all;
  cv::findNonZero(edges, all);
  for (const cv::Point& point : all) {
    if (std::abs(normal.dot(Vector2d(point.x, point.y) - p)) < 2) on.push_back(point);
  }
  cv::Vec4f line;
  cv::fitLine(on, line, cv::DIST_HUBER, 0, 0.01, 0.01);
  const Vector2d direction(line[0], line[1]), at(line[2], line[3]);
  return at + direction * direction.dot(search.expected_px - at);
}

void opencv_canny_hough_fit_line(benchmark::State& state) { time_places(state, MarkKind::edge, opencv_edge); }
BENCHMARK(opencv_canny_hough_fit_line)->Unit(benchmark::kMicrosecond);

// Given the truth to the pixel; it is meant for chessboard crossings.
Vector2d opencv_corner(const Pixels& pixels, const MarkSearch&, const ShapeScene& scene) {
  std::vector<cv::Point2f> corners{
      {std::round(float(scene.truth_px().x())), std::round(float(scene.truth_px().y()))}};
  cv::cornerSubPix(mat_of(pixels), corners, {8, 8}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-3});
  return {corners[0].x, corners[0].y};
}

void opencv_corner_sub_pix(benchmark::State& state) { time_places(state, MarkKind::corner, opencv_corner); }
BENCHMARK(opencv_corner_sub_pix)->Unit(benchmark::kMicrosecond);

// The longest contour at the middle grey, told beforehand, and the smallest rectangle about it.
Vector2d opencv_slot(const Pixels& pixels, const MarkSearch& search, const ShapeScene&) {
  cv::Mat binary;
  cv::threshold(mat_of(pixels), binary, 110, 255, cv::THRESH_BINARY_INV);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(binary, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) return search.expected_px;
  const auto longest = std::max_element(contours.begin(), contours.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const cv::RotatedRect box = cv::minAreaRect(*longest);
  return {box.center.x, box.center.y};
}

void opencv_contours_min_area_rect(benchmark::State& state) {
  time_places(state, MarkKind::slot, opencv_slot);
}
BENCHMARK(opencv_contours_min_area_rect)->Unit(benchmark::kMicrosecond);

struct Sums {
  double squares = 0, held = 0, count = 0, missed = 0, bound2 = 0, bias = 0;
};

double sigmas2(const ShapeScene& scene, const MarkFinding& finding) {
  const Vector2d off = finding.u_px - scene.truth_px();
  if (scene.kind != MarkKind::edge) return off.dot(finding.covariance_px2.inverse() * off);
  const Vector2d n(std::cos(finding.direction_rad), std::sin(finding.direction_rad));
  return off.dot(n) * off.dot(n) / n.dot(finding.covariance_px2 * n);
}

void add_draws(const ShapeScene& scene, int draws, std::mt19937_64& random, Sums& sums) {
  const auto picture = paint(drawing_of(scene));
  const MarkSearch search = search_of(scene);
  const double chi2 = scene.kind == MarkKind::edge ? 3.841 : 5.991;
  const auto clean = expose_deep(picture, 65535, 0, random);
  sums.bias = std::max(sums.bias, std::sqrt(square_error(scene, find_shape(clean.view(), search).u_px)));
  sums.bound2 += bound_of(scene, noise).trace();
  for (int draw = 0; draw < draws; ++draw) {
    const MarkFinding finding = find_shape(expose(picture, noise, random).view(), search);
    if (finding.status != MarkStatus::found) {
      ++sums.missed;
      continue;
    }
    sums.squares += square_error(scene, finding.u_px);
    sums.held += sigmas2(scene, finding) < chi2 ? 1 : 0;
    ++sums.count;
  }
}

// Not a time: error against the bound and how often the 95 % region holds.
void statistics(benchmark::State& state) {
  constexpr int phases = 120, draws = 20;
  Sums sums;
  for (auto _ : state) {
    sums = {};
    std::mt19937_64 random(99);
    for (int phase = 0; phase < phases; ++phase) {
      add_draws(random_scene(static_cast<MarkKind>(state.range(0)), random), draws, random, sums);
    }
  }
  state.counters["error_px"] = std::sqrt(sums.squares / sums.count);
  state.counters["error/bound"] = std::sqrt(sums.squares / sums.count / sums.bound2 * phases);
  state.counters["held_95"] = sums.held / sums.count;
  state.counters["missed"] = sums.missed;
  state.counters["noise_free_max_px"] = sums.bias;
}
BENCHMARK(statistics)
    ->Arg(int(MarkKind::edge))
    ->Arg(int(MarkKind::corner))
    ->Arg(int(MarkKind::slot))
    ->Arg(int(MarkKind::cross))
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace zeropose
