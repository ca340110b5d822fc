// The parameters of a calibration as the rows of a table: for the report's page and for text.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "calib/calibration.h"
#include "calib/uncertainty.h"

namespace zeropose {

struct ParameterRow {
  Parameter parameter = Parameter::fx;
  std::string_view unit;  // px, mm, deg or empty
  int decimals = 2;
  double value = 0;
  double sigma = -1;             // -1: held or not estimated
  std::optional<double> active;  // the same parameter of the active calibration
  double difference = 0;         // from that; of angles -180 .. 180
};

// Those of the model and X_WC in six numbers, its frame moved along z by frame_offset_z_mm. `active` is given
// without the offset. K or k1 .. k3 of the active camera are absent where its model is the other one.
std::vector<ParameterRow> parameter_rows(const CalibrationResult& result, double frame_offset_z_mm,
                                         const std::optional<CalibratedCamera>& active);

}  // namespace zeropose
