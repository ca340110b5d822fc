// How every batch verb answers: one JSON object or text for people, messages on stderr, exit status 0, 1
// or 2.
#pragma once

#include <array>
#include <functional>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "calib/rigid.h"
#include "config/config_error.h"

namespace zeropose::cli {

using Json = nlohmann::ordered_json;

inline constexpr int done = 0, no_answer = 1, wrong_input = 2;

// What a verb found, for people and for programs.
struct Answer {
  int exit_status = done;
  Json json;
  std::string text;
};

Answer failure(std::string reason);

// Answers on stdout, why there is none on stderr.
void print(const Answer& answer, bool json);

// Runs a verb; input that cannot be read ends with status 2 and one line per mistake on stderr.
int run(const std::function<Answer()>& verb, bool json);

std::array<double, 6> six_of(const Pose& X_AB);

std::string table_of(std::span<const double> numbers, int digits = 4);

template <typename Vector>
Json json_of(const Vector& vector) {
  return Json(std::vector<double>(vector.data(), vector.data() + vector.size()));
}

std::string hash_text(std::uint32_t hash);

}  // namespace zeropose::cli
