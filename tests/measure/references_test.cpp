// A camera that was moved is detected in one measurement, and one that stands still is not accused (spec 50
// M6.7, 85 R19).
#include "measure/references.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/measure/recalibration_scene.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Random;
using testing::HasSubstr;
using testing::Not;

constexpr double noise_px = 0.03;

// One camera with three reference points, 2 to 2.75 m away, or more of either.
class ReferenceScene {
 public:
  explicit ReferenceScene(std::size_t cameras = 1, double sigma_px = 0.02) {
    references_.sigma_px = sigma_px;
    for (std::size_t camera = 0; camera < cameras; ++camera) {
      cameras_.push_back({std::string("camera").append(std::to_string(camera + 1)),
                          test::long_lens(Division{-0.29}), Pose::Identity()});
      for (const auto& [u, v, z] :
           {std::array{110.0, 480.0, 2050.0}, {385.0, 120.0, 2400.0}, {660.0, 470.0, 2750.0}}) {
        ReferencePoint point;
        point.mark.name = std::string("R").append(std::to_string(references_.points.size() + 1));
        point.mark.p_O_mm = test::point_at("", u, v, z).p_Co_mm;
        references_.views.push_back({camera, references_.points.size()});
        references_.points.push_back(point);
      }
    }
  }

  std::vector<MarkFinding> see(Random& random, const Pose& X_CoCn = Pose::Identity()) const {
    std::vector<MarkFinding> findings;
    for (const View& view : references_.views) {
      MarkFinding& finding = findings.emplace_back();
      finding.status = MarkStatus::found;
      finding.u_px =
          test::photograph(cameras_[view.camera].model, view.camera == 0 ? X_CoCn : Pose::Identity(),
                           references_.points[view.mark].mark.p_O_mm) +
          Vector2d(test::normal(random, noise_px), test::normal(random, noise_px));
      finding.covariance_px2 = noise_px * noise_px * Eigen::Matrix2d::Identity();
    }
    return findings;
  }

  void take_zero(Random& random, int frames = 10) {
    std::vector<std::vector<MarkFinding>> all;
    for (int i = 0; i < frames; ++i) all.push_back(see(random));
    const ReferenceZero zero = average_references(references_, cameras_, all);
    ASSERT_EQ(zero.code, Code::ok) << zero.reason;
    zero_ = zero.references;
  }

  ReferenceCheck check(const std::vector<MarkFinding>& findings, const ReferenceTrend& trend = {}) const {
    return check_references({references_, cameras_, zero_, findings, trend});
  }

  References& references() { return references_; }
  const std::vector<CalibratedCamera>& cameras() const { return cameras_; }
  const std::vector<Observation>& zero() const { return zero_; }

 private:
  References references_;
  std::vector<CalibratedCamera> cameras_;
  std::vector<Observation> zero_;
};

// The least that has to be seen: 0.05 degrees or 0.5 mm across the optical axis.
std::vector<Pose> least_movements() {
  std::vector<Pose> movements;
  for (int k = 0; k < 8; ++k) {
    const double angle = k * std::numbers::pi / 4, c = std::cos(angle), s = std::sin(angle);
    movements.push_back(from_six_numbers({0.5 * c, 0.5 * s, 0, 0, 0, 0}));
    movements.push_back(from_six_numbers({0, 0, 0, 0.05 * c, 0.05 * s, 0}));
  }
  return movements;
}

TEST(References, LeastMovementsAreAllDetectedInOneMeasurement) {
  Random random(1);
  ReferenceScene scene(2);
  scene.take_zero(random);
  int checks = 0;
  for (int round = 0; round < 25; ++round)
    for (const Pose& X_CoCn : least_movements()) {
      const ReferenceCheck check = scene.check(scene.see(random, X_CoCn));
      ASSERT_EQ(check.code, Code::camera_moved) << to_six_numbers(X_CoCn).rx_deg;
      EXPECT_EQ(check.cameras[0].stand, CameraStand::moved);
      EXPECT_NE(check.cameras[1].stand, CameraStand::moved);
      EXPECT_THAT(check.reason, HasSubstr("camera1"));
      EXPECT_THAT(check.reason, Not(HasSubstr("camera2")));
      ++checks;
    }
  EXPECT_EQ(checks, 400);
}

// Of 20000 looks at a camera that stands still at most 0.1 % may accuse it, with a zero of its own for
// every 20.
TEST(References, CamerasThatStandStillAreNotAccused) {
  Random random(2);
  int accused = 0, suspected = 0, looks = 0;
  for (int zero = 0; zero < 1000; ++zero) {
    ReferenceScene scene(1, 0);  // nothing but the marks' own noise: the hardest case
    scene.take_zero(random);
    for (int i = 0; i < 20; ++i, ++looks) {
      const ReferenceCheck check = scene.check(scene.see(random));
      accused += check.code == Code::camera_moved;
      suspected += check.cameras[0].stand == CameraStand::suspicious;
    }
  }
  EXPECT_LE(accused, looks / 1000);
  EXPECT_EQ(suspected, 0);
}

