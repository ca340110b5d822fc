// Surveys on the control socket.
#pragma once

#include <nlohmann/json.hpp>

#include "config/cell.h"
#include "daemon/cycle.h"

namespace zeropose {

// {"camera": NAME, "positions": N, "target": {"kind": "ball", "bright", "min_diameter_px", "max_diameter_px"}
// or
// {"kind": "circles" | "asymmetric-circles" | "chessboard", "rows", "cols", "pitch_mm", "diameter_mm"} or
// {"kind": "body", "marks": [{"name", "p_B_mm": [3], "radius_mm", "normal_B": [3]}]}}; with "robot": NAME,
// "targets":
// [[x, y, z, rx, ry, rz] of X_RH, ...] that robot is told where to go. Throws
// std::invalid_argument or what JSON throws for a wrong question.
SurveyOptions survey_options(const Cell& cell, const nlohmann::json& question);

// {"survey": its number, "positions", "missing": [..], "last_problem", "views": [{"position", "X_RH": [x, y,
// z, rx, ry, rz], "points": [{x_mm, y_mm, z_mm, u_px, v_px, suu, svv, suv, radius_mm, nx, ny, nz}]}]};
// positions 0: none runs.
nlohmann::json survey_json(const SurveyState& state);

}  // namespace zeropose
