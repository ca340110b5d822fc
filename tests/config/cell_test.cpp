#include "config/cell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "example_cell.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

TEST(Cell, LoadsTheExample) {
  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  EXPECT_EQ(cell.name, "car-body");
  EXPECT_TRUE(cell.simulated);
  ASSERT_EQ(cell.cameras.size(), 4U);
  EXPECT_EQ(cell.cameras[2].gige.address, "127.0.0.13");
  EXPECT_EQ(cell.cameras[2].width_px, 768);
  EXPECT_FALSE(cell.cameras[2].exposure_us);
  ASSERT_EQ(cell.calibration.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(cell.calibration[i].name, cell.cameras[i].name);
  ASSERT_EQ(cell.robots.size(), 2U);
  EXPECT_EQ(std::get<CanOptions>(cell.robots[1].link).interface, "vcan0");
  const auto& link = std::get<ModbusTcpOptions>(cell.robots[0].link);
  EXPECT_EQ(link.port, 1502);
  EXPECT_EQ(cell.robots[0].convention, Convention::kuka);
  EXPECT_EQ(cell.robots[0].frame, CorrectionFrame::robot_base_shift);
  EXPECT_TRUE(link.robot.unit.require_command_crc);
  EXPECT_NEAR(to_six_numbers(cell.robots[0].X_WR).rz_deg, 90, 1e-12);
  EXPECT_EQ(cell.deadline.count(), 500);
  EXPECT_EQ(cell.zero_frames, 10);
  EXPECT_EQ(cell.config_hash, short_hash(example_text()));
  EXPECT_EQ(cell.calibration_hash, short_hash(example_calibration_text()));
}

TEST(Cell, LoadsTheExamplesJob) {
  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  ASSERT_EQ(cell.jobs.size(), 1U);
  const Job& job = cell.jobs[0];
  ASSERT_EQ(job.marks.size(), 12U);
  ASSERT_EQ(job.views.size(), 12U);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(job.views[i].mark, i);
    EXPECT_EQ(job.views[i].camera, i / 3);
    EXPECT_DOUBLE_EQ(job.marks[i].normal_O.norm(), 1);
  }
  EXPECT_EQ(job.marks[1].name, "camera1/2");
  EXPECT_EQ(job.marks[1].weight, 0.5);
  EXPECT_EQ(job.marks[1].p_O_mm, Eigen::Vector3d(-231.59, -857.37, 233.76));
  EXPECT_EQ(job.marks[1].tolerance_mm, no_tolerance);
  EXPECT_EQ(job.requirements.min_marks, 6);
  EXPECT_EQ(job.requirements.limits[5].max, 0.5);
  EXPECT_EQ(job.application_points.at(3).name, "rear right");
}

TEST(Cell, LoadsTheExamplesReferencePoints) {
  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  ASSERT_EQ(cell.references.points.size(), 12U);
  ASSERT_EQ(cell.references.views.size(), 12U);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(cell.references.views[i].mark, i);
    EXPECT_EQ(cell.references.views[i].camera, i / 3);
    EXPECT_TRUE(cell.references.points[i].mark.bright);
  }
  EXPECT_EQ(cell.references.search_mm, 20);
  EXPECT_EQ(cell.references.sigma_px, 0.05);
  EXPECT_FALSE(cell.references.suspicious_blocks);
}

TEST(Cell, AReferenceThatWasTaughtAsAPixelLiesOnItsLineOfSight) {
  Json json = example();
  json["reference_points"][0] = parsed(
      R"({"name": "t", "cameras": ["camera2"], "kind": "dark_disc", "pixel": [100, 90], "diameter_px": 30})");
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  const ReferencePoint& point = cell.references.points[0];
  const CalibratedCamera& camera = cell.calibration[1];
  const Eigen::Vector3d p_C = camera.X_WC.inverse() * point.mark.p_O_mm;
  EXPECT_LT((*project(camera.model, p_C) - Eigen::Vector2d(100, 90)).norm(), 1e-6);
  EXPECT_NEAR(2 * point.mark.radius_mm * camera.model.fx_px / p_C.z(), 30, 1e-9);
}

