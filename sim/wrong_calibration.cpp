#include "sim/wrong_calibration.h"

#include "sim/random.h"

namespace zeropose {
namespace {

CalibratedCamera with_errors(CalibratedCamera camera, const CalibrationErrors& sigma, Random& random) {
  Vector6 delta;
  for (int axis = 0; axis < 3; ++axis) delta(axis) = sigma.position_mm * random.normal();
  for (int axis = 3; axis < 6; ++axis)
    delta(axis) = sigma.rotation_deg / degrees_per_radian * random.normal();
  camera.X_WC = moved(camera.X_WC, delta);
  const double focal_factor = 1 + sigma.focal_length * random.normal();
  camera.model.fx_px *= focal_factor;
  camera.model.fy_px *= focal_factor;
  camera.model.cx_px += sigma.image_origin_px * random.normal();
  camera.model.cy_px += sigma.image_origin_px * random.normal();
  return camera;
}

}  // namespace

std::vector<CalibratedCamera> wrong_calibration(std::span<const CalibratedCamera> truth,
                                                const CalibrationErrors& sigma, std::uint64_t seed) {
  Random random(seed);
  std::vector<CalibratedCamera> wrong;
  wrong.reserve(truth.size());
  for (const CalibratedCamera& camera : truth) wrong.push_back(with_errors(camera, sigma, random));
  return wrong;
}

}  // namespace zeropose
