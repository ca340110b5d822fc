// The car-body cell replayed from folders of pictures: the same measurement as from memory, bit by bit, again
// and again.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "config/cell.h"
#include "daemon/cycle.h"
#include "drivers/picture_file.h"
#include "sim/scene.h"
#include "tests/support/rendered_pictures.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;

class FolderReplay : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "zeropose-replay-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    root = name;
  }
  void TearDown() override { std::filesystem::remove_all(root); }

  // What the camera shows goes into its folder.
  void save(CameraOptions& camera, const ImageView& image) {
    camera.driver = CameraDriver::folder;
    camera.folder.path = root / camera.name;
    std::filesystem::create_directory(camera.folder.path);
    Frame frame;
    frame.width_px = image.width_px;
    frame.height_px = image.height_px;
    frame.stride_bytes = image.stride_bytes;
    frame.pixels = own_pixels({image.data, image.data + image.stride_bytes * image.height_px});
    const auto png = encode_png(frame);
    std::ofstream(camera.folder.path / "1.png", std::ios::binary)
        .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  }

  std::filesystem::path root;
};

FrameSet grabbed(Grabber& grabber) {
  const std::vector<std::size_t> all{0, 1, 2, 3};
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  FrameSet set;
  do set = grabber.grab_live(all, deadline);
  while (set.code == Code::camera_missing && std::chrono::steady_clock::now() < deadline);
  return set;
}

TEST_F(FolderReplay, GivesTheMeasurementOfThePicturesInMemory) {
  const std::string cells = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/";
  Cell cell = load_cell(cells + "car-body.json");
  const Scene scene = load_scene(cell, cells + "car-body.sim.json");
  const test::SceneRenderer renderer(scene);
  std::uint64_t noise_state = 5;
  test::Exposed exposed(renderer.cameras(), renderer.clean(from_six_numbers({5, -7, 3, 0.1, -0.05, 0.08})),
                        scene.picture.noise_sigma_grey, noise_state);
  const Job& job = cell.jobs.front();
  Zero zero;
  zero.compensation_O_mm.assign(job.marks.size(), Eigen::Vector3d::Zero());
  const Measurement memory = measure({exposed.images(), job, renderer.cameras(), zero});
  ASSERT_EQ(memory.code, Code::ok) << memory.reason;
  for (std::size_t i = 0; i < 4; ++i) save(cell.cameras[i], exposed.images()[i].image);

  Grabber grabber(cell.cameras);
  for (int pass = 0; pass < 3; ++pass) {  // the one picture of each folder is no frozen camera
    const FrameSet set = grabbed(grabber);
    ASSERT_EQ(set.code, Code::ok) << set.reason;
    std::vector<CameraImage> images;
    for (std::size_t i = 0; i < 4; ++i) images.push_back({i, view_of(set.frames[i])});
    const Measurement replayed = measure({images, job, renderer.cameras(), zero});
    ASSERT_EQ(replayed.code, Code::ok) << replayed.reason;
    EXPECT_EQ(replayed.X_O0O.matrix(), memory.X_O0O.matrix());
    ASSERT_EQ(replayed.health.size(), 4U);
    for (const PictureHealth& health : replayed.health)
      EXPECT_NEAR(health.noise_grey, scene.picture.noise_sigma_grey, 0.5);
  }
}

}  // namespace
}  // namespace zeropose
