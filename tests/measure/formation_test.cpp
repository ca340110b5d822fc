// The maker of hard pictures itself, and what an image formation that is not the estimator's does to the
// centre: diffraction, veil, vignetting, gamma, compression.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/support/formation.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::expose_scene;
using test::Formation;
using test::HardLens;
using test::HardScene;
using test::HardSensor;
using test::Irradiance;

HardScene scene_of(const Vector2d& centre_px) {
  HardScene scene;
  scene.width_px = scene.height_px = 64;
  scene.ground_grey = 160;
  scene.layers = {test::disc_layer(centre_px, 24, 0.6, 0.4, 60)};
  return scene;
}

// The missing light is the area, its centroid the centre, whatever the lens does symmetrically.
TEST(HardPicture, AreaAndCentroidAreThoseOfTheEllipse) {
  const Vector2d centre(31.27, 32.61);
  HardLens blurred, moved;
  blurred.defocus_px = 3, moved.motion_px = {2.3, -1.4};
  for (const HardLens& lens : {HardLens{}, blurred, moved}) {
    const Irradiance picture = expose_scene(scene_of(centre), lens, HardSensor{});
    double area = 0;
    Vector2d first = Vector2d::Zero();
    for (int v = 0; v < 64; ++v) {
      for (int u = 0; u < 64; ++u) {
        const double share = (160 - 255 * picture.light[static_cast<std::size_t>(v * 64 + u)]) / 100;
        area += share;
        first += share * Vector2d(u, v);
      }
    }
    EXPECT_NEAR(area, std::numbers::pi / 4 * 24 * 24 * 0.6, 0.03);
    EXPECT_LT((first / area - centre).norm(), 5e-4);
  }
}

TEST(HardPicture, TwoBytesSayTheSameMoreFinely) {
  const Irradiance picture = expose_scene(scene_of({31, 32}), HardLens{}, HardSensor{});
  HardSensor deep;
  deep.white = 4095;
  const test::Shot fine = shoot_without_noise(picture, deep),
                   plain = shoot_without_noise(picture, HardSensor{});
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) ASSERT_NEAR(fine.view().grey_at(u, v), plain.view().grey_at(u, v), 0.54);
  }
}

// Of a flat grey with noise, compression takes noise away and keeps the mean; more of it at a lower quality.
TEST(HardPicture, CompressionRoundsTheSpectrum) {
  std::mt19937_64 random(4);
  HardScene scene;
  scene.width_px = scene.height_px = 64;
  const Irradiance flat = expose_scene(scene, HardLens{}, HardSensor{});
  double before = 1e9;
  for (const int quality : {0, 90, 70}) {
    HardSensor sensor;
    sensor.quality = quality;
    const test::Shot shot = shoot(flat, sensor, random);
    double sum = 0, squares = 0;
    for (const std::uint8_t grey : shot.bytes) sum += grey, squares += (grey - 150.0) * (grey - 150.0);
    // Noise of 2.1 greys over 4096 pixels, four sigma; and half a step of a block's mean.
    EXPECT_NEAR(sum / 4096, 150, 0.13 + (quality == 0 ? 0 : quality == 90 ? 3.0 / 16 : 10.0 / 16));
    EXPECT_LT(squares, before);
    before = squares;
  }
}

struct Row {
  Formation formation;
  double most_bias_px, most_mean_px;
};

// Without noise, over 200 phases; rounding to whole greys alone moves a centre by 0.001 px. Plain optics
// leave a shape of edge that is not the model's, both sides of a disc alike, and gamma moves each edge
// inwards or outwards by the same amount: the size changes, the centre does not. Vignetting is a slope, which
// the fit takes up. Compression at quality 90 rounds the spectrum of each block in steps q of 2..20 greys, an
// error of about q / sqrt(12) = 1.5 greys per pixel: like noise of that size it moves the centre per axis by
// 1.5 / 100 * sqrt(2 s / (sqrt(pi) R)) = 0.005 px (20 px), and the mean over the phases by a 14th of it.
TEST(Formation, BiasStaysSmall) {
  Formation airy, soft, gamma, compressed, corner;
  soft.lens.first_zero_px = 2.5, soft.lens.veil_share = 0.03;
  gamma.sensor.gamma = 0.45;
  compressed.sensor.quality = 90;
  corner.lens.focal_px = 500, corner.lens.axis_px = {-250, -180};
  for (const double diameter : {20.0, 40.0}) {
    for (const Row& row : {Row{airy, 0.0006, 0.0015}, Row{soft, 0.0006, 0.0015}, Row{gamma, 0.0006, 0.0015},
                           Row{corner, 0.001, 0.003}, Row{compressed, 0.0015, 0.007}}) {
      const test::FormationFigures figures = measure_without_noise(row.formation, diameter, 200);
      std::printf("%-40s %2.0f px: bias %.5f mean %.5f px\n", name_of(row.formation).c_str(), diameter,
                  figures.bias_px.norm(), figures.mean_px);
      EXPECT_EQ(figures.found, 200);
      EXPECT_LE(figures.bias_px.norm(), row.most_bias_px) << name_of(row.formation) << ' ' << diameter;
      EXPECT_LE(figures.mean_px, row.most_mean_px) << name_of(row.formation) << ' ' << diameter;
    }
  }
}

// 1000 marks of two coordinates each: the error is known to 2.2 %, the share held to 0.7 % (one sigma). Noise
// grows with the light, and neither optics nor gamma are the model's.
TEST(Formation, CovarianceIsHonest) {
  Formation airy, gamma;
  gamma.lens.first_zero_px = 2, gamma.sensor.gamma = 0.45;
  for (const Formation& formation : {airy, gamma}) {
    for (const double diameter : {20.0, 40.0}) {
      const test::FormationFigures figures = measure_with_noise(formation, diameter, 50, 20);
      std::printf("%-40s %2.0f px: rms %.5f sigma %.5f px, held %.3f\n", name_of(formation).c_str(), diameter,
                  figures.rms_px, figures.sigma_px, figures.held);
      EXPECT_EQ(figures.found, 1000);
      EXPECT_GE(figures.held, 0.92) << name_of(formation) << ' ' << diameter;
      EXPECT_LE(figures.rms_px, 1.1 * figures.sigma_px) << name_of(formation) << ' ' << diameter;
    }
  }
}

}  // namespace
}  // namespace zeropose
