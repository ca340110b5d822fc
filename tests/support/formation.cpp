#include "tests/support/formation.h"

#include <Eigen/LU>
#include <cmath>
#include <sstream>

#include "measure/marks.h"

namespace zeropose::test {
namespace {

using Eigen::Vector2d;

HardScene scene_with_disc(double diameter_px, const Vector2d& off_px) {
  HardScene scene;
  scene.width_px = scene.height_px = static_cast<int>(diameter_px) + 36;
  scene.ground_grey = 160;
  const Vector2d middle = Vector2d::Constant(0.5 * (scene.width_px - 1));
  scene.layers = {disc_layer(middle + off_px, diameter_px, 1, 0, 60)};
  return scene;
}

struct Sums {
  int found = 0;
  Vector2d error = Vector2d::Zero();
  double distance = 0, squares = 0, variance = 0, held = 0;

  void add(const Shot& shot, double diameter_px, const Vector2d& truth_px) {
    MarkSearch search;
    search.expected_px = search.half_window_px = Vector2d::Constant(0.5 * (shot.width_px - 1));
    search.min_diameter_px = 0.8 * diameter_px, search.max_diameter_px = 1.2 * diameter_px;
    const MarkFinding finding = find_marks(shot.view(), {&search, 1}).front();
    if (finding.status != MarkStatus::found) return;
    const Vector2d off = finding.u_px - truth_px;
    ++found;
    error += off, distance += off.norm(), squares += off.squaredNorm() / 2;
    variance += finding.covariance_px2.trace() / 2;
    held += off.dot(finding.covariance_px2.inverse() * off) < 5.991 ? 1 : 0;
  }

  FormationFigures figures() const {
    const double n = std::max(1, found);
    return {found, error / n, distance / n, std::sqrt(squares / n), std::sqrt(variance / n), held / n};
  }
};

FormationFigures measure(const Formation& formation, double diameter_px, int phases, int draws) {
  std::mt19937_64 random(77);
  std::uniform_real_distribution<double> phase(-4, 4);
  Sums sums;
  for (int k = 0; k < phases; ++k) {
    const HardScene scene = scene_with_disc(diameter_px, {phase(random), phase(random)});
    const Vector2d truth = 0.5 * (scene.layers[0].low_px + scene.layers[0].high_px);
    const Irradiance picture = expose_scene(scene, formation.lens, formation.sensor);
    if (draws == 0) sums.add(shoot_without_noise(picture, formation.sensor), diameter_px, truth);
    for (int draw = 0; draw < draws; ++draw) {
      sums.add(shoot(picture, formation.sensor, random), diameter_px, truth);
    }
  }
  return sums.figures();
}

}  // namespace

std::string name_of(const Formation& formation) {
  const HardLens& lens = formation.lens;
  std::ostringstream text;
  text << "zero " << lens.first_zero_px;
  if (lens.second_share > 0) text << " + " << lens.second_share << " of " << lens.second_zero_px;
  if (lens.veil_share > 0) text << ", veil " << lens.veil_share;
  if (lens.focal_px > 0) text << ", vignetting";
  text << ", gamma " << formation.sensor.gamma;
  if (formation.sensor.quality > 0) text << ", quality " << formation.sensor.quality;
  return text.str();
}

FormationFigures measure_without_noise(const Formation& formation, double diameter_px, int phases) {
  return measure(formation, diameter_px, phases, 0);
}

FormationFigures measure_with_noise(const Formation& formation, double diameter_px, int phases, int draws) {
  return measure(formation, diameter_px, phases, draws);
}

}  // namespace zeropose::test
