// Taught patterns: time and error of the fit against OpenCV's ECC from the same start, of the search against
// matchTemplate with a parabola and with ECC after it, in the same run; the long statistics against the bound
// (spec 88). OpenCV works on one thread.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "measure/pattern_fit.h"
#include "measure/pattern_search.h"
#include "tests/support/texture_picture.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using test::expose;
using test::paint_texture;
using test::Picture;
using test::Pixels;
using test::TextureLook;

constexpr double noise = 2;
const Vector2d middle(33, 33);  // of the taught picture, 67 px

struct Scene {
  test::Texture texture;
  TextureLook taught, seen;
  int patch_px = 41, size_px = 80;

  Vector2d truth() const { return seen.place_px + seen.linear * (middle - taught.place_px); }
  PixelWindow window() const {
    return {33 - patch_px / 2, 33 - patch_px / 2, 33 + patch_px / 2, 33 + patch_px / 2};
  }
  Picture taught_picture() const { return paint_texture(texture, taught, 67, 67); }
  Picture seen_picture() const { return paint_texture(texture, seen, size_px, size_px); }
};

// +-2 degrees, +-2 % scale and shear, +-20 % gain, +-10 grey levels.
Scene scene_of(std::uint64_t seed, int patch_px, int size_px, double spread_px) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Scene scene{test::random_texture(0.5 * patch_px + 14, seed), {}, {}, patch_px, size_px};
  scene.taught.place_px = middle + 0.5 * Vector2d(unit(random), unit(random));
  scene.seen.place_px =
      Vector2d::Constant(0.5 * (size_px - 1)) + spread_px * Vector2d(unit(random), unit(random));
  const double angle = unit(random) * 2 * std::numbers::pi / 180;
  Matrix2d R, S;
  R << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  S << 1 + 0.02 * unit(random), 0.02 * unit(random), 0, 1 + 0.02 * unit(random);
  scene.seen.linear = R * S;
  scene.seen.gain = 1 + 0.2 * unit(random);
  scene.seen.offset_grey = 10 * unit(random);
  return scene;
}

cv::Mat mat_of(const Pixels& pixels) {
  return {pixels.height_px, pixels.width_px, CV_8UC1, const_cast<std::uint8_t*>(pixels.grey.data())};
}

cv::Mat patch_of(const Scene& scene, const Pixels& taught) {
  const PixelWindow w = scene.window();
  return mat_of(taught)(cv::Rect(w.u0, w.v0, scene.patch_px, scene.patch_px));
}

struct EccEnd {
  Vector2d place_px = Vector2d::Constant(1e3);  // of the patch's middle
  double correlation = 0;                       // what it maximises, as it was before the last step
};

// From the given place, until the correlation rises by less than epsilon or for so many steps.
EccEnd ecc(const cv::Mat& patch, const cv::Mat& image, const Vector2d& start, double epsilon = 1e-5,
           int steps = 50) {
  const double half = 0.5 * (patch.cols - 1);
  cv::Mat warp = (cv::Mat_<float>(2, 3) << 1, 0, float(start.x() - half), 0, 1, float(start.y() - half));
  EccEnd end;
  try {
    end.correlation = cv::findTransformECC(
        patch, image, warp, cv::MOTION_AFFINE,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, steps, epsilon), cv::noArray(), 1);
  } catch (const cv::Exception&) {
    return end;
  }
  const auto at = [&](int row) {
    return double{warp.at<float>(row, 0)} * half + double{warp.at<float>(row, 1)} * half +
           double{warp.at<float>(row, 2)};
  };
  end.place_px = {at(0), at(1)};
  return end;
}

double vertex(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  return curvature < 0 ? 0.5 * (before - after) / curvature : 0;
}

Vector2d correlation_and_parabola(const cv::Mat& patch, const cv::Mat& image) {
  cv::Mat map;
  cv::matchTemplate(image, patch, map, cv::TM_CCOEFF_NORMED);
  cv::Point best;
  cv::minMaxLoc(map, nullptr, nullptr, nullptr, &best);
  Vector2d at = Vector2d(best.x, best.y) + Vector2d::Constant(0.5 * (patch.cols - 1));
  if (best.x < 1 || best.y < 1 || best.x + 1 >= map.cols || best.y + 1 >= map.rows) return at;
  const auto score = [&](int du, int dv) { return double{map.at<float>(best.y + dv, best.x + du)}; };
  return at + Vector2d(vertex(score(-1, 0), score(0, 0), score(1, 0)),
                       vertex(score(0, -1), score(0, 0), score(0, 1)));
}

Pattern teach(const Scene& scene, const Pixels& taught) {
  return teach_pattern(taught.view(), scene.window(), middle);
}

const Vector2d start_off(0.4, -0.3);

