// What a knock did, from more points than it takes (spec 60): the pictures are not looked at here.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "measure/proposal.h"
#include "tests/measure/recalibration_scene.h"
#include "tests/support/synthetic_camera.h"

namespace zeropose {
namespace {

using Eigen::Vector2d;
using test::Random;

constexpr double noise_px = 0.03, few_px = 0.005;  // of a finding, and of the mean of the zero measurement

// Five points whose coordinates are wrong by this much.
class KnockedPoints {
 public:
  KnockedPoints(double coordinates_sigma_mm, const Pose& X_CoCn, Random& random) {
    const CameraModel model = test::long_lens(Division{-0.29});
    cameras_.push_back({"camera1", model, Pose::Identity()});
    CameraCheck& check = measurement_.references.cameras.emplace_back();
    check.stand = CameraStand::moved;
    for (const auto& [u, v, z] : {std::array{110.0, 480.0, 2050.0},
                                  {385.0, 120.0, 2400.0},
                                  {660.0, 470.0, 2750.0},
                                  {620.0, 90.0, 2100.0},
                                  {150.0, 110.0, 2900.0}}) {
      const Eigen::Vector3d p_W_mm = test::point_at("", u, v, z).p_Co_mm;
      ReferencePoint point;
      point.mark.name = std::string("R").append(std::to_string(references_.points.size() + 1));
      for (int i = 0; i < 3; ++i)
        point.mark.p_O_mm[i] = p_W_mm[i] + test::normal(random, coordinates_sigma_mm);
      references_.views.push_back({0, references_.points.size()});
      zero_.references.push_back({0, references_.points.size(),
                                  test::photograph(model, Pose::Identity(), p_W_mm) + noise(random, few_px),
                                  few_px * few_px * Eigen::Matrix2d::Identity()});
      MarkFinding& now = measurement_.reference_findings.emplace_back();
      now.status = MarkStatus::found;
      now.u_px = test::photograph(model, X_CoCn, p_W_mm) + noise(random, noise_px);
      now.covariance_px2 = noise_px * noise_px * Eigen::Matrix2d::Identity();
      references_.points.push_back(point);
    }
  }

  CameraProposal proposed() const {
    const Proposal proposal = propose({{}, job_, cameras_, zero_, {}, &references_}, measurement_);
    EXPECT_EQ(proposal.cameras.size(), 1u);
    return proposal.cameras.front();
  }
  References& references() { return references_; }

 private:
  static Vector2d noise(Random& random, double sigma_px) {
    return {test::normal(random, sigma_px), test::normal(random, sigma_px)};
  }

  Job job_;
  References references_;
  std::vector<CalibratedCamera> cameras_;
  Zero zero_;
  Measurement measurement_;
};

// The mean square of 300 errors in units of what the noise of the pixels alone does to a change.
double mean_square(double coordinates_sigma_mm) {
  Random random(3);
  const Pose X_CoCn = from_six_numbers({0.4, -0.3, 0.5, 0.05, -0.04, 0.03});
  double sum = 0;
  constexpr int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    const KnockedPoints points(coordinates_sigma_mm, X_CoCn, random);
    const CameraProposal proposal = points.proposed();
    EXPECT_EQ(proposal.method, RecalibrationMethod::known_points);
    EXPECT_TRUE(proposal.X_CoCn) << proposal.reason;
    if (!proposal.X_CoCn) return 1e9;
    // Of pixels with the noise of both pictures, in place of the residuals and of light and warmth (0.05 px).
    const double sigma_px = proposal.result.sigma_px;
    const Matrix6 covariance = (noise_px * noise_px + few_px * few_px) / (noise_px * noise_px + 0.05 * 0.05) /
                               (sigma_px * sigma_px) * proposal.result.change_covariance;
    const Vector6 error = difference(X_CoCn, *proposal.X_CoCn);
    sum += error.dot(covariance.ldlt().solve(error));
  }
  return sum / trials;
}

TEST(ProposedChange, IsFreeOfWhatIsWrongWithTheCoordinates) {
  const double four_sigma = 4 * std::sqrt(2 * 6.0 / 300);
  EXPECT_NEAR(mean_square(0), 6, four_sigma);
  EXPECT_NEAR(mean_square(0.05), 6, four_sigma);
}

TEST(ProposedChange, WithoutAnAnswerHasAReason) {
  Random random(4);
  KnockedPoints points(0, from_six_numbers({0, 0, 0, 0.05, 0, 0}), random);
  for (ReferencePoint& point : points.references().points) point.mark.p_O_mm = {0, 0, 2000};
  const CameraProposal proposal = points.proposed();
  EXPECT_FALSE(proposal.X_CoCn);
  EXPECT_FALSE(proposal.reason.empty());
}

TEST(ProposedChange, TakesOnlyPointsThatTheMethodCanUse) {
  ReferencePoint known, plate, taught;
  plate.group = "near";
  taught.taught_px = Vector2d::Zero();
  EXPECT_TRUE(counts_for(RecalibrationMethod::known_points, known));
  EXPECT_TRUE(counts_for(RecalibrationMethod::known_points, plate));
  EXPECT_FALSE(counts_for(RecalibrationMethod::known_points, taught));
  EXPECT_FALSE(counts_for(RecalibrationMethod::groups, known));
  EXPECT_TRUE(counts_for(RecalibrationMethod::groups, plate));
  EXPECT_TRUE(counts_for(RecalibrationMethod::arbitrary_points, taught));
  EXPECT_TRUE(counts_for(RecalibrationMethod::arbitrary_points, known));
}

}  // namespace
}  // namespace zeropose
