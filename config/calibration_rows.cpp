#include "config/calibration_rows.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

std::optional<double> internal_value(const CameraModel& model, Parameter parameter) {
  const auto* division = std::get_if<Division>(&model.distortion);
  const auto* brown = std::get_if<BrownConrady>(&model.distortion);
  switch (parameter) {
    case Parameter::fx:
      return model.fx_px;
    case Parameter::fy:
      return model.fy_px;
    case Parameter::cx:
      return model.cx_px;
    case Parameter::cy:
      return model.cy_px;
    case Parameter::K:
      return division != nullptr ? std::optional(division->K) : std::nullopt;
    default:
      break;
  }
  if (brown == nullptr) return std::nullopt;
  switch (parameter) {
    case Parameter::k1:
      return brown->k1;
    case Parameter::k2:
      return brown->k2;
    case Parameter::p1:
      return brown->p1;
    case Parameter::p2:
      return brown->p2;
    case Parameter::k3:
      return brown->k3;
    default:
      return std::nullopt;
  }
}

std::optional<double> value_of(const CameraModel& model, const SixNumbers& six, Parameter parameter) {
  switch (parameter) {
    case Parameter::x:
      return six.x_mm;
    case Parameter::y:
      return six.y_mm;
    case Parameter::z:
      return six.z_mm;
    case Parameter::rx:
      return six.rx_deg;
    case Parameter::ry:
      return six.ry_deg;
    case Parameter::rz:
      return six.rz_deg;
    default:
      return internal_value(model, parameter);
  }
}

}  // namespace

std::vector<ParameterRow> parameter_rows(const CalibrationResult& result, double frame_offset_z_mm,
                                         const std::optional<CalibratedCamera>& active) {
  const SixNumbers six = to_six_numbers(with_frame_offset(result.X_WC, frame_offset_z_mm));
  const ReportedUncertainty uncertainty =
      reported_uncertainty(result.uncertainty, result.X_WC, frame_offset_z_mm);
  std::vector<ParameterRow> rows;
  for (std::size_t i = 0; i < parameter_count; ++i) {
    ParameterRow row;
    row.parameter = static_cast<Parameter>(i);
    const auto value = value_of(result.model, six, row.parameter);
    if (!value) continue;
    row.value = *value;
    if (row.parameter >= Parameter::rx)
      row.unit = "deg", row.decimals = 4;
    else if (row.parameter >= Parameter::x)
      row.unit = "mm", row.decimals = 3;
    else if (row.parameter <= Parameter::cy)
      row.unit = "px", row.decimals = 3;
    else
      row.decimals = 6;
    row.sigma = sigma_of(uncertainty, row.parameter);
    if (active)
      row.active = value_of(active->model, to_six_numbers(with_frame_offset(active->X_WC, frame_offset_z_mm)),
                            row.parameter);
    if (row.active) row.difference = row.value - *row.active;
    if (row.unit == "deg") row.difference = std::remainder(row.difference, 360);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace zeropose
