#include "config/cameras.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/cameras_json.h"
#include "config/files.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

CalibratedCamera division_camera() {
  CalibratedCamera camera;
  camera.name = "camera 10";
  camera.model = {768, 572, 4235.24 / 3, 4227.56 / 7, 416.04, 332.77, Division{-0.010727 / 3}};
  camera.X_WC = from_six_numbers({-1884.24, -3062.7, -938.71, -69.175, -2.986, -35.415});
  return camera;
}

CalibratedCamera brown_camera() {
  CalibratedCamera camera = division_camera();
  camera.name = "camera 9";
  camera.model.distortion = BrownConrady{-0.1 / 3, 0.01, 1e-4, -2e-5, 1e-300};
  return camera;
}

std::vector<std::string> mistakes_in(const std::string& text) {
  try {
    parse_cameras(text, "c.json");
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

TEST(Cameras, ComeBackFromAFileInTheirOrder) {
  const TemporaryFolder directory;
  save_cameras(directory.path() / "c.json", {division_camera(), brown_camera()});
  const std::vector<CalibratedCamera> cameras = load_cameras(directory.path() / "c.json");
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "camera 10");
  EXPECT_EQ(cameras[1].name, "camera 9");
  EXPECT_EQ(cameras[0].model.fx_px, division_camera().model.fx_px);
  EXPECT_EQ(cameras[0].model.cy_px, division_camera().model.cy_px);
  EXPECT_EQ(std::get<Division>(cameras[0].model.distortion).K, -0.010727 / 3);
  const auto brown = std::get<BrownConrady>(cameras[1].model.distortion);
  EXPECT_EQ(brown.k1, -0.1 / 3);
  EXPECT_EQ(brown.k3, 1e-300);
  EXPECT_LT(difference(cameras[0].X_WC, division_camera().X_WC).norm(), 1e-9);
}

TEST(Cameras, SavedTextIsStable) {
  const std::string text = cameras_text({division_camera()});
  const std::string again = cameras_text(parse_cameras(text, "c.json"));
  EXPECT_LT(difference(parse_cameras(again, "")[0].X_WC, parse_cameras(text, "")[0].X_WC).norm(), 1e-9);
}

TEST(Cameras, ExampleHasThePublishedNumbers) {
  const auto cameras = load_cameras(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.calibration.json");
  ASSERT_EQ(cameras.size(), 4U);
  EXPECT_EQ(cameras[3].name, "camera4");
  EXPECT_EQ(cameras[3].model.width_px, 768);
}

TEST(Cameras, FromAnotherFilesJson) {
  const auto json = nlohmann::json::parse(cameras_text({division_camera()}));
  EXPECT_EQ(cameras_from_json(json, "sim.json")[0].model.fx_px, division_camera().model.fx_px);
  EXPECT_THROW(cameras_from_json(nlohmann::json(3), "sim.json"), ConfigError);
}

TEST(Cameras, MistakesAreNamed) {
  EXPECT_THAT(mistakes_in("{}"),
              ElementsAre("c.json: found no camera, expected at least one camera by name"));
  EXPECT_THAT(mistakes_in("[]"), ElementsAre("c.json: found an array of 0, expected an object"));
  const std::string good = cameras_text({division_camera()});
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return mistakes_in(text);
  };
  EXPECT_THAT(with("\"K\"", "\"k\""),
              ElementsAre(HasSubstr("camera 10.K: found no such key"),
                          HasSubstr("camera 10.k: found an unknown key, expected \"K\"?")));
  EXPECT_THAT(with("division", "fisheye"),
              ElementsAre("c.json: camera 10.model: found \"fisheye\", expected one of division, brown"));
  EXPECT_THAT(with("division", "brown"), testing::SizeIs(6));
  EXPECT_THAT(with("\"height\":572", "\"height\":0"),
              ElementsAre("c.json: camera 10.height: found 0, expected an integer from 1 to 65535"));
  EXPECT_THAT(
      with("-1884.24", "null"),
      ElementsAre("c.json: camera 10.X_WC[0]: found null, expected a number from -1000000 to 1000000"));
}

// The digests of FIPS 180-2's examples.
TEST(Files, Sha256) {
  EXPECT_EQ(hex(sha256("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(short_hash("abc"), 0xba7816bfU);
  EXPECT_EQ(short_hash(""), 0xe3b0c442U);
}

}  // namespace
}  // namespace zeropose
