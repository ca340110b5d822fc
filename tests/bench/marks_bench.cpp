// Marks: time of one fit, time of four frames with three windows each, against OpenCV's ways in the same run;
// and the long statistics over 10^4 marks (spec 88). OpenCV works on one thread.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calib/eccentricity.h"
#include "measure/ellipse_fit.h"
#include "measure/marks.h"
#include "tests/support/mark_picture.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Drawing;
using test::ellipse;
using test::Pixels;

Pixels one_mark(double diameter, Vector2d* truth = nullptr) {
  Drawing drawing;
  drawing.width_px = drawing.height_px = static_cast<int>(diameter) + 24;
  const double middle = 0.5 * (drawing.width_px - 1);
  const Vector2d at(middle + 0.21, middle - 0.34);
  if (truth != nullptr) *truth = at;
  drawing.figures = {ellipse(at, diameter, 1, 0, 60)};
  std::mt19937_64 random(1);
  return expose(paint(drawing), 2, random);
}

void fit_of_one_mark(benchmark::State& state) {
  const auto diameter = static_cast<double>(state.range(0));
  EllipseStart start;
  const Pixels pixels = one_mark(diameter, &start.centre_px);
  start.centre_px += Vector2d(0.08, -0.06);
  start.shape_px2 = Eigen::Matrix2d::Identity() * (diameter * diameter / 4 * 1.01);
  start.mark_grey = 60;
  start.background_grey = 160;
  EllipseWorkspace workspace;
  for (auto _ : state) benchmark::DoNotOptimize(fit_ellipse(pixels.view(), start, workspace));
}
BENCHMARK(fit_of_one_mark)->Arg(20)->Arg(40)->Arg(60)->Unit(benchmark::kMicrosecond);

void eccentricity_of_one_mark(benchmark::State& state) {
  const CameraModel camera{768, 572, 4323, 4315, 400, 243, Division{1.06}};
  Eigen::Vector3d p_CM(150, -120, 3000);
  const Eigen::Vector3d normal_C(0.3, 0.5, -0.8);
  for (auto _ : state) {
    benchmark::DoNotOptimize(p_CM);
    benchmark::DoNotOptimize(ellipse_centre_offset(camera, p_CM, normal_C, 15));
  }
}
BENCHMARK(eccentricity_of_one_mark);

// A frame of the car-body cell: three dark marks of 28..56 px, clutter round their windows, light that falls
// off.
struct Frame {
  Pixels pixels;
  std::vector<MarkSearch> searches;
};

Frame frame_of(unsigned seed) {
  std::mt19937_64 random(seed);
  Drawing drawing;
  drawing.width_px = 768;
  drawing.height_px = 572;
  drawing.background = 165;
  drawing.shading_per_px = {0.0003, -0.0002};
  add_clutter(drawing, 24, 62, 0, random);
  Frame frame;
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Vector2d& middle : {Vector2d(140, 140), Vector2d(380, 420), Vector2d(620, 200)}) {
    const Vector2d at = middle + 40 * Vector2d(unit(random) - 0.5, unit(random) - 0.5);
    drawing.figures.push_back({});
    drawing.figures.back().corners_px = {at + Vector2d(-60, -50), at + Vector2d(60, -50),
                                         at + Vector2d(60, 50), at + Vector2d(-60, 50)};
    drawing.figures.back().grey = 175;
    drawing.figures.push_back(
        ellipse(at, 28 + 28 * unit(random), 0.6 + 0.4 * unit(random), unit(random), 60));
    MarkSearch search;
    search.expected_px = middle;
    search.half_window_px = {100, 100};
    search.min_diameter_px = 24;
    search.max_diameter_px = 62;
    frame.searches.push_back(search);
  }
  frame.pixels = expose(paint(drawing), 2, random);
  return frame;
}

const std::array<Frame, 4>& four_frames() {
  static const std::array<Frame, 4> frames{frame_of(1), frame_of(2), frame_of(3), frame_of(4)};
  return frames;
}

cv::Mat window_of(const Frame& frame, const MarkSearch& search) {
  const cv::Mat whole(frame.pixels.height_px, frame.pixels.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(frame.pixels.grey.data()));
  return whole(cv::Rect(static_cast<int>(search.expected_px.x()) - 100,
                        static_cast<int>(search.expected_px.y()) - 100, 200, 200));
}

void four_frames_find_marks(benchmark::State& state) {
  const auto& frames = four_frames();  // drawn before the clock runs
  double found = 0;
  for (auto _ : state) {
    found = 0;
    for (const Frame& frame : frames) {
      for (const auto& finding : find_marks(frame.pixels.view(), frame.searches)) {
        found += finding.status == MarkStatus::found ? 1 : 0;
      }
    }
  }
  state.counters["found of 12"] = found;
}
BENCHMARK(four_frames_find_marks)->Unit(benchmark::kMillisecond);

