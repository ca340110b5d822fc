// The page of a calibration report: well-formed, complete, and the shapes where they belong.
#include "config/calibration_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/calibration_rows.h"
#include "config/svg.h"

namespace zeropose {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Example {
  std::vector<CalibrationPoint> points;
  CalibrationProblem problem;
  CalibrationResult result;

  explicit Example(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      CalibrationPoint point;
      point.u_px = {10.0 + static_cast<double>(i * 137 % 780), 10.0 + static_cast<double>(i * 211 % 580)};
      points.push_back(point);
      result.deviations.push_back(
          {{0.125, -0.25}, {0.05, -0.1}, 800.0 + static_cast<double>(i % 100), i != 4});
    }
    problem.points = points;
    problem.width_px = 800;
    problem.height_px = 600;
    result.status = CalibrationStatus::ok;
    result.model = {800, 600, 2000.5, 1999.25, 390, 310, Division{-0.2}};
    result.X_WC = from_six_numbers({1, 2, 3, 10, 20, 30});
    result.rms_px = 0.28;
    result.uncertainty = {{Parameter::fx, Parameter::cx, Parameter::cy},
                          Eigen::Vector3d(4, 1, 1).asDiagonal()};
    result.steps = {{"C2 non-coplanar", "first & <foremost>", 0.5}};
    result.diagnosis.warnings = {"a warning \"in quotes\""};
  }
  CalibrationReport report() const { return {problem, result, "left <1>", "points.csv", 0.005, 0, {}}; }
};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// Elements open and close in order and text is escaped: enough XML for this writer.
void expect_well_formed(const std::string& svg) {
  std::vector<std::string> open;
  std::size_t at = svg.find("<svg");
  ASSERT_NE(at, std::string::npos);
  while (at != std::string::npos) {
    const std::size_t end = svg.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = svg.substr(at + 1, end - at - 1);
    EXPECT_EQ(tag.find('<'), std::string::npos) << tag;
    EXPECT_EQ(count_of(tag, "\"") % 2, 0u) << tag;
    if (tag.front() == '/') {
      ASSERT_FALSE(open.empty());
      EXPECT_EQ(tag.substr(1), open.back());
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(tag.substr(0, tag.find(' ')));
    }
    at = svg.find('<', end);
  }
  EXPECT_TRUE(open.empty());
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf\""), std::string::npos);
}

TEST(CalibrationPage, ShowsWhatAReportMustShow) {
  const Example example(30);
  const std::string page = calibration_page(example.report());
  expect_well_formed(page);
  for (const char* part :
       {"left &lt;1&gt;", "2000.500", "1 sigma", ">2.000<", "focal length f", "9.996 mm", "Histogram",
        "Depth of the points", "Deviations over the image", "Used points per cell",
        "first &amp; &lt;foremost&gt;", "a warning &quot;in quotes&quot;", "29 of 30 points used",
        "None was given to compare with", "rejected", "Usable"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_EQ(count_of(page, "href"), 0u);  // no other file
  // Every point: one dot; the rejected one: one ring, and red in the list.
  EXPECT_EQ(count_of(page, "r=\"0.450\""), 30u);
  EXPECT_EQ(count_of(page, "r=\"1.500\""), 1u);
}

TEST(CalibrationPage, AgainstTheActiveCalibration) {
  const Example example(30);
  CalibrationReport report = example.report();
  report.active = CalibratedCamera{"left", example.result.model, example.result.X_WC};
  report.active->model.fx_px = 1998.0;
  const std::string page = calibration_page(report);
  expect_well_formed(page);
  for (const char* part : {"difference", "1998.000", "top left", "with pose", "camera turned"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, Not(HasSubstr("None was given")));
}

TEST(CalibrationPage, OfVeryManyPointsTheWorstAreListed) {
  const Example example(2500);
  const std::string page = calibration_page(example.report());
  expect_well_formed(page);
  EXPECT_THAT(page, HasSubstr("the 1000 worst points"));
}

TEST(CalibrationPage, NoPointsAndNoNoise) {
  Example perfect(10);
  for (auto& deviation : perfect.result.deviations) deviation.dev_px.setZero();
  expect_well_formed(calibration_page(perfect.report()));
  Example unused(10);
  for (auto& deviation : unused.result.deviations) deviation.used = false;
  expect_well_formed(calibration_page(unused.report()));
}

TEST(CalibrationRows, DifferencesOnlyWhereTheModelIsTheSame) {
  const Example example(5);
  CalibratedCamera active{"", example.result.model, example.result.X_WC};
  active.model.distortion = BrownConrady{0.1, 0, 0, 0, 0};
  const auto rows = parameter_rows(example.result, 50, active);
  ASSERT_EQ(rows.size(), 11u);  // fx fy cx cy K and six
  EXPECT_EQ(rows[4].parameter, Parameter::K);
  EXPECT_FALSE(rows[4].active);
  EXPECT_EQ(rows[0].sigma, 2);
  EXPECT_EQ(rows[1].sigma, -1);
  // The frame moved by 50 mm along the camera's z axis, in both.
  const Eigen::Vector3d wanted = example.result.X_WC * Eigen::Vector3d(0, 0, 50);
  EXPECT_NEAR(rows[5].value, wanted.x(), 1e-9);
  EXPECT_NEAR(*rows[5].active, wanted.x(), 1e-9);
}

TEST(Svg, Numbers) {
  EXPECT_EQ(fixed_text(-0.0001, 2), "0.00");
  EXPECT_EQ(fixed_text(-0.006, 2), "-0.01");
  EXPECT_EQ(fixed_text(1234.5, 1), "1234.5");
}

}  // namespace
}  // namespace zeropose