Vector2d fitted(const Pattern& pattern, const Pixels& seen, const Vector2d& start) {
  PatternWarp warp;
  warp.middle_px = start;
  const PatternFit fit = fit_pattern(seen.view(), pattern, PatternLevel(field_of(pattern)), warp);
  return fit.converged ? clicked_place(pattern, fit) : Vector2d::Constant(1e3);
}

struct Exposed {
  Scene scene;
  Pixels taught, seen;
  Pattern pattern;
};

Exposed exposed(int patch_px, int size_px, double spread_px) {
  std::mt19937_64 random(3);
  Exposed e{scene_of(42, patch_px, size_px, spread_px), {}, {}, {}};
  e.taught = expose(e.scene.taught_picture(), noise, random);
  e.seen = expose(e.scene.seen_picture(), noise, random);
  e.pattern = teach(e.scene, e.taught);
  return e;
}

void pattern_fit(benchmark::State& state) {
  const Exposed e = exposed(static_cast<int>(state.range(0)), 80, 1);
  const Vector2d start = e.scene.truth() + start_off;
  Vector2d place;
  for (auto _ : state) benchmark::DoNotOptimize(place = fitted(e.pattern, e.seen, start));
  state.counters["error_px"] = (place - e.scene.truth()).norm();
}
BENCHMARK(pattern_fit)->Arg(39)->Arg(41)->Arg(47)->Unit(benchmark::kMicrosecond);

void ecc_affine(benchmark::State& state) {
  cv::setNumThreads(1);
  const Exposed e = exposed(static_cast<int>(state.range(0)), 80, 1);
  const Vector2d start = e.scene.truth() + start_off;
  const cv::Mat patch = patch_of(e.scene, e.taught), image = mat_of(e.seen);
  const double epsilon = std::pow(10.0, -double(state.range(1)));
  EccEnd end;
  for (auto _ : state) benchmark::DoNotOptimize(end = ecc(patch, image, start, epsilon));
  state.counters["error_px"] = (end.place_px - e.scene.truth()).norm();
  // What its maximum would have been, and how far from there it stopped.
  const EccEnd best = ecc(patch, image, start, 1e-15, 2000);
  state.counters["short_of_end"] = best.correlation - end.correlation;
  state.counters["from_end_px"] = (best.place_px - end.place_px).norm();
}
// The second number: it stops when its correlation rises by less than ten to the minus that.
BENCHMARK(ecc_affine)->ArgsProduct({{39, 41, 47}, {5, 10}})->Unit(benchmark::kMicrosecond);

void teaching(benchmark::State& state) {
  const Exposed e = exposed(41, 80, 1);
  for (auto _ : state) benchmark::DoNotOptimize(teach(e.scene, e.taught));
}
BENCHMARK(teaching)->Unit(benchmark::kMicrosecond);

// A window of 200 x 200 px full of other texture.
const Exposed& large() {
  static const Exposed e = [] {
    Exposed made = exposed(41, 220, 50);
    std::mt19937_64 random(4);
    const test::Texture others = test::random_texture(150, 77);
    TextureLook look;
    look.place_px = Vector2d(110, 110);
    Picture picture = paint_texture(others, look, 220, 220), own = made.scene.seen_picture();
    const Vector2d at = made.scene.truth();
    for (int v = 0; v < 220; ++v) {
      for (int u = 0; u < 220; ++u) {
        if ((Vector2d(u, v) - at).cwiseAbs().maxCoeff() > 25) continue;
        picture.grey[static_cast<std::size_t>(v * 220 + u)] = own.grey[static_cast<std::size_t>(v * 220 + u)];
      }
    }
    made.seen = expose(picture, noise, random);
    return made;
  }();
  return e;
}

void search_in_200_px(benchmark::State& state) {
  const Exposed& e = large();
  MarkSearch search;
  search.kind = MarkKind::pattern;
  search.pattern = &e.pattern;
  search.expected_px = {109.5, 109.5};
  search.half_window_px = {100, 100};
  MarkFinding found;
  for (auto _ : state) benchmark::DoNotOptimize(found = find_pattern(e.seen.view(), search));
  state.counters["found"] = found.status == MarkStatus::found ? 1 : 0;
  state.counters["error_px"] = (found.u_px - e.scene.truth()).norm();
}
BENCHMARK(search_in_200_px)->Unit(benchmark::kMicrosecond);