// Chance may take a drifting camera for moved before its mean is noticed, but not often.
TEST(References, ASlowDriftMakesACameraSuspiciousBeforeItCountsAsMoved) {
  Random random(3);
  int suspicious = 0;
  constexpr int drifts = 60;
  for (int drift = 0; drift < drifts; ++drift) {
    ReferenceScene scene;
    scene.take_zero(random);
    ReferenceTrend trend, before;
    ReferenceCheck check;
    std::vector<MarkFinding> findings;
    for (int i = 0; i < 400 && (i == 0 || check.cameras[0].stand == CameraStand::ok); ++i) {
      findings = scene.see(random, from_six_numbers({0.0004 * i, 0, 0, 0, 0, 0}));
      before = trend;
      check = scene.check(findings, before);
      trend = check.trend;
    }
    if (check.cameras[0].stand != CameraStand::suspicious) continue;
    ++suspicious;
    EXPECT_EQ(check.code, Code::ok);
    scene.references().suspicious_blocks = true;
    EXPECT_EQ(scene.check(findings, before).code, Code::camera_suspicious);
  }
  EXPECT_GE(suspicious, drifts * 3 / 4);
}

TEST(References, MovementsWithinTheToleranceDoNotBlock) {
  Random random(4);
  ReferenceScene scene;
  scene.references().tolerance_px = 5;
  scene.take_zero(random);
  ReferenceCheck check = scene.check(scene.see(random, from_six_numbers({0, 0, 0, 0, 0.05, 0})));
  EXPECT_EQ(check.code, Code::ok);
  EXPECT_EQ(check.cameras[0].stand, CameraStand::suspicious);
  check = scene.check(scene.see(random, from_six_numbers({0, 0, 0, 0, 0.08, 0})));
  EXPECT_EQ(check.code, Code::camera_moved);
}

TEST(References, AKnockedReferenceIsNamed) {
  Random random(5);
  ReferenceScene scene;
  scene.take_zero(random);
  auto findings = scene.see(random);
  findings[1].u_px += Vector2d(2, 1);
  const ReferenceCheck check = scene.check(findings);
  EXPECT_EQ(check.code, Code::camera_moved);
  EXPECT_THAT(check.reason, HasSubstr("R2 may have been knocked itself"));
  const ReferenceCheck turned = scene.check(scene.see(random, from_six_numbers({0, 0, 0, 0, 0.05, 0})));
  EXPECT_THAT(turned.reason, Not(HasSubstr("knocked itself")));
}

TEST(References, ACameraThatSeesTooFewIsNamed) {
  Random random(6);
  ReferenceScene scene(2);
  scene.take_zero(random);
  auto findings = scene.see(random);
  findings[0].status = MarkStatus::no_candidate;
  EXPECT_EQ(scene.check(findings).code, Code::ok);
  findings[2].status = MarkStatus::no_candidate;
  const ReferenceCheck check = scene.check(findings);
  EXPECT_EQ(check.code, Code::reference_missing);
  EXPECT_THAT(check.reason, HasSubstr("camera1 sees 1 of its 3"));
  // Those of a camera that was not looked at do not count.
  findings = scene.see(random);
  for (std::size_t i = 0; i < 3; ++i) findings[i].status = MarkStatus::not_searched;
  EXPECT_EQ(scene.check(findings).code, Code::ok);
  EXPECT_EQ(scene.check(findings).cameras.size(), 1u);
}

TEST(References, ZeroNeedsEveryReferenceAndNoneThatWanders) {
  Random random(7);
  ReferenceScene scene;
  std::vector<std::vector<MarkFinding>> frames(6, scene.see(random));
  for (std::size_t i = 0; i < 3; ++i) frames[i][1].status = MarkStatus::no_candidate;
  const ReferenceZero missing = average_references(scene.references(), scene.cameras(), frames);
  EXPECT_EQ(missing.code, Code::reference_missing);
  EXPECT_THAT(missing.reason, HasSubstr("R2 in camera1"));
  frames.assign(6, scene.see(random));
  frames[4][2].u_px.x() += 3;
  EXPECT_EQ(average_references(scene.references(), scene.cameras(), frames).code,
            Code::deviation_not_attributable);
}

TEST(References, NothingToCheckIsOk) {
  const References none;
  EXPECT_EQ(check_references({none, {}, {}, {}, {}}).code, Code::ok);
}

}  // namespace
}  // namespace zeropose
