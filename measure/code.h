// The codes that say why a measurement counts or not: one vocabulary from the image to the robot (spec 80).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace zeropose {

// 0 ok, 1xx request, 2xx camera and image, 3xx marks, 4xx geometry and deviations, 5xx limits, 6xx references
// and drift, 7xx config and storage, 9xx internal. A default-made result says internal: forgetting never
// means ok.
enum class Code : std::uint16_t {
  ok = 0,

  unknown_command = 101,
  unknown_job = 102,
  not_ready = 103,
  zero_guard_wrong = 104,
  halted = 105,
  argument_out_of_range = 106,
  no_procedure = 107,
  wrong_position = 108,
  position_missing = 109,
  not_standing_still = 110,

  camera_missing = 201,
  frame_timeout = 202,
  frame_damaged = 203,
  frame_wrong_size = 204,
  result_timeout = 205,
  frame_frozen = 206,
  image_saturated = 211,
  image_dark = 212,
  image_blurred = 213,

  too_few_marks = 301,
  too_few_marks_in_camera = 302,
  too_few_cameras = 303,
  marks_invalid = 304,
  lines_not_found = 305,

  geometry_degenerate = 401,
  not_converged = 402,
  deviation_not_attributable = 403,
  sigma_too_large = 404,
  hidden_error_too_large = 405,

  limit_x = 501,
  limit_y = 502,
  limit_z = 503,
  limit_rx = 504,
  limit_ry = 505,
  limit_rz = 506,
  value_out_of_range = 507,
  limit_displacement = 508,
  step_too_large = 509,
  gaps_not_even = 510,

  camera_moved = 601,
  reference_missing = 602,
  camera_suspicious = 603,

  zero_missing = 701,
  zero_outdated = 702,
  storage_failed = 703,
  compensation_too_large = 704,

  internal = 901,
};

struct CodeText {
  Code code;
  std::string_view name;    // as in the enum
  std::string_view cause;   // one sentence for the operator
  std::string_view remedy;  // what to do
};

// Every code once, ascending.
std::span<const CodeText> code_table();
const CodeText& text_of(Code code);

}  // namespace zeropose