void match_template(benchmark::State& state, bool then_ecc) {
  cv::setNumThreads(1);
  const Exposed& e = large();
  const cv::Mat patch = patch_of(e.scene, e.taught), window = mat_of(e.seen)(cv::Rect(10, 10, 200, 200));
  Vector2d place;
  for (auto _ : state) {
    place = correlation_and_parabola(patch, window);
    if (then_ecc) place = ecc(patch, window, place).place_px;
    benchmark::DoNotOptimize(place);
  }
  state.counters["error_px"] = (place + Vector2d(10, 10) - e.scene.truth()).norm();
}
void match_template_parabola_in_200_px(benchmark::State& state) { match_template(state, false); }
void match_template_ecc_in_200_px(benchmark::State& state) { match_template(state, true); }
BENCHMARK(match_template_parabola_in_200_px)->Unit(benchmark::kMicrosecond);
BENCHMARK(match_template_ecc_in_200_px)->Unit(benchmark::kMicrosecond);

// Sum of the variances of both coordinates: differences of the pictures in the eight unknowns of the true
// map; the noise of the taught picture counts times the gain.
double bound_px2(const Scene& scene) {
  using Vector8 = Eigen::Matrix<double, 8, 1>;
  const Vector2d truth = scene.truth(), from_place = middle - scene.taught.place_px;
  std::vector<Picture> pictures;
  for (int k = 0; k < 12; ++k) {
    Scene moved = scene;
    Vector2d place = truth;
    const double h = (k % 2 == 0 ? 1 : -1) * (k < 4 ? 0.01 : 5e-4);
    if (k < 4) place(k / 2) += h;
    if (k >= 4) moved.seen.linear((k - 4) / 4, k / 2 % 2) += h;
    moved.seen.place_px = place - moved.seen.linear * from_place;
    pictures.push_back(moved.seen_picture());
  }
  const Picture here = scene.seen_picture();
  const Matrix2d back = scene.seen.linear.inverse();
  Eigen::Matrix<double, 8, 8> N = Eigen::Matrix<double, 8, 8>::Zero();
  for (std::size_t i = 0; i < here.grey.size(); ++i) {
    const Vector2d at(double(i % std::size_t(scene.size_px)), double(i / std::size_t(scene.size_px)));
    if ((back * (at - truth)).cwiseAbs().maxCoeff() > 0.5 * scene.patch_px) continue;
    Vector8 j = Vector8::Ones();
    for (std::size_t k = 0; k < 6; ++k) {
      j(Eigen::Index(k)) = (pictures[2 * k].grey[i] - pictures[2 * k + 1].grey[i]) / (k < 2 ? 0.02 : 1e-3);
    }
    j(6) = here.grey[i];
    N += j * j.transpose();
  }
  const double variance = (noise * noise + 1.0 / 12) * (1 + scene.seen.gain * scene.seen.gain);
  return variance * N.inverse().topLeftCorner<2, 2>().trace();
}

// Not a time: errors per coordinate over 60 scenes with 40 pairs of exposures each.
void statistics(benchmark::State& state) {
  constexpr int scenes = 60, draws = 40;
  double ours = 0, by_ecc = 0, by_parabola = 0, bound = 0, held = 0, found = 0, count = 0, peers = 0;
  for (auto _ : state) {
    std::mt19937_64 random(5);
    for (int k = 0; k < scenes; ++k) {
      const Scene scene = scene_of(std::uint64_t(1000 + k), static_cast<int>(state.range(0)), 80, 3);
      const Picture taught_picture = scene.taught_picture(), seen_picture = scene.seen_picture();
      const Vector2d truth = scene.truth();
      bound += bound_px2(scene) / scenes;
      for (int draw = 0; draw < draws; ++draw, ++count) {
        const Pixels taught = expose(taught_picture, noise, random),
                     seen = expose(seen_picture, noise, random);
        const Pattern pattern = teach(scene, taught);
        MarkSearch search;
        search.pattern = &pattern;
        search.expected_px = search.half_window_px = {39.5, 39.5};
        const MarkFinding finding = find_pattern(seen.view(), search);
        if (finding.status == MarkStatus::found) {
          const Vector2d error = finding.u_px - truth;
          ours += error.squaredNorm();
          held += error.dot(finding.covariance_px2.inverse() * error) < 5.991 ? 1 : 0;
          ++found;
        }
        if (draw >= 5) continue;
        const cv::Mat patch = patch_of(scene, taught), image = mat_of(seen);
        by_ecc += (ecc(patch, image, truth + start_off).place_px - truth).squaredNorm();
        by_parabola += (correlation_and_parabola(patch, image) - truth).squaredNorm();
        ++peers;
      }
    }
  }
  state.counters["found"] = found / count;
  state.counters["error_px"] = std::sqrt(ours / found / 2);
  state.counters["error/bound"] = std::sqrt(ours / found / bound);
  state.counters["held_95"] = held / found;
  state.counters["ecc_px"] = std::sqrt(by_ecc / peers / 2);
  state.counters["parabola_px"] = std::sqrt(by_parabola / peers / 2);
}
BENCHMARK(statistics)->Arg(39)->Arg(43)->Arg(47)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace zeropose