TEST(Cell, NamesWhatIsWrongWithAReferencePoint) {
  const auto mistake = [](const char* key, const Json& value) {
    Json json = example();
    Json& point = json["reference_points"][1];
    if (value.is_null())
      point.erase(key);
    else
      point[key] = value;
    const auto mistakes = mistakes_in(json);
    EXPECT_EQ(mistakes.size(), 1U) << key;
    return mistakes.empty() ? std::string() : mistakes.front();
  };
  EXPECT_THAT(mistake("position_mm", nullptr),
              HasSubstr("reference_points[1].position_mm: found neither position_mm nor pixel"));
  EXPECT_THAT(mistake("position_mm", {0, 0, 100000}),
              HasSubstr("reference_points[1].position_mm: found a point outside the picture"));
  EXPECT_THAT(mistake("radius_mm", nullptr),
              HasSubstr("reference_points[1].radius_mm: found a point without it"));
  EXPECT_THAT(mistake("name", "camera1/R1"), HasSubstr("as in reference_points[0]"));
  EXPECT_THAT(mistake("cameras", {"camera9"}),
              HasSubstr("reference_points[1].cameras[0]: found \"camera9\""));
  EXPECT_THAT(mistake("colour", "red"), HasSubstr("reference_points[1].colour: found an unknown key"));
}

TEST(Cell, ReadsACorner) {
  const auto with_edges = [](const Json& edges) {
    Json json = example();
    json["jobs"][0]["marks"][2]["kind"] = "bright_corner";
    json["jobs"][0]["marks"][2]["edges"] = edges;
    return json;
  };
  const Json good = with_edges({{1, 0, 0}, {0, 0.6, 0.804}});
  const Mark mark = parse_cell({good.dump(), "", example_calibration_text(), ""}).jobs[0].marks[2];
  EXPECT_EQ(mark.kind, MarkKind::corner);
  EXPECT_TRUE(mark.bright);
  ASSERT_EQ(mark.edges_O.size(), 2U);
  EXPECT_NEAR(mark.edges_O[1].norm(), 1, 1e-12);
  for (const Json& edges : {Json({{1, 0, 0}}), Json({{1, 0, 0}, {0, 2, 0}}), Json({{1, 0, 0}, {-1, 0, 0}})})
    EXPECT_THAT(mistakes_in(with_edges(edges)),
                ElementsAre(HasSubstr("jobs[0].marks[2].edges: found no two")))
        << edges;
  Json reference = example();
  reference["reference_points"][1]["kind"] = "dark_corner";
  EXPECT_THAT(mistakes_in(reference), ElementsAre(HasSubstr("reference_points[1].kind: found a corner")));
}

class ExampleCell : public testing::TestWithParam<const char*> {};

TEST_P(ExampleCell, IsValid) {
  const Cell cell = load_cell(std::string(ZEROPOSE_SOURCE_DIR "/config/cells/") + GetParam() + ".json");
  EXPECT_EQ(cell.name, GetParam());
  EXPECT_TRUE(cell.simulated);
}

INSTANTIATE_TEST_SUITE_P(All, ExampleCell, testing::Values("car-body", "press-shop", "gun-check"));

TEST(Cell, ReadsTheOptionalKeys) {
  Json json = example();
  json["$schema"] = "../cell.schema.json";
  json["cameras"][0]["exposure_us"] = 2000;
  json["cameras"][0]["gain"] = 1.5;
  json["jobs"][0]["marks"][0]["tolerance_mm"] = 2;
  json["jobs"][0]["marks"][0]["sigma_mm"] = 0.1;
  json["jobs"][0]["requirements"]["max_displacement_mm"] = 45.5;
  json["jobs"][0]["requirements"]["max_step_mm"] = 30;
  json["jobs"][0]["requirements"]["max_step_deg"] = 0.25;
  json["robots"][0]["axis"] = {{"direction", {0, 1.002, 0}}, {"zero_mm", -250.5}};
  json["robots"][0]["require_command_crc"] = false;
  json["robots"][0]["allowed_writers"] = {"10.0.0.1"};
  json["robots"][0]["allowed_readers"] = {"10.0.0.2", "10.0.0.3"};
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  EXPECT_EQ(cell.cameras[0].exposure_us, 2000);
  EXPECT_EQ(cell.cameras[0].gain, 1.5);
  EXPECT_EQ(cell.jobs[0].marks[0].tolerance_mm, 2);
  EXPECT_EQ(cell.jobs[0].marks[0].sigma_mm, 0.1);
  EXPECT_EQ(cell.jobs[0].requirements.max_displacement_mm, 45.5);
  EXPECT_EQ(cell.jobs[0].requirements.max_step_mm, 30);
  EXPECT_EQ(cell.jobs[0].requirements.max_step_deg, 0.25);
  ASSERT_TRUE(cell.robots[0].axis);
  EXPECT_EQ(cell.robots[0].axis->direction_W, Eigen::Vector3d::UnitY());
  EXPECT_EQ(cell.robots[0].axis->zero_mm, -250.5);
  const ModbusTcpRobot& robot = std::get<ModbusTcpOptions>(cell.robots[0].link).robot;
  EXPECT_FALSE(robot.unit.require_command_crc);
  EXPECT_THAT(robot.allowed_writers, ElementsAre("10.0.0.1"));
  EXPECT_THAT(robot.allowed_readers, ElementsAre("10.0.0.2", "10.0.0.3"));
}

