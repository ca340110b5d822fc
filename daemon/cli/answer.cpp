#include "daemon/cli/answer.h"

#include <iomanip>
#include <iostream>
#include <sstream>
#include <utility>

#include "config/config_error.h"

namespace zeropose::cli {

Answer failure(std::string reason) {
  return {no_answer, {{"status", "failed"}, {"reason", reason}}, "no answer: " + std::move(reason) + "\n"};
}

void print(const Answer& answer, bool json) {
  if (json)
    std::cout << answer.json.dump() << '\n';
  else if (answer.exit_status == done)
    std::cout << answer.text;
  if (answer.exit_status != done) std::cerr << answer.text;
}

int run(const std::function<Answer()>& verb, bool json) {
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

std::array<double, 6> six_of(const Pose& X_AB) {
  const SixNumbers six = to_six_numbers(X_AB);
  return {six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg};
}

std::string table_of(std::span<const double> numbers, int digits) {
  std::ostringstream text;
  for (const double number : numbers)
    text << ' ' << std::fixed << std::setprecision(digits) << std::setw(12) << number;
  return text.str();
}

std::string hash_text(std::uint32_t hash) {
  std::ostringstream text;
  text << std::hex << std::setfill('0') << std::setw(8) << hash;
  return text.str();
}

}  // namespace zeropose::cli
