#include "sim/scene.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "example_cells.h"
#include "sim/sim_file.h"

namespace zeropose {
namespace {

using test::car_body;
using test::cells;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

// A file with this text for the time of a test.
class TextFile {
 public:
  explicit TextFile(const std::string& text)
      : path_(testing::TempDir() + "scene-test-" + std::to_string(getpid()) + ".sim.json") {
    std::ofstream(path_) << text;
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  ~TextFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string car_body_text() {
  std::ifstream file(cells + "car-body.sim.json");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<std::string> mistakes_of(const std::string& text) {
  const TextFile file(text);
  try {
    load_scene(load_cell(cells + "car-body.json"), file.path());
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

TEST(Scene, HoldsTheTruthOfTheSimFileAndTheMarksOfTheCell) {
  const Scene scene = car_body();
  ASSERT_EQ(scene.cameras.size(), 4U);
  EXPECT_EQ(scene.cameras[1].name, "camera2");
  EXPECT_EQ(scene.cameras[1].model.fx_px, 4417.89);
  EXPECT_EQ(std::get<Division>(scene.cameras[1].model.distortion).K, 1.061292);
  EXPECT_NEAR(to_six_numbers(scene.cameras[3].X_WC).ry_deg, 2.036, 1e-9);
  EXPECT_EQ(scene.marks.size(), 12U);
  EXPECT_EQ(scene.views.size(), 12U);
  EXPECT_EQ(scene.picture.noise_sigma_grey, 2);
  EXPECT_EQ(scene.picture.clutter, 12);
}

TEST(Scene, DoesNotUseTheDaemonsCalibration) {
  Cell cell = load_cell(cells + "car-body.json");
  for (CalibratedCamera& camera : cell.calibration) camera.model.fx_px = 1;
  EXPECT_EQ(load_scene(cell, cells + "car-body.sim.json").cameras[0].model.fx_px, 4235.24);
}

TEST(Scene, KeepsTheCellsOrderOfCameras) {
  Cell cell = load_cell(cells + "car-body.json");
  std::ranges::reverse(cell.cameras);
  EXPECT_EQ(load_scene(cell, cells + "car-body.sim.json").cameras[0].name, "camera4");
}

TEST(Scene, NamesACameraThatOnlyOneFileKnows) {
  const auto mistakes = mistakes_of(with(car_body_text(), "\"camera3\"", "\"camera7\""));
  EXPECT_THAT(mistakes, Contains(AllOf(HasSubstr("cameras.camera3"), HasSubstr("missing"))));
  EXPECT_THAT(mistakes, Contains(AllOf(HasSubstr("cameras.camera7"), HasSubstr("unknown"))));
}

TEST(Scene, NamesACameraOfAnotherSize) {
  EXPECT_THAT(mistakes_of(with(car_body_text(), "\"width\": 768", "\"width\": 640")),
              Contains(AllOf(HasSubstr("camera1"), HasSubstr("640 x 572"), HasSubstr("768 x 572"))));
}

TEST(SimFile, NamesEveryMistakeWithItsKeyPath) {
  std::string text = with(car_body_text(), "\"blur_sigma_px\": 0.7", "\"blur_sigma_px\": -1");
  text = with(text, "\"clutter\": 12", "\"cluter\": 12");
  const auto mistakes = mistakes_of(text);
  EXPECT_THAT(mistakes, Contains(HasSubstr("picture.blur_sigma_px")));
  EXPECT_THAT(mistakes, Contains(AllOf(HasSubstr("picture.clutter"))));
  EXPECT_THAT(mistakes, Contains(HasSubstr("cluter")));
}

TEST(SimFile, SaysWhatTheObjectLooksLike) {
  EXPECT_TRUE(std::holds_alternative<PlatesObject>(car_body().object));
  const auto sheet = std::get<SheetObject>(test::example("press-shop").object);
  ASSERT_EQ(sheet.outline_mm.size(), 4U);
  EXPECT_EQ(sheet.outline_mm[1], Eigen::Vector2d(2100, -950));
  const auto plate = std::get<BallPlateObject>(test::example("gun-check").object);
  EXPECT_EQ(plate.middle_O_mm, Eigen::Vector3d(12, 9, -4));
  EXPECT_EQ(plate.size_mm, Eigen::Vector2d(70, 64));
}

// The car body's truth with an object of its own.
std::vector<std::string> mistakes_of_object(const std::string& object) {
  return mistakes_of(with(car_body_text(), "\"picture\":", "\"object\": " + object + ", \"picture\":"));
}

TEST(SimFile, NamesWhatIsWrongWithTheObject) {
  EXPECT_THAT(mistakes_of_object("{ \"kind\": \"plates\" }"), testing::IsEmpty());
  EXPECT_THAT(mistakes_of_object("{ \"kind\": \"bal_plate\" }"),
              Contains(AllOf(HasSubstr("object.kind"), HasSubstr("ball_plate"))));
  EXPECT_THAT(mistakes_of_object("{ \"kind\": \"sheet\" }"), Contains(HasSubstr("object.outline_mm")));
  EXPECT_THAT(mistakes_of_object(R"({ "kind": "sheet", "outline_mm": [[0, 0, 0], [1, 0, 0]] })"),
              Contains(AllOf(HasSubstr("object.outline_mm"), HasSubstr("2 corners"))));
  EXPECT_THAT(mistakes_of_object(R"({ "kind": "sheet", "outline_mm": [[0, 0, 0], [1, 0, 0], [1, 1, 2]] })"),
              Contains(AllOf(HasSubstr("object.outline_mm"), HasSubstr("in space"))));
  EXPECT_THAT(mistakes_of_object(R"({ "kind": "ball_plate", "middle_mm": [0, 0, 0], "size_mm": [0, 5] })"),
              Contains(HasSubstr("object.size_mm")));
  EXPECT_THAT(mistakes_of_object(R"({ "kind": "plates", "size_mm": [5, 5] })"),
              Contains(HasSubstr("object.size_mm")));
}

TEST(SimFile, SaysHowPartsCome) {
  const auto drive = [](const char* cell) { return load_sim_file(cells + cell + ".sim.json").drive.value(); };
  EXPECT_EQ(drive("car-body").shift, Vector6(30, 30, 30, 0.2, 0.2, 0.2));
  EXPECT_EQ(drive("car-body").max_error, Vector6(0.4, 0.4, 0.4, 0.012, 0.012, 0.012));
  EXPECT_EQ(drive("car-body").beyond_every, 0);
  EXPECT_EQ(drive("press-shop").max_error_at_points_mm, 2);
  EXPECT_EQ(drive("gun-check").poses.size(), 14U);
  EXPECT_NEAR(drive("gun-check").poses[1].translation().z(), 0.06 * -33.7, 1e-9);
}

TEST(SimFile, NamesWhatIsWrongWithTheDrive) {
  const std::string text = car_body_text();
  EXPECT_THAT(mistakes_of(with(text, "\"shift\": [30", "\"shift\": [-30")),
              Contains(HasSubstr("drive.shift")));
  EXPECT_THAT(mistakes_of(with(text, "\"max_error\"", "\"max_eror\"")),
              Contains(AllOf(HasSubstr("drive.max_eror"), HasSubstr("\"max_error\""))));
}

TEST(SimFile, MissingFileIsAConfigError) {
  EXPECT_THROW(load_sim_file(cells + "no-such-cell.sim.json"), ConfigError);
}

}  // namespace
}  // namespace zeropose
