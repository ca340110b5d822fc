#include "sim/wrong_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "config/cameras.h"
#include "example_cells.h"
#include "sim/sim_file.h"

namespace zeropose {
namespace {

using test::cells;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// The errors of one camera in sigmas, in the order they are drawn.
Vector9 errors_of(const CalibratedCamera& wrong, const CalibratedCamera& truth,
                  const CalibrationErrors& sigma) {
  const Vector6 moved = difference(truth.X_WC, wrong.X_WC);
  Vector9 errors;
  errors << moved.head<3>() / sigma.position_mm, moved.tail<3>() * degrees_per_radian / sigma.rotation_deg,
      (wrong.model.fx_px / truth.model.fx_px - 1) / sigma.focal_length,
      (wrong.model.cx_px - truth.model.cx_px) / sigma.image_origin_px,
      (wrong.model.cy_px - truth.model.cy_px) / sigma.image_origin_px;
  return errors;
}

TEST(WrongCalibration, EveryErrorIsNormalWithItsSigma) {
  const auto truth = load_sim_file(cells + "car-body.sim.json").cameras;
  const CalibrationErrors sigma;
  constexpr int seeds = 1000;
  Vector9 sum = Vector9::Zero(), square = Vector9::Zero();
  Eigen::Matrix<double, 9, 9> product = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto wrong = wrong_calibration(truth, sigma, seed);
    for (std::size_t camera = 0; camera < truth.size(); ++camera) {
      const Vector9 errors = errors_of(wrong[camera], truth[camera], sigma);
      sum += errors;
      square += errors.cwiseAbs2();
      product += errors * errors.transpose();
    }
  }
  const double n = seeds * static_cast<double>(truth.size());
  product.diagonal().setZero();
  EXPECT_LT(sum.cwiseAbs().maxCoeff() / n, 5 / std::sqrt(n));                             // mean 0
  EXPECT_LT((square / n - Vector9::Ones()).cwiseAbs().maxCoeff(), 5 * std::sqrt(2 / n));  // variance 1
  EXPECT_LT(product.cwiseAbs().maxCoeff() / n, 5 / std::sqrt(n));                         // independent
}

TEST(WrongCalibration, FocalLengthsShareOneErrorAndTheRestStays) {
  const auto truth = load_sim_file(cells + "car-body.sim.json").cameras;
  const auto wrong = wrong_calibration(truth, {}, 3);
  ASSERT_EQ(wrong.size(), truth.size());
  for (std::size_t camera = 0; camera < truth.size(); ++camera) {
    const CameraModel &a = wrong[camera].model, &b = truth[camera].model;
    EXPECT_NEAR(a.fx_px / b.fx_px, a.fy_px / b.fy_px, 1e-15);
    EXPECT_NE(a.fx_px, b.fx_px);
    EXPECT_EQ(wrong[camera].name, truth[camera].name);
    EXPECT_EQ(a.width_px, b.width_px);
    EXPECT_EQ(std::get<Division>(a.distortion).K, std::get<Division>(b.distortion).K);
  }
}

TEST(WrongCalibration, TheSeedDecides) {
  const auto truth = load_sim_file(cells + "car-body.sim.json").cameras;
  EXPECT_EQ(wrong_calibration(truth, {}, 5)[2].model.cx_px, wrong_calibration(truth, {}, 5)[2].model.cx_px);
  EXPECT_NE(wrong_calibration(truth, {}, 5)[2].model.cx_px, wrong_calibration(truth, {}, 6)[2].model.cx_px);
}

TEST(WrongCalibration, NoSigmaNoError) {
  const auto truth = load_sim_file(cells + "car-body.sim.json").cameras;
  const CalibrationErrors none{0, 0, 0, 0};
  EXPECT_LT(difference(truth[0].X_WC, wrong_calibration(truth, none, 1)[0].X_WC).norm(), 1e-12);
}

class ExampleCell : public testing::TestWithParam<const char*> {};

// The file that the daemon believes.
TEST_P(ExampleCell, HasTheCalibrationOfSeedOne) {
  const auto wrong = wrong_calibration(load_sim_file(cells + GetParam() + ".sim.json").cameras, {}, 1);
  const auto believed = load_cameras(cells + GetParam() + ".calibration.json");
  ASSERT_EQ(believed.size(), wrong.size());
  for (std::size_t camera = 0; camera < wrong.size(); ++camera) {
    const CameraModel &a = believed[camera].model, &b = wrong[camera].model;
    EXPECT_EQ(believed[camera].name, wrong[camera].name);
    EXPECT_NEAR(a.fx_px, b.fx_px, 1e-9);
    EXPECT_NEAR(a.fy_px, b.fy_px, 1e-9);
    EXPECT_NEAR(a.cx_px, b.cx_px, 1e-9);
    EXPECT_NEAR(a.cy_px, b.cy_px, 1e-9);
    EXPECT_EQ(std::get<Division>(a.distortion).K, std::get<Division>(b.distortion).K);
    const Vector6 apart = difference(believed[camera].X_WC, wrong[camera].X_WC);
    EXPECT_LT(apart.head<3>().norm(), 1e-8);
    EXPECT_LT(apart.tail<3>().norm(), 1e-11);
  }
}

TEST_P(ExampleCell, SaysWhatItsCalibrationIs) {
  std::ifstream file(cells + GetParam() + ".calibration.json");
  std::string first_line;
  std::getline(file, first_line);
  EXPECT_TRUE(first_line.starts_with("//")) << first_line;
  EXPECT_NE(first_line.find("seed 1"), std::string::npos) << first_line;
}

INSTANTIATE_TEST_SUITE_P(All, ExampleCell,
                         testing::Values("car-body", "press-shop", "gun-check", "pane-gaps"));

}  // namespace
}  // namespace zeropose
