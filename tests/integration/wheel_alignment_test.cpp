// The wheel-alignment cell from rendered frames to camber and toe, without cameras and robots in between.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "config/cameras.h"
#include "measure/wheel_job.h"
#include "sim/renderer.h"
#include "sim/scene.h"
#include "tests/measure/wheel_scene.h"

namespace zeropose {
namespace {

const std::string cells = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/wheel-alignment";

class WheelAlignment : public testing::Test {
 protected:
  std::vector<std::uint8_t> exposed(const std::vector<float>& clean) {
    std::vector<std::uint8_t> pixels(clean.size());
    add_noise(clean, scene.picture.noise_sigma_grey, noise, pixels);
    return pixels;
  }
  ImageView view(std::size_t camera, const std::vector<std::uint8_t>& pixels) const {
    const CameraModel& model = scene.cameras[camera].model;
    return {pixels.data(), model.width_px, model.height_px, model.width_px};
  }
  // One exposure of the wheel at X_O0O.
  template <typename Look>
  auto look(const Pose& X_O0O, Look&& with_images) {
    std::vector<std::vector<std::uint8_t>> pixels;
    std::vector<CameraImage> images;
    for (std::size_t c = 0; c < scene.cameras.size(); ++c)
      pixels.push_back(exposed(CameraRenderer(scene, c).clean_picture(scene.X_WO_nominal * X_O0O)));
    for (std::size_t c = 0; c < pixels.size(); ++c) images.push_back({c, view(c, pixels[c])});
    return with_images(images);
  }
  Zero zero() {
    std::vector<WheelResult> exposures;
    for (int i = 0; i < cell.zero_frames; ++i)
      exposures.push_back(look(Pose::Identity(), [&](const std::vector<CameraImage>& images) {
        return look_at_wheel(images, job, cell.calibration, {});
      }));
    const ZeroResult result = make_wheel_zero(job, exposures);
    EXPECT_EQ(result.code, Code::ok) << result.reason;
    return result.zero;
  }

  const Cell cell = load_cell(cells + ".json");
  const Job& job = cell.jobs.front();
  const Scene scene = load_scene(cell, cells + ".sim.json");
  std::uint64_t noise = 4;
};

// The file that the daemon believes, and the truth: sensors set up round a wheel at y = -780 mm.
TEST_F(WheelAlignment, ItsCamerasWereCalibratedOnOnePlate) {
  test::WheelCell set_up = test::wheel_cell(example_tyres()[1]);
  std::mt19937_64 random(1);
  test::calibrate_on_plate(set_up, {}, random);
  const Pose X_WN = from_six_numbers({1320, -780, 318, 90, 0, 0});
  for (std::size_t c = 0; c < test::wheel_cameras; ++c) {
    EXPECT_LT(difference(scene.cameras[c].X_WC, X_WN * set_up.cameras[c].X_WC).norm(), 1e-4);
    const CalibratedCamera &believed = cell.calibration[c], &found = set_up.believed[c];
    EXPECT_NEAR(believed.model.fx_px, found.model.fx_px, 1e-6);
    EXPECT_NEAR(believed.model.cy_px, found.model.cy_px, 1e-6);
    EXPECT_LT(difference(believed.X_WC, X_WN * found.X_WC).norm(), 1e-4);
    EXPECT_GT(difference(believed.X_WC, scene.cameras[c].X_WC).norm(), 1e-3);  // it has errors
  }
}

// Zero and results with their own noise, the calibration with its errors. Noise alone is 0.003 degrees.
TEST_F(WheelAlignment, CamberAndToeAreFarWithinWhatIsAimedAt) {
  const Zero at_zero = zero();
  double worst_deg = 0, squares = 0, worst_mm = 0;
  int count = 0;
  for (const double camber : {-3.0, -0.5, 2.0})
    for (const double toe : {-3.0, -0.5, 2.0}) {
      const SixNumbers truth{camber, -toe, 0.5 * camber, camber, toe, 0};
      const Measurement m = look(from_six_numbers(truth), [&](const std::vector<CameraImage>& images) {
        return measure({images, job, cell.calibration, at_zero});
      });
      ASSERT_EQ(m.code, Code::ok) << camber << ' ' << toe << ": " << m.reason;
      const SixNumbers six = to_six_numbers(m.X_O0O);
      for (const double error : {six.rx_deg - camber, six.ry_deg - toe}) {
        worst_deg = std::max(worst_deg, std::abs(error));
        squares += error * error;
        ++count;
      }
      for (const double error : {six.x_mm - truth.x_mm, six.y_mm - truth.y_mm, six.z_mm - truth.z_mm})
        worst_mm = std::max(worst_mm, std::abs(error));
    }
  std::printf("camber and toe over -3..2 deg: RMS %.4f, worst %.4f deg; centre worst %.3f mm\n",
              std::sqrt(squares / count), worst_deg, worst_mm);
  EXPECT_LT(worst_deg, 0.05);
  EXPECT_LT(worst_mm, 0.1);
}

// Where lines cross, their centres pull each other, and the end of a line may look like a piece of another
// one; no draw of noise may hide a crossing. Two places where these did.
TEST_F(WheelAlignment, EveryExposureShowsEveryCrossing) {
  const std::array<std::pair<std::size_t, SixNumbers>, 2> places{
      {{3, {-0.5, -4.1, 0.4, 0, 0, 0}}, {0, {-5, 1.8, -1.6, 0.5, -1.5, 0}}}};
  for (const auto& [camera, six] : places) {
    const auto clean =
        CameraRenderer(scene, camera).clean_picture(scene.X_WO_nominal * from_six_numbers(six));
    for (int draw = 0; draw < 100; ++draw) {
      const auto pixels = exposed(clean);
      const auto lines = wheel_lines(job, cell.calibration, camera, view(camera, pixels));
      ASSERT_TRUE(lines);
      EXPECT_EQ(lines->status, LineArrayStatus::ok) << draw << ": " << lines->reason;
    }
  }
}

}  // namespace
}  // namespace zeropose
