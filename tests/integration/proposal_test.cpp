// What the daemon proposes for a camera that was knocked, from rendered pictures of the car body (spec 60).
#include "measure/proposal.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>

#include "tests/support/rendered_example.h"

namespace zeropose {
namespace {

using test::RenderedExample;

// At the worst application point: what 30 good cars of this cell stay below is 0.11 mm (docs/cells.md), and a
// camera that was found again adds its own.
constexpr double good_mm = 0.2;
constexpr double chi_square_6_at_0_001 = 22.46;

const Pose part = from_six_numbers({5, -8, 3, 0.1, -0.05, 0.08});  // X_O0O

// One measurement of a part that stands at `part` while cameras are moved.
struct Knocked {
  explicit Knocked(const Faults& faults, References references_used)
      : zero(example.zero(example.believed()).zero),
        references(std::move(references_used)),
        clean(example.clean(example.zero_pose() * part, faults)),
        exposed(example.exposed(clean)),
        problem{exposed.images(), example.job(), example.believed(), zero, {}, &references},
        measurement(measure(problem)),
        proposal(propose(problem, measurement)) {}
  explicit Knocked(const Faults& faults) : Knocked(faults, RenderedExample("car-body").references()) {}

  RenderedExample example{"car-body"};
  Zero zero;
  References references;
  std::vector<test::CleanPicture> clean;
  test::Exposed exposed;
  MeasurementProblem problem;
  Measurement measurement;
  Proposal proposal;
};

double point_error_mm(const Knocked& knocked, const Measurement& measurement) {
  return test::worst_point_mm(knocked.example.job(), measurement.X_O0O, part);
}

TEST(Proposal, OfACameraThatStandsIsNone) {
  const Knocked knocked(Faults{});
  ASSERT_EQ(knocked.measurement.code, Code::ok) << knocked.measurement.reason;
  EXPECT_TRUE(knocked.proposal.cameras.empty());
  EXPECT_FALSE(knocked.proposal.proposed);
}

TEST(Proposal, PutsAKnockedCameraWhereItIs) {
  Faults faults;
  faults.moved_cameras["camera2"] = from_six_numbers({0.3, -0.2, 0.4, 0.05, -0.03, 0.02});
  const Knocked knocked(faults);
  ASSERT_EQ(knocked.measurement.code, Code::camera_moved);
  ASSERT_EQ(knocked.proposal.cameras.size(), 1u);
  const CameraProposal& camera = knocked.proposal.cameras.front();
  EXPECT_EQ(camera.camera, 1u);
  EXPECT_EQ(camera.method, RecalibrationMethod::known_points);
  EXPECT_EQ(camera.points.size(), 3u);
  ASSERT_EQ(camera.result.code, Code::ok) << camera.result.reason;
  ASSERT_TRUE(knocked.proposal.proposed);
  ASSERT_EQ(knocked.proposal.proposed->code, Code::ok) << knocked.proposal.proposed->reason;
  EXPECT_LT(point_error_mm(knocked, *knocked.proposal.proposed), good_mm);
  // The noise of the references says how well the change is known; the calibration's errors cancel.
  const Vector6 error = difference(faults.moved_cameras["camera2"], *camera.X_CoCn);
  EXPECT_LT(error.dot(camera.result.change_covariance.ldlt().solve(error)), chi_square_6_at_0_001);
}

TEST(Proposal, OfTwoCamerasTakesBothIntoTheEffect) {
  Faults faults;
  faults.moved_cameras["camera1"] = from_six_numbers({0, 0, 0, 0.04, 0, 0});
  faults.moved_cameras["camera4"] = from_six_numbers({0, 0.8, 0, 0, 0, 0});
  const Knocked knocked(faults);
  ASSERT_EQ(knocked.proposal.cameras.size(), 2u);
  EXPECT_EQ(knocked.proposal.cameras[0].camera, 0u);
  EXPECT_EQ(knocked.proposal.cameras[1].camera, 3u);
  ASSERT_TRUE(knocked.proposal.proposed);
  ASSERT_EQ(knocked.proposal.proposed->code, Code::ok) << knocked.proposal.proposed->reason;
  EXPECT_NE(knocked.proposal.believed.code, Code::ok);
  EXPECT_LT(point_error_mm(knocked, *knocked.proposal.proposed), good_mm);
}

// Points without coordinates tell the turn; what was a shift is warned of.
TEST(Proposal, WithoutCoordinatesIsTheTurnAlone) {
  References references = RenderedExample("car-body").references();
  for (ReferencePoint& point : references.points) point.taught_px = Eigen::Vector2d::Zero();
  Faults faults;
  faults.moved_cameras["camera2"] = from_six_numbers({0, 0, 0, 0.05, 0, 0});
  const Knocked knocked(faults, references);
  ASSERT_EQ(knocked.proposal.cameras.size(), 1u);
  const CameraProposal& camera = knocked.proposal.cameras.front();
  EXPECT_EQ(camera.method, RecalibrationMethod::arbitrary_points);
  ASSERT_EQ(camera.result.code, Code::ok) << camera.result.reason;
  EXPECT_FALSE(camera.result.translation_known);
  const double turned_deg = degrees_per_radian * log_so3(camera.result.X_CoCn.linear()).norm();
  EXPECT_NEAR(turned_deg, 0.05, 0.005);
}

// A camera that sees too little of its points to be found again is proposed nothing, with the reason.
TEST(Proposal, WithoutEnoughPointsSaysWhy) {
  Faults faults;
  faults.moved_cameras["camera2"] = from_six_numbers({0, 0, 0, 0.05, 0, 0});
  faults.covered = {"camera2/R1"};
  const Knocked knocked(faults);
  ASSERT_EQ(knocked.measurement.code, Code::camera_moved) << knocked.measurement.reason;
  ASSERT_EQ(knocked.proposal.cameras.size(), 1u);
  EXPECT_EQ(knocked.proposal.cameras.front().result.code, Code::too_few_marks);
  EXPECT_FALSE(knocked.proposal.cameras.front().result.reason.empty());
  EXPECT_FALSE(knocked.proposal.proposed);
}

TEST(Proposal, TakesTheMethodThatThePointsAllow) {
  References references;
  const auto add = [&](int count, const std::string& group, bool taught) {
    for (int i = 0; i < count; ++i) {
      ReferencePoint point;
      point.group = group;
      if (taught) point.taught_px = Eigen::Vector2d::Zero();
      references.views.push_back({0, references.points.size()});
      references.points.push_back(point);
    }
  };
  add(2, "", false), add(3, "", true);
  EXPECT_EQ(suited_method(references, 0), RecalibrationMethod::arbitrary_points);
  add(1, "", false);
  EXPECT_EQ(suited_method(references, 0), RecalibrationMethod::known_points);
  EXPECT_EQ(suited_method(references, 1), RecalibrationMethod::arbitrary_points);
  add(3, "near", false), add(2, "far", false);
  EXPECT_EQ(suited_method(references, 0), RecalibrationMethod::known_points);
  add(1, "far", false);
  EXPECT_EQ(suited_method(references, 0), RecalibrationMethod::groups);
}

}  // namespace
}  // namespace zeropose
