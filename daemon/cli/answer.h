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

inline Answer failure(std::string reason) {
  return {no_answer, {{"status", "failed"}, {"reason", reason}}, "no answer: " + std::move(reason) + "\n"};
}

inline void print(const Answer& answer, bool json) {
  if (json)
    std::cout << answer.json.dump() << '\n';
  else if (answer.exit_status == done)
    std::cout << answer.text;
  if (answer.exit_status != done) std::cerr << answer.text;
}

// Runs a verb; input that cannot be read ends with status 2 and one line per mistake on stderr.
inline int run(const std::function<Answer()>& verb, bool json) {
  try {
    const Answer answer = verb();
    print(answer, json);
    return answer.exit_status;
  } catch (const ConfigError& error) {
    Answer answer{wrong_input, {{"status", "error"}, {"reason", error.mistakes().front()}}, error.what()};
    answer.json["mistakes"] = error.mistakes();
    answer.text += '\n';
    print(answer, json);
  } catch (const std::exception& error) {
    print({wrong_input, {{"status", "error"}, {"reason", error.what()}}, std::string(error.what()) + "\n"},
          json);
  }
  return wrong_input;
}

inline std::array<double, 6> six_of(const Pose& X_AB) {
  const SixNumbers six = to_six_numbers(X_AB);
  return {six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
}

inline std::string table_of(std::span<const double> numbers, int digits = 4) {
  std::ostringstream text;
  for (const double number : numbers)
    text << ' ' << std::fixed << std::setprecision(digits) << std::setw(12) << number;
  return text.str();
}

template <typename Vector>
Json json_of(const Vector& vector) {
  return Json(std::vector<double>(vector.data(), vector.data() + vector.size()));
}

inline std::string hash_text(std::uint32_t hash) {
  std::ostringstream text;
  text << std::hex << std::setfill('0') << std::setw(8) << hash;
  return text.str();
}

}  // namespace zeropose::cli
