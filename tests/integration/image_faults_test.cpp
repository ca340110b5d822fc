// What is wrong with a picture gets its exact code (spec 85 R4): rendered pictures of the car-body cell,
// spoilt one way each. Truncated pictures never come this far: the driver answers frame_damaged.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "config/cell.h"
#include "sim/scene.h"
#include "tests/support/rendered_pictures.h"
#include "tests/support/sanitized.h"

namespace zeropose {
namespace {

using test::CleanPicture;

std::string cells() { return std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/"; }

// As a lens out of focus or a shaking camera shows it.
CleanPicture blurred(const CleanPicture& picture, const CameraModel& model, double sigma_px) {
  const int reach = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<float> bell;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i)
    sum += bell.emplace_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  const auto along = [&](const CleanPicture& from, int du, int dv) {
    CleanPicture to(from.size());
    for (int v = 0; v < model.height_px; ++v)
      for (int u = 0; u < model.width_px; ++u) {
        float grey = 0;
        for (int i = -reach; i <= reach; ++i) {
          const int x = std::clamp(u + i * du, 0, model.width_px - 1);
          const int y = std::clamp(v + i * dv, 0, model.height_px - 1);
          grey += bell[static_cast<std::size_t>(i + reach)] *
                  from[static_cast<std::size_t>(y * model.width_px + x)];
        }
        to[static_cast<std::size_t>(v * model.width_px + u)] = grey / sum;
      }
    return to;
  };
  return along(along(picture, 1, 0), 0, 1);
}

CleanPicture brighter(CleanPicture picture, float factor) {
  for (float& grey : picture) grey *= factor;
  return picture;
}

class ImageFaults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    cell_ = new Cell(load_cell(cells() + "car-body.json"));
    const Scene scene = load_scene(*cell_, cells() + "car-body.sim.json");
    renderer_ = new test::SceneRenderer(scene);
    clean_ = new std::vector<CleanPicture>(renderer_->clean(scene.X_WO_nominal));
    noise_grey_ = scene.picture.noise_sigma_grey;
  }
  static void TearDownTestSuite() {
    delete clean_;
    delete renderer_;
    delete cell_;
  }

  void SetUp() override {
    job = cell_->jobs.front();
    // Every camera counts: a fault of one is never made up for by the others.
    job.requirements.min_marks_per_camera = 2;
    zero.compensation_O_mm.assign(job.marks.size(), Eigen::Vector3d::Zero());
    pictures = *clean_;
  }

  Measurement measured() {
    test::Exposed exposed(renderer_->cameras(), pictures, noise_grey_, noise_state);
    if (after) after(exposed.images());
    return measure({exposed.images(), job, renderer_->cameras(), zero});
  }
  void expect(Code code, const std::string& words) {
    const Measurement measurement = measured();
    EXPECT_EQ(measurement.code, code) << measurement.reason;
    EXPECT_NE(measurement.reason.find(words), std::string::npos) << measurement.reason;
  }
  const CameraModel& model(std::size_t camera) const { return renderer_->cameras()[camera].model; }
  static std::string name(std::size_t camera) { return "camera" + std::to_string(camera + 1); }

  static inline Cell* cell_ = nullptr;
  static inline test::SceneRenderer* renderer_ = nullptr;
  static inline std::vector<CleanPicture>* clean_ = nullptr;
  static inline double noise_grey_ = 0;
  Job job;
  Zero zero;
  std::vector<CleanPicture> pictures;
  std::function<void(std::vector<CameraImage>&)> after;
  std::uint64_t noise_state = 1;
};

TEST_F(ImageFaults, NoneIsOk) { expect(Code::ok, ""); }

TEST_F(ImageFaults, Black) {
  for (std::size_t camera = 0; camera < 4; ++camera)
    for (const float light : {0.0F, 0.02F}) {
      pictures = *clean_;
      pictures[camera] = brighter(pictures[camera], light);
      expect(Code::image_dark, name(camera));
    }
}

TEST_F(ImageFaults, Saturated) {
  for (std::size_t camera = 0; camera < 4; ++camera)
    for (const float light : {2.0F, 3.0F, 6.0F, 20.0F}) {
      pictures = *clean_;
      pictures[camera] = brighter(pictures[camera], light);
      expect(Code::image_saturated, name(camera));
    }
}

TEST_F(ImageFaults, Blurred) {
  for (std::size_t camera = 0; camera < static_cast<std::size_t>(test::trials(4)); ++camera)
    for (const double sigma_px : {5.0, 8.0, 12.0}) {
      pictures = *clean_;
      pictures[camera] = blurred(pictures[camera], model(camera), sigma_px);
      SCOPED_TRACE(name(camera) + " " + std::to_string(sigma_px));
      expect(Code::image_blurred, name(camera));
    }
}

TEST_F(ImageFaults, WrongSize) {
  for (std::size_t camera = 0; camera < 4; ++camera) {
    after = [camera](std::vector<CameraImage>& images) { images[camera].image.height_px -= 2; };
    expect(Code::frame_wrong_size, name(camera) + " delivered 768 x 570 px, it is calibrated for 768 x 572");
  }
}

// A mark that is hidden is missing, not blurred.
TEST_F(ImageFaults, CoveredIsNotBlurred) {
  for (std::size_t camera = 0; camera < 4; ++camera) {
    Faults faults;
    for (const View& view : job.views)
      if (view.camera == camera) faults.covered.insert(job.marks[view.mark].name);
    pictures = renderer_->clean(job.X_WO_nominal, faults);
    expect(Code::too_few_marks_in_camera, name(camera));
  }
}

// Nothing in a picture says whose it is: what gives exchanged cameras away is that the marks are not where
// they should be.
TEST_F(ImageFaults, SwappedCamerasAreNeverOk) {
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      pictures = *clean_;
      std::swap(pictures[a], pictures[b]);
      const int code = static_cast<int>(measured().code);
      EXPECT_TRUE(code / 100 == 3 || code / 100 == 4) << code;
    }
}

}  // namespace
}  // namespace zeropose
