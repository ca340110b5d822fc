#include "calib/held_values.h"

namespace zeropose {

CameraModel with_held_values(const CalibrationProblem& problem, CameraModel model,
                             const Eigen::Vector2d& origin_px) {
  if (problem.lens == LensModel::brown) {
    const double K = std::get<Division>(model.distortion).K;
    // (E2) to fourth order: 1 + K r^2 + 2 K^2 r^4.
    model.distortion = BrownConrady{K, 2 * K * K, 0, 0, 0};
  }
  const auto hold = [&](Parameter parameter, double& value, double start) {
    if (problem.fixed.has(parameter)) value = start;
  };
  const CameraModel start = problem.start ? problem.start->model : CameraModel{};
  if (auto* lens = std::get_if<Division>(&model.distortion))
    hold(Parameter::K, lens->K, problem.start ? std::get<Division>(start.distortion).K : 0);
  if (auto* lens = std::get_if<BrownConrady>(&model.distortion)) {
    const BrownConrady held = problem.start ? std::get<BrownConrady>(start.distortion) : BrownConrady{};
    hold(Parameter::k1, lens->k1, held.k1);
    hold(Parameter::k2, lens->k2, held.k2);
    hold(Parameter::p1, lens->p1, held.p1);
    hold(Parameter::p2, lens->p2, held.p2);
    hold(Parameter::k3, lens->k3, held.k3);
  }
  hold(Parameter::cx, model.cx_px, origin_px.x());
  hold(Parameter::cy, model.cy_px, origin_px.y());
  hold(Parameter::fx, model.fx_px, start.fx_px);
  hold(Parameter::fy, model.fy_px, start.fy_px);
  return model;
}

Pose with_held_pose(const CalibrationProblem& problem, const Pose& X_WC) {
  if (!problem.start || !problem.start->X_WC) return X_WC;
  const SixNumbers held = to_six_numbers(*problem.start->X_WC);
  SixNumbers six = to_six_numbers(X_WC);
  const auto hold = [&](Parameter parameter, double& value, double start) {
    if (problem.fixed.has(parameter)) value = start;
  };
  hold(Parameter::x, six.x_mm, held.x_mm);
  hold(Parameter::y, six.y_mm, held.y_mm);
  hold(Parameter::z, six.z_mm, held.z_mm);
  hold(Parameter::rx, six.rx_deg, held.rx_deg);
  hold(Parameter::ry, six.ry_deg, held.ry_deg);
  hold(Parameter::rz, six.rz_deg, held.rz_deg);
  return from_six_numbers(six);
}

}  // namespace zeropose
