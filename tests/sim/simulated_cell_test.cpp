#include "sim/simulated_cell.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/example_cells.h"

namespace zeropose {
namespace {

using Frame = std::vector<std::uint8_t>;

Frame drawn(CellPictures& pictures, const Scene& scene) {
  const CameraModel& model = scene.cameras.front().model;
  Frame frame(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px));
  pictures.draw(0, frame);
  return frame;
}

double rms(const Frame& a, const Frame& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(double{1} * a[i] - b[i], 2);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

// Two frames of the same differ by twice the noise's variance, and that of rounding to grey levels.
TEST(CellPictures, ShowWhatStandsThereWithNewNoise) {
  const Scene scene = test::flat_car_body();
  CellPictures pictures({&scene, 1});
  const double noise = std::sqrt(2 * (std::pow(scene.picture.noise_sigma_grey, 2) + 1.0 / 12));
  const Frame nominal = drawn(pictures, scene);
  EXPECT_NEAR(rms(drawn(pictures, scene), nominal), noise, 0.02 * noise);
  pictures.show(0, scene.X_WO_nominal * from_six_numbers({10, 10, 10, 0, 0, 0}), {});
  EXPECT_GT(rms(drawn(pictures, scene), nominal), 2 * noise);
  pictures.show(0, scene.X_WO_nominal, {});
  EXPECT_NEAR(rms(drawn(pictures, scene), nominal), noise, 0.02 * noise);
  pictures.show(0, scene.X_WO_nominal, {{scene.marks[scene.views.front().mark].name}, {}});
  EXPECT_GT(rms(drawn(pictures, scene), nominal), 1.02 * noise);
}

}  // namespace
}  // namespace zeropose