TEST(Cell, WithoutTheOptionalKeysNothingMoreIsChecked) {
  const Cell cell = load_cell(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.json");
  EXPECT_FALSE(cell.jobs[0].X_WP_planar);
  EXPECT_EQ(cell.jobs[0].requirements.max_displacement_mm, 0);
  EXPECT_EQ(cell.jobs[0].requirements.max_step_mm, 0);
  EXPECT_EQ(cell.jobs[0].requirements.max_step_deg, 0);
  EXPECT_FALSE(cell.robots[0].axis);
}

TEST(Cell, SheetNeedsTwoMarksAndLiesInItsPlane) {
  Json json = example();
  Json& job = json["jobs"][0];
  job["nominal_pose"] = {100, 200, 300, 0, 0, 10};
  job["planar"] = {0, 0, 300, 0, 0, -20};
  while (job["marks"].size() > 2) job["marks"].erase(job["marks"].size() - 1);
  job["requirements"]["min_marks"] = 2;
  job["requirements"]["min_cameras"] = 1;
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  ASSERT_TRUE(cell.jobs[0].X_WP_planar);
  EXPECT_NEAR(to_six_numbers(*cell.jobs[0].X_WP_planar).rz_deg, -20, 1e-12);
  EXPECT_EQ(least_marks(cell.jobs[0]), 2);
  job["marks"].erase(1);
  EXPECT_THAT(
      mistakes_in(json),
      testing::Contains(HasSubstr("jobs[0].marks: found an array of 1, expected an array of at least 2")));
  job.erase("planar");
  EXPECT_THAT(
      mistakes_in(json),
      testing::Contains(HasSubstr("jobs[0].marks: found an array of 1, expected an array of at least 3")));
}

TEST(Cell, MarkSeenByTwoCamerasHasTwoViews) {
  Json json = example();
  json["jobs"][0]["marks"][1]["cameras"] = {"camera4", "camera2"};
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  ASSERT_EQ(cell.jobs[0].views.size(), 13U);
  EXPECT_EQ(cell.jobs[0].views[1].camera, 3U);
  EXPECT_EQ(cell.jobs[0].views[2].camera, 1U);
  EXPECT_EQ(cell.jobs[0].views[2].mark, 1U);
}

struct Mistake {
  const char* pointer;
  const char* value;  // JSON
  const char* message;
};

class OneMistake : public testing::TestWithParam<Mistake> {};

// One value is changed: exactly one mistake, with path, found and expected.
TEST_P(OneMistake, IsNamed) {
  Json json = example();
  json[Json::json_pointer(GetParam().pointer)] = Json::parse(GetParam().value);
  EXPECT_THAT(mistakes_in(json), ElementsAre(std::string("cell.json: ") + GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Types, OneMistake,
    testing::Values(
        Mistake{"/name", "7", "name: found 7, expected a text of 1 to 200 printable characters"},
        Mistake{"/name", "\"\"", "name: found \"\", expected a text of 1 to 200 printable characters"},
        Mistake{"/name", "\"a\\nb\"",
                "name: found \"a\\nb\", expected a text of 1 to 200 printable characters"},
        Mistake{"/simulated", "1", "simulated: found 1, expected true or false"},
        Mistake{"/simulated", "null", "simulated: found null, expected true or false"},
        Mistake{"/cameras/1/width_px", "768.5",
                "cameras[1].width_px: found 768.5, expected an integer from 1 to 65535"},
        Mistake{"/cameras/1/width_px", "true",
                "cameras[1].width_px: found true, expected an integer from 1 to 65535"},
        Mistake{"/cameras/1/width_px", "\"768\"",
                "cameras[1].width_px: found \"768\", expected an integer from 1 to 65535"},
        Mistake{"/robots/0/link/port", "-1",
                "robots[0].link.port: found -1, expected an integer from 1 to 65535"},
        Mistake{"/robots/0/link/port", "65536",
                "robots[0].link.port: found 65536, expected an integer from 1 to 65535"},
        Mistake{"/robots/0/link/port", "18446744073709551615",
                "robots[0].link.port: found 18446744073709551615, expected an integer from 1 to 65535"},
        Mistake{"/jobs/0/search_mm", "true",
                "jobs[0].search_mm: found true, expected a number above 0 and at most 10000"},
        Mistake{"/jobs/0/search_mm", "0",
                "jobs[0].search_mm: found 0, expected a number above 0 and at most 10000"},
        Mistake{"/jobs/0/marks/3/weight", "1.01",
                "jobs[0].marks[3].weight: found 1.01, expected a number from 0 to 1"},
        Mistake{"/jobs/0/marks/3/weight", "-0.1",
                "jobs[0].marks[3].weight: found -0.1, expected a number from 0 to 1"},
        Mistake{"/jobs/0/marks/3/kind", "\"cross\"",
                "jobs[0].marks[3].kind: found \"cross\", expected one of dark_disc, bright_disc, dark_ring, "
                "bright_ring, dark_ball, bright_ball, dark_slot, bright_slot, dark_cross, bright_cross, "
                "dark_corner, "
                "bright_corner"},
        Mistake{"/jobs/0/marks/3/kind", "\"bright_corner\"",
                "jobs[0].marks[3].edges: found a corner without them, expected two unit vectors along the "
                "corner's edges, away from it, 15 to 165 degrees apart"},
        Mistake{"/jobs/0/marks/3/edges", "[[1, 0, 0], [0, 1, 0]]",
                "jobs[0].marks[3].edges: found a mark that is no corner, expected no such key"},
        Mistake{"/jobs/0/marks/3/kind", "\"bright_ring\"",
                "jobs[0].marks[3].inner_radius_mm: found a ring without it, expected the radius of the "
                "ring's inner "
                "circle, mm, below radius_mm"},
        Mistake{"/jobs/0/marks/3/inner_radius_mm", "4",
                "jobs[0].marks[3].inner_radius_mm: found a mark that is no ring, expected no such key"},
        Mistake{"/jobs/0/marks/3/position_mm", "[1, 2]",
                "jobs[0].marks[3].position_mm: found an array of 2, expected an array of 3 numbers"},
        Mistake{"/jobs/0/marks/3/position_mm", "[1, \"2\", 3]",
                "jobs[0].marks[3].position_mm[1]: found \"2\", expected a number from -1000000 to 1000000"},
        Mistake{"/jobs/0/nominal_pose", "[0, 0, 0, 0, 0, 361]",
                "jobs[0].nominal_pose[5]: found 361, expected a number from -360 to 360"},
        Mistake{"/jobs/0/marks/3", "4", "jobs[0].marks[3]: found 4, expected an object"},
        Mistake{"/jobs/0/limits", "[]", "jobs[0].limits: found an array of 0, expected an object"},
        Mistake{"/robots/0/link/type", "\"usb\"",
                "robots[0].link.type: found \"usb\", expected one of modbus-tcp, modbus-rtu, modbus-client, "
                "can"},
        Mistake{"/cameras/0/driver", "\"usb\"",
                "cameras[0].driver: found \"usb\", expected one of gige, v4l2, folder"},
        Mistake{"/timing/deadline_ms", "49",
                "timing.deadline_ms: found 49, expected an integer from 50 to 60000"}));

INSTANTIATE_TEST_SUITE_P(
    WhatMustFit, OneMistake,
    testing::Values(
        Mistake{"/cameras/1/address", "\"localhost\"",
                "cameras[1].address: found \"localhost\", expected an IPv4 address such as 192.168.10.11"},
        Mistake{"/cameras/1/address", "\"127.0.0.256\"",
                "cameras[1].address: found \"127.0.0.256\", expected an IPv4 address such as 192.168.10.11"},
        Mistake{"/cameras/1/address", "\"127.0.0.11\"",
                "cameras[1].address: found 127.0.0.11, as in cameras[0], expected another one for each"},
        Mistake{
            "/robots/0/allowed_writers", "[\"10.0.0.1\", \"host\"]",
            "robots[0].allowed_writers[1]: found \"host\", expected an IPv4 address such as 192.168.10.11"},
        Mistake{
            "/jobs/0/marks/1/name", "\"camera1/1\"",
            "jobs[0].marks[1].name: found \"camera1/1\", as in jobs[0].marks[0], expected another one for "
            "each"},
        Mistake{"/jobs/0/application_points/3/name", "\"rear left\"",
                "jobs[0].application_points[3].name: found \"rear left\", as in "
                "jobs[0].application_points[2], expected another one for each"},
        Mistake{"/jobs/0/marks/1/cameras", "[\"camera5\"]",
                "jobs[0].marks[1].cameras[0]: found \"camera5\", expected the name of a fixed camera of this "
                "cell, or of a position of this job"},
        Mistake{"/jobs/0/marks/1/cameras", "[\"camera1\", \"camera1\"]",
                "jobs[0].marks[1].cameras[1]: found \"camera1\" twice, expected each camera once"},
        Mistake{"/jobs/0/marks/1/cameras", "[]",
                "jobs[0].marks[1].cameras: found no camera, expected the name of a fixed camera of this "
                "cell, or of a position of this job"},
        Mistake{
            "/jobs/0/marks/1/normal", "[0, 0, 0.9]",
            "jobs[0].marks[1].normal: found a vector of length 0.900000, expected a unit vector (length 0.99 "
            "to 1.01)"},
        Mistake{"/jobs/0/limits/y_mm", "[40, -40]",
                "jobs[0].limits.y_mm: found [40, -40], expected an array [min, max] with min < max"},
        Mistake{"/jobs/0/limits/y_mm", "[0, 0]",
                "jobs[0].limits.y_mm: found [0, 0], expected an array [min, max] with min < max"},
        Mistake{"/jobs/0/requirements/min_marks", "2",
                "jobs[0].requirements.min_marks: found 2, expected at least 3; 2 suffice in a job that is "
                "planar"},
        Mistake{"/jobs/0/requirements/min_marks", "1",
                "jobs[0].requirements.min_marks: found 1, expected an integer from 2 to 10000"},
        Mistake{"/jobs/0/requirements/max_displacement_mm", "-1",
                "jobs[0].requirements.max_displacement_mm: found -1, expected a number from 0 to 10000"},
        Mistake{"/jobs/0/requirements/max_step_mm", "\"far\"",
                "jobs[0].requirements.max_step_mm: found \"far\", expected a number from 0 to 10000"},
        Mistake{"/jobs/0/requirements/max_step_deg", "181",
                "jobs[0].requirements.max_step_deg: found 181, expected a number from 0 to 180"},
        Mistake{
            "/jobs/0/planar", "[0, 0, 0, 0, 0]",
            "jobs[0].planar: found an array of 5, expected a pose [x, y, z, rx, ry, rz] in mm and degrees"},
        Mistake{"/jobs/0/planar", "[0, 0, 0.5, 0, 0, 30]",
                "jobs[0].nominal_pose: found a pose -0.500000 mm above the plane, tilted by 0.000000 deg, "
                "expected one that lies in the plane of planar (its z, rx and ry are 0 there)"},
        Mistake{"/jobs/0/planar", "[0, 0, 0, 0.01, 0, 30]",
                "jobs[0].nominal_pose: found a pose 0.000000 mm above the plane, tilted by 0.010000 deg, "
                "expected one that lies in the plane of planar (its z, rx and ry are 0 there)"},
        Mistake{"/robots/0/axis", "{\"direction\": [0.9, 0, 0], \"zero_mm\": 0}",
                "robots[0].axis.direction: found a vector of length 0.900000, expected a unit vector (length "
                "0.99 to 1.01)"},
        Mistake{"/robots/0/axis", "{\"direction\": [1, 0, 0]}",
                "robots[0].axis.zero_mm: found no such key, expected a number from -1000000 to 1000000"},
        Mistake{"/robots/0/axis", "[1, 0, 0]", "robots[0].axis: found an array of 3, expected an object"},
        Mistake{
            "/jobs/0/requirements/min_marks", "13",
            "jobs[0].requirements.min_marks: found 13, expected at most the 12 marks with a weight above 0"},
        Mistake{
            "/jobs/0/requirements/min_cameras", "5",
            "jobs[0].requirements.min_cameras: found 5, expected at most the 4 cameras that see marks with "
            "a weight above 0"},
        Mistake{"/jobs/0/application_points", "[]",
                "jobs[0].application_points: found an array of 0, expected an array of at least 1 objects"},
        Mistake{"/timing/zero_deadline_ms", "499",
                "timing.zero_deadline_ms: found 499, expected at least deadline_ms, 500"},
        Mistake{
            "/robots/0/allowed_readers", "[\"1.2.3\"]",
            "robots[0].allowed_readers[0]: found \"1.2.3\", expected an IPv4 address such as 192.168.10.11"},
        Mistake{"/robots/0/convention", "\"matrix\"",
                "robots[0].convention: found \"matrix\", expected one of generic, kuka, fanuc, yaskawa, "
                "mitsubishi, epson, kawasaki, comau, staubli, abb, universal-robots, denso, techman, adept, "
                "doosan"}));

INSTANTIATE_TEST_SUITE_P(
    UnknownKeys, OneMistake,
    testing::Values(Mistake{"/jobs/0/marks/3/radius", "3",
                            "jobs[0].marks[3].radius: found an unknown key, expected no key of this name"},
                    Mistake{
                        "/jobs/0/marks/3/tolerence_px", "3",
                        "jobs[0].marks[3].tolerence_px: found an unknown key, expected \"tolerance_px\"?"},
                    Mistake{"/robots/0/axis", R"({"direction": [1, 0, 0], "zero_mm": 0, "zero": 1})",
                            "robots[0].axis.zero: found an unknown key, expected no key of this name"},
                    Mistake{"/camera", "[]", "camera: found an unknown key, expected \"cameras\"?"},
                    Mistake{"/hmi", "{}", "hmi: found an unknown key, expected no key of this name"}));

TEST(Cell, TwoRobotsNeedTheirOwnPorts) {
  Json json = example();
  json["robots"].push_back(json["robots"][0]);
  json["robots"][1]["name"] = "robot2";
  EXPECT_THAT(
      mistakes_in(json),
      ElementsAre(
          "cell.json: robots[1].link.unit: found 127.0.0.1:1502 unit 1, as in robots[0].link, expected a "
          "port or a unit id of its own for each robot"));
  json["robots"][1]["link"]["address"] = "0.0.0.0";
  EXPECT_EQ(mistakes_in(json).size(), 1U);
  json["robots"][1]["link"]["address"] = "127.0.0.2";
  EXPECT_THAT(mistakes_in(json), IsEmpty());
  json["robots"][1]["link"]["address"] = "127.0.0.1";
  json["robots"][1]["link"]["port"] = 1503;
  EXPECT_THAT(mistakes_in(json), IsEmpty());
}

TEST(Cell, JobsAreToldApart) {
  Json json = example();
  json["jobs"].push_back(json["jobs"][0]);
  EXPECT_THAT(
      mistakes_in(json),
      ElementsAre("cell.json: jobs[1].name: found \"body\", as in jobs[0], expected another one for each",
                  "cell.json: jobs[1].number: found 1, as in jobs[0], expected another one for each"));
}

TEST(Cell, CamerasAreToldApart) {
  Json json = example();
  json["cameras"][3]["name"] = "camera1";
  EXPECT_THAT(mistakes_in(json),
              testing::Contains(HasSubstr("cameras[3].name: found \"camera1\", as in cameras[0]")));
}

TEST(Cell, ReaderMustNotBeAWriterToo) {
  Json json = example();
  json["robots"][0]["allowed_writers"] = {"10.0.0.1"};
  json["robots"][0]["allowed_readers"] = {"10.0.0.2", "10.0.0.1"};
  EXPECT_THAT(
      mistakes_in(json),
      ElementsAre("cell.json: robots[0].allowed_readers[1]: found \"10.0.0.1\", as in allowed_writers, "
                  "expected each address in one of the two lists"));
}

TEST(Cell, MarksOfWeightZeroDoNotCount) {
  Json json = example();
  for (int mark : {0, 1, 2}) json["jobs"][0]["marks"][static_cast<std::size_t>(mark)]["weight"] = 0;
  json["jobs"][0]["requirements"]["min_cameras"] = 4;
  json["jobs"][0]["requirements"]["min_marks"] = 10;
  json["jobs"][0]["requirements"]["min_marks_per_camera"] = 1;
  EXPECT_EQ(mistakes_in(json).size(), 3U);
}

TEST(Cell, AllMistakesAtOnce) {
  Json json = example();
  json["name"] = 1;
  json["cameras"][0].erase("address");
  json["jobs"][0]["marks"][11]["radius_mm"] = "wide";
  json["jobs"][0]["limits"]["rz_deg"] = {0.5};
  json["robots"][0]["colour"] = "orange";
  Json calibration = example_calibration();
  calibration["camera2"]["fx"] = 0;
  EXPECT_THAT(
      mistakes_in(json.dump(), calibration.dump()),
      UnorderedElementsAre(HasSubstr("cell.json: name: found 1"),
                           HasSubstr("cell.json: cameras[0].address: found nothing, expected"),
                           HasSubstr("cell.json: jobs[0].marks[11].radius_mm: found \"wide\""),
                           HasSubstr("cell.json: jobs[0].limits.rz_deg: found an array of 1"),
                           HasSubstr("cell.json: robots[0].colour: found an unknown key"),
                           HasSubstr("calibration.json: camera2.fx: found 0, expected a number above 0")));
}

TEST(Cell, ManyMistakesAreCounted) {
  Json json = example();
  json["cameras"] = Json::array();
  for (int i = 0; i < 500; ++i) json["cameras"].push_back(i);
  const std::vector<std::string> mistakes = mistakes_in(json);
  EXPECT_EQ(mistakes.size(), 101U);
  EXPECT_THAT(mistakes.back(), HasSubstr("mistakes more"));
}

TEST(Cell, CalibrationMustFitTheCameras) {
  const std::string cell = example_text();
  Json calibration = example_calibration();
  calibration.erase("camera3");
  EXPECT_THAT(
      mistakes_in(cell, calibration.dump()),
      ElementsAre("calibration.json: camera3: found no such key, expected the calibration of this camera "
                  "of the cell"));
  calibration = example_calibration();
  calibration["camera3"]["width"] = 767;
  EXPECT_THAT(
      mistakes_in(cell, calibration.dump()),
      ElementsAre("calibration.json: camera3: found 767 x 572 px, expected the camera's 768 x 572 px"));
  calibration = example_calibration();
  calibration["camera3"]["K"] = 500;
  EXPECT_THAT(
      mistakes_in(cell, calibration.dump()),
      ElementsAre(HasSubstr("calibration.json: camera3: found a lens model that gives no direction for a "
                            "corner of the image")));
}

TEST(Cell, CalibrationFollowsTheOrderOfTheCameras) {
  Json json = example();
  std::swap(json["cameras"][0], json["cameras"][3]);
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  EXPECT_EQ(cell.calibration[0].name, "camera4");
  EXPECT_EQ(cell.calibration[0].model.fx_px, example_calibration()["camera4"]["fx"].get<double>());
}

std::string load_error(const std::filesystem::path& path) {
  try {
    load_cell(path);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Cell, FilesThatCannotBeRead) {
  const TemporaryFolder directory;
  const std::string where = directory.path().string();
  EXPECT_THAT(load_error(directory.path() / "none.json"),
              HasSubstr(where + "/none.json: found no such file"));
  EXPECT_THAT(load_error(directory.path()), HasSubstr(where + ": found a directory"));
  EXPECT_THAT(load_error("/dev/null"), HasSubstr("found no regular file"));
  directory.write("cell.json", example_text());
  EXPECT_THAT(load_error(directory.path() / "cell.json"),
              HasSubstr(where + "/car-body.calibration.json: found no such file"));
  EXPECT_THAT(load_error(directory.write("empty.json", "")),
              HasSubstr("empty.json:1:1: found a syntax error"));
  EXPECT_THAT(load_error(directory.write("huge.json", example_text() + std::string(max_file_bytes, ' '))),
              HasSubstr("huge.json: found more than 16 MB"));
}

TEST(CellCameras, AllDriversWithAllTheirKeys) {
  Json json = example();
  json["cameras"][0].update(parsed(R"({"x_px": 8, "y_px": 4, "pixel_format": "mono12_packed",
    "trigger": "free_run", "frame_rate_hz": 25, "black_level": 4, "gamma": 1, "serial": "4711", "user_name": "left",
    "trigger_line": "Line2", "network": {"interface": "eth1", "packet_bytes": 8228, "packet_socket": "always",
    "resend": false, "ptp": true}})"));
  json["cameras"][1] = parsed(R"({"name": "camera2", "driver": "v4l2", "width_px": 768, "height_px": 572,
    "device": "/dev/video0", "input": 1, "fields": "bottom", "controls": [{"name": "Gain", "value": -3}]})");
  json["cameras"][2] = parsed(R"({"name": "camera3", "driver": "folder", "width_px": 768, "height_px": 572,
    "path": "pictures", "loop": false})");
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  const CameraOptions& gige = cell.cameras[0];
  EXPECT_EQ(gige.x_px, 8);
  EXPECT_EQ(gige.y_px, 4);
  EXPECT_EQ(gige.format, PixelFormat::mono12_packed);
  EXPECT_EQ(gige.trigger, TriggerSource::free_run);
  EXPECT_EQ(gige.frame_rate_hz, 25);
  EXPECT_EQ(gige.black_level, 4);
  EXPECT_EQ(gige.gamma, 1);
  EXPECT_EQ(gige.gige.serial, "4711");
  EXPECT_EQ(gige.gige.user_name, "left");
  EXPECT_EQ(gige.gige.trigger_line, "Line2");
  EXPECT_EQ(gige.gige.interface, "eth1");
  EXPECT_EQ(gige.gige.packet_bytes, 8228);
  EXPECT_EQ(gige.gige.packet_socket, PacketSocket::always);
  EXPECT_FALSE(gige.gige.resend);
  EXPECT_TRUE(gige.gige.ptp);
  const CameraOptions& v4l2 = cell.cameras[1];
  EXPECT_EQ(v4l2.driver, CameraDriver::v4l2);
  EXPECT_EQ(v4l2.v4l2.device, "/dev/video0");
  EXPECT_EQ(v4l2.v4l2.input, 1);
  EXPECT_EQ(v4l2.v4l2.fields, Fields::bottom);
  ASSERT_EQ(v4l2.v4l2.controls.size(), 1U);
  EXPECT_EQ(v4l2.v4l2.controls[0].name, "Gain");
  EXPECT_EQ(v4l2.v4l2.controls[0].value, -3);
  EXPECT_EQ(cell.cameras[2].folder.path, "pictures");
  EXPECT_FALSE(cell.cameras[2].folder.loop);
}

TEST(CellCameras, KeysOfAnotherDriverAreRefused) {
  Json json = example();
  json["cameras"][0]["device"] = "/dev/video0";
  json["cameras"][1]["driver"] = "folder";
  EXPECT_THAT(
      mistakes_in(json),
      ElementsAre(
          "cell.json: cameras[0].device: found a key of driver v4l2, expected no such key with driver gige",
          "cell.json: cameras[1].address: found a key of driver gige, expected no such key with driver "
          "folder",
          "cell.json: cameras[1].path: found nothing, expected a folder of pictures, relative to this "
          "file"));
}

TEST(CellCameras, SomethingMustSayWhichCameraItIs) {
  Json json = example();
  json["cameras"][0].erase("address");
  EXPECT_THAT(mistakes_in(json), ElementsAre(HasSubstr("cameras[0].address: found nothing")));
  json["cameras"][0]["serial"] = "4711";
  EXPECT_THAT(mistakes_in(json), IsEmpty());
  json["cameras"][1]["serial"] = "4711";
  EXPECT_THAT(mistakes_in(json), ElementsAre(HasSubstr("cameras[1].serial: found 4711, as in cameras[0]")));
}

}  // namespace
}  // namespace zeropose
