// The page of a calibration report: well-formed, complete, and the shapes where they belong.
#include "config/calibration_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "config/calibration_rows.h"
#include "config/fit_page.h"
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
  CalibrationReport report() const {
    return {problem, result, "left <1>", "points.csv", 0.005, 0, {}, 0, "X_WC"};
  }
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

TEST(CalibrationPage, TheOutlineStaysInItsPlot) {
  Example example(30);
  example.points[0].u_px = {-400, 900};  // far outside of the image
  const std::string page = calibration_page(example.report());
  const std::size_t outline = page.find("<polygon", page.find("Used points per cell"));
  ASSERT_NE(outline, std::string::npos);
  EXPECT_GT(page.rfind("<g clip-path", outline), page.find("Used points per cell"));
}

FitReport fit_example() {
  FitReport report;
  report.title = "A fit <1>";
  report.summary = "2 of 3 touches";
  report.findings = {{Quality::good, "redundancy & more"}};
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal() << 0.04, 0.04, 0.04, 1e-4, 1e-4, 1e-4;
  report.result = {"X_HC",
                   pose_rows(from_six_numbers({1, 2, 3, 10, 20, 179.5}), covariance,
                             from_six_numbers({1, 2, 2.5, 10, 20, -179.5})),
                   "a note"};
  report.beside = {"p_RT", place_rows({7, 8, 9}, Eigen::Matrix3d::Identity()), ""};
  report.facts = {{"a figure", "0.125 mm"}};
  report.errors = {{"Errors, mm", {{"one", 0.1, true}, {"two", 0.2, true}, {"three", 25, false}}}};
  const std::vector<Pose> X_RH = {from_six_numbers({0, 0, 0, 10, 0, 0}),
                                  from_six_numbers({0, 0, 0, -10, 0, 0}),
                                  from_six_numbers({0, 0, 0, 0, 0, 0})};
  const std::vector<std::size_t> unused = {2};
  report.turns = hand_turns(X_RH, unused);
  report.list = {
      "Touches", "", {{"name", 0, true}, {"mm", 40}}, {{{"one", "0.1"}, true}, {{"three", "25"}, false}},
      1,         182};
  add_warnings(report, {"a warning \"in quotes\""});
  return report;
}

TEST(FitPage, ShowsWhatItIsGiven) {
  const Example example(30);
  FitReport report = fit_example();
  report.images = {{"left", example.result.model, example.points, example.result.deviations, {}}};
  const std::string page = fit_page(report);
  expect_well_formed(page);
  for (const char* part : {"A fit &lt;1&gt;", "2 of 3 touches", "redundancy &amp; more", "a note", ">0.200<",
                           ">0.5730<", ">0.500<", ">-1.0000<", "a figure", "Errors, mm", ">three<", ">25.0",
                           "Turns of the hand", "a warning &quot;in quotes&quot;", "Camera left",
                           "Deviations over the image", "Used points per cell", "Coverage"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_EQ(count_of(page, "r=\"0.450\""), 30u);  // a dot per point
  // What is warned of comes first and gives the banner its colour.
  EXPECT_LT(page.find("a warning"), page.find("redundancy"));
  EXPECT_THAT(page, HasSubstr("fill=\"#b26a00\" text-anchor=\"start\" font-weight=\"bold\">2 of 3"));
}

TEST(FitPage, PlotsAreNotCutByTheEndOfAPage) {
  const Example example(30);
  for (const int touches : {1, 10, 20, 30, 40, 60}) {
    FitReport report = fit_example();
    report.list.rows.assign(static_cast<std::size_t>(touches), {{"one", "0.1"}, true});
    report.images = {{"", example.result.model, example.points, example.result.deviations, {}}};
    const std::string page = fit_page(report);
    const std::string title = ">Deviations over the image";
    const std::size_t at = page.rfind(" y=\"", page.find(title));
    ASSERT_NE(at, std::string::npos);
    const double y = std::stod(page.substr(at + 4)), on_page = std::fmod(y, 297.0);
    EXPECT_LE(on_page + 2 + 69 + 7, 297.0) << touches;  // 800 x 600 px in 92 mm, the axis below
    EXPECT_GE(on_page, 14) << touches;
  }
}

TEST(FitPage, OnlyWhatIsThere) {
  FitReport report;
  report.title = "Nothing";
  const std::string page = fit_page(report);
  expect_well_formed(page);
  for (const char* part : {"Turns", "Deviations", "Coverage", "Figures"})
    EXPECT_THAT(page, Not(HasSubstr(part)));
}

TEST(FitPage, TurnsAreFromTheMeanAboutTheHand) {
  std::vector<Pose> X_RH;
  for (const double rx_deg : {-30., 0., 30.})
    X_RH.push_back(from_six_numbers({1, 2, 3, 0, 0, 40}) * from_six_numbers({0, 0, 0, rx_deg, 0, 0}));
  const std::vector<std::size_t> unused = {1};
  const auto turns = hand_turns(X_RH, unused);
  ASSERT_EQ(turns.size(), 3u);
  EXPECT_NEAR(turns[0].about_H_deg.x(), -30, 1e-9);
  EXPECT_NEAR(turns[2].about_H_deg.x(), 30, 1e-9);
  EXPECT_NEAR(turns[2].about_H_deg.tail<2>().norm(), 0, 1e-9);
  EXPECT_FALSE(turns[1].used);
}

TEST(CalibrationRows, AnglesDifferTheShortWay) {
  Example example(5);
  example.result.X_WC = from_six_numbers({0, 0, 0, 179.5, 0, 0});
  const CalibratedCamera active{"", example.result.model, from_six_numbers({0, 0, 0, -179.5, 0, 0})};
  const auto rows = parameter_rows(example.result, 0, active);
  EXPECT_NEAR(rows[8].difference, -1, 1e-9);
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