void four_frames_contours_fit_ellipse(benchmark::State& state) {
  const auto& frames = four_frames();  // drawn before the clock runs
  cv::setNumThreads(1);
  cv::Mat binary;
  std::vector<std::vector<cv::Point>> contours;
  for (auto _ : state) {
    for (const Frame& frame : frames) {
      for (const auto& search : frame.searches) {
        cv::threshold(window_of(frame, search), binary, 110, 255, cv::THRESH_BINARY_INV);
        cv::findContours(binary, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
        for (const auto& contour : contours) {
          if (contour.size() >= 40) benchmark::DoNotOptimize(cv::fitEllipse(contour));
        }
      }
    }
  }
}
BENCHMARK(four_frames_contours_fit_ellipse)->Unit(benchmark::kMillisecond);

void four_frames_simple_blob_detector(benchmark::State& state) {
  const auto& frames = four_frames();  // drawn before the clock runs
  cv::setNumThreads(1);
  cv::SimpleBlobDetector::Params params;
  params.minArea = 200;
  params.maxArea = 4000;
  const auto detector = cv::SimpleBlobDetector::create(params);
  std::vector<cv::KeyPoint> points;
  for (auto _ : state) {
    for (const Frame& frame : frames) {
      for (const auto& search : frame.searches) detector->detect(window_of(frame, search).clone(), points);
    }
  }
}
BENCHMARK(four_frames_simple_blob_detector)->Unit(benchmark::kMillisecond);

MarkFinding find_alone(const Pixels& pixels, double diameter) {
  MarkSearch search;
  search.expected_px = search.half_window_px = 0.5 * Vector2d(pixels.width_px - 1, pixels.height_px - 1);
  search.min_diameter_px = 0.8 * diameter;
  search.max_diameter_px = 1.2 * diameter;
  return find_marks(pixels.view(), {&search, 1}).front();
}

Drawing drawing_at(const Vector2d& off, double diameter) {
  Drawing drawing;
  drawing.width_px = drawing.height_px = static_cast<int>(diameter) + 28;
  drawing.figures = {
      ellipse(off + 0.5 * Vector2d(drawing.width_px - 1, drawing.height_px - 1), diameter, 1, 0, 60)};
  return drawing;
}

// Information of the centre by central differences of the pictures; variance of noise and rounding.
double bound_px(const Vector2d& off, double diameter) {
  const auto right = paint(drawing_at(off + Vector2d(0.01, 0), diameter));
  const auto left = paint(drawing_at(off - Vector2d(0.01, 0), diameter));
  double information = 0;
  for (std::size_t i = 0; i < right.grey.size(); ++i) {
    information += std::pow((right.grey[i] - left.grey[i]) / 0.02, 2);
  }
  return std::sqrt((4 + 1.0 / 12) / information);
}

// Not a time: error against the bound, and how often the 95 % ellipse holds, over 12 000 marks of each size.
void statistics(benchmark::State& state) {
  const auto diameter = static_cast<double>(state.range(0));
  double squares = 0, held = 0, count = 0, bound2 = 0, bias = 0;
  constexpr int phases = 120, draws = 100;
  for (auto _ : state) {
    std::mt19937_64 random(99);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    for (int phase = 0; phase < phases; ++phase) {
      const Vector2d off(unit(random), unit(random));
      const Drawing drawing = drawing_at(off, diameter);
      const Vector2d truth = drawing.figures.front().centre_px;
      const auto picture = paint(drawing);
      bound2 += std::pow(bound_px(off, diameter), 2) / phases;
      bias += (find_alone(expose(picture, 0, random), diameter).u_px - truth).norm() / phases;
      for (int draw = 0; draw < draws; ++draw) {
        const MarkFinding finding = find_alone(expose(picture, 2, random), diameter);
        const Vector2d error = finding.u_px - truth;
        squares += error.squaredNorm() / 2;
        held += error.dot(finding.covariance_px2.inverse() * error) < 5.991 ? 1 : 0;
        ++count;
      }
    }
  }
  state.counters["error_px"] = std::sqrt(squares / count);
  state.counters["error/bound"] = std::sqrt(squares / count / bound2);
  state.counters["held_95"] = held / count;
  state.counters["noise_free_px"] = bias;
}
BENCHMARK(statistics)->Arg(10)->Arg(20)->Arg(40)->Arg(60)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace zeropose
