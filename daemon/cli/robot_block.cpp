#include "daemon/cli/robot_block.h"

#include <algorithm>
#include <array>
#include <optional>

#include "config/text.h"

namespace zeropose::cli {
namespace {

constexpr std::array<std::string_view, 6> state_names = {"Preoperational",  "Initialized", "Ready",
                                                         "SingleExecution", "Halted",      "Error"};
constexpr std::array<std::string_view, 9> bit_names = {"ready",        "busy",         "exposure done",
                                                       "result valid", "not ok",       "error",
                                                       "simulated",    "zero missing", "camera moved"};
constexpr std::array<std::string_view, 5> frame_names = {"none", "object zero", "world shift",
                                                         "robot-base shift", "user frame"};

template <std::size_t size>
std::string named(const std::array<std::string_view, size>& names, std::size_t number) {
  return number < size ? std::string(names[number]) : concat({"unknown (", std::to_string(number), ")"});
}

std::vector<std::string> bits_of(std::uint16_t status) {
  std::vector<std::string> names;
  for (std::size_t bit = 0; bit < 16; ++bit)
    if (status >> bit & 1)
      names.push_back(bit < bit_names.size() ? std::string(bit_names[bit])
                                             : concat({"unknown bit ", std::to_string(bit)}));
  return names;
}

const CodeText* code_text(std::uint16_t code) {
  const auto table = code_table();
  const auto found =
      std::ranges::find(table, code, [](const CodeText& t) { return static_cast<std::uint16_t>(t.code); });
  return found == table.end() ? nullptr : &*found;
}

std::optional<Convention> convention_of(const ResultBlock& block) {
  const auto convention = static_cast<Convention>(block.convention);
  if (convention == Convention::matrix || name_of(convention) == "unknown") return std::nullopt;
  return convention;
}

// Only of a block that claims to be valid: nothing else may be taken for a correction.
std::optional<Pose> correction_of(const ResultBlock& block) {
  const auto convention = convention_of(block);
  if (!convention || !block.has(status_bit::result_valid)) return std::nullopt;
  return from_wire(*convention, block.values);
}

// -1: there is none, or it is beyond the range.
int number_or_none(std::uint16_t number) { return number == not_representable ? -1 : number; }

std::string millimetres(std::uint16_t um) {
  if (um == not_representable) return "none";
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << um / 1000.0 << " mm";
  return text.str();
}

std::string joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text.append(text.empty() ? "" : ", ").append(part);
  return text.empty() ? "none" : text;
}

std::string numbers(std::span<const double> list) {
  std::ostringstream text;
  for (const double number : list) text << ' ' << std::fixed << std::setprecision(4) << number;
  return text.str();
}

std::string correction_text(const ResultBlock& block) {
  const auto X = correction_of(block);
  if (!X) return "no correction";
  const auto convention = static_cast<Convention>(block.convention);
  std::string text = "x y z mm rx ry rz deg" + numbers(six_of(*X)) + "; " + std::string(name_of(convention));
  const auto names = field_names(convention);
  const std::vector<double> values = to_maker(convention, *X);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::ostringstream one;
    one << ' ' << names[i] << '=' << std::setprecision(9) << values[i];
    text += one.str();
  }
  return text;
}

std::string code_line(const ResultBlock& block) {
  const CodeText* code = code_text(block.code);
  if (!code) return concat({"code ", std::to_string(block.code), " unknown"});
  std::string text = concat({"code ", std::to_string(block.code), " ", code->name});
  if (block.code != 0) text += concat({": ", code->cause});
  return text;
}

}  // namespace

std::vector<std::string> oddities(const ResultBlock& b) {
  using namespace status_bit;
  std::vector<std::string> list;
  if ((b.status & ~all) != 0) list.push_back("there are status bits that mean nothing");
  if (static_cast<std::size_t>(b.state) >= state_names.size()) list.push_back("the state is unknown");
  if (!code_text(b.code)) list.push_back("the code is unknown");
  if (!convention_of(b)) list.push_back("the convention is unknown");
  if (b.frame >= frame_names.size()) list.push_back("the frame of the values is unknown");
  if (b.epoch == 0) list.push_back("the session epoch is 0");
  if (b.has(result_valid) && b.has(not_ok)) list.push_back("valid and not ok at the same time");
  if (b.has(result_valid) && b.code != 0) list.push_back("valid with a code");
  if (b.has(result_valid) && b.validity_ms == 0) list.push_back("valid without a validity");
  if (b.has(result_valid) && !correction_of(b)) list.push_back("valid, but the values are no correction");
  if (!b.has(result_valid) && b.values != no_values) list.push_back("values without a valid result");
  if (b.has(result_valid) && b.request_id == 0) list.push_back("a valid result without a request id");
  return list;
}

Json block_json(const ResultBlock& b) {
  Json json{{"sequence", b.sequence},
            {"epoch", b.epoch},
            {"request_id", b.request_id},
            {"job", b.job},
            {"robot_index", b.robot_index},
            {"part", b.part},
            {"state", named(state_names, static_cast<std::size_t>(b.state))},
            {"status", bits_of(b.status)},
            {"code", b.code}};
  const CodeText* code = code_text(b.code);
  json["code_name"] = code ? code->name : "unknown";
  json["cause"] = code ? code->cause : "";
  json["remedy"] = code ? code->remedy : "";
  const auto convention = convention_of(b);
  json["convention"] = convention ? name_of(*convention) : "unknown";
  json["frame"] = named(frame_names, b.frame);
  const auto X = correction_of(b);
  json["correction"] = X ? Json(six_of(*X)) : Json();
  json["maker_values"] = X ? Json(to_maker(*convention, *X)) : Json();
  json["age_ms"] = number_or_none(b.age_ms);
  json["validity_ms"] = b.validity_ms;
  json["effective_marks"] = b.effective_marks;
  json["effective_cameras"] = b.effective_cameras;
  json["largest_deviation_um"] = number_or_none(b.largest_deviation_um);
  json["sigma_um"] = number_or_none(b.sigma_um);
  json["config_hash"] = hash_text(b.config_hash);
  json["calibration_hash"] = hash_text(b.calibration_hash);
  json["zero_id"] = hash_text(b.zero_id);
  json["oddities"] = oddities(b);
  return json;
}

std::string block_text(const ResultBlock& b) {
  const auto number = [](std::uint32_t n) { return std::to_string(n); };
  const auto convention = convention_of(b);
  std::string text =
      concat({named(state_names, static_cast<std::size_t>(b.state)), " [", joined(bits_of(b.status)), "] ",
              code_line(b), "; request ", number(b.request_id), " job ", number(b.job), " part ",
              number(b.part), "; ", correction_text(b)});
  text += concat({"; age ", b.age_ms == not_representable ? "none" : number(b.age_ms) + " ms", " of ",
                  number(b.validity_ms), " ms; ", number(b.effective_marks), " marks in ",
                  number(b.effective_cameras), " cameras, deviation ", millimetres(b.largest_deviation_um),
                  ", sigma ", millimetres(b.sigma_um)});
  text += concat({"; robot ", number(b.robot_index), ", ", convention ? name_of(*convention) : "unknown",
                  ", ", named(frame_names, b.frame), "; epoch ", hash_text(b.epoch), " sequence ",
                  number(b.sequence), "; config ", hash_text(b.config_hash), " calibration ",
                  hash_text(b.calibration_hash), " zero ", hash_text(b.zero_id)});
  for (const std::string& oddity : oddities(b)) text.append("; WRONG: ").append(oddity);
  return text;
}

std::string text_of(BlockProblem problem) {
  const std::string what = concat({"the block cannot be used: ", name_of(problem)});
  switch (problem) {
    case BlockProblem::wrong_magic:
      return what + "; is something else listening there, or are the bytes of a register swapped?";
    case BlockProblem::wrong_map_version:
      return what + "; daemon and zeropose are of different versions";
    case BlockProblem::wrong_crc:
      return what + "; has the block another data id? Give it by --data-id";
    case BlockProblem::torn:
      return what + "; a gateway in between does not read the block in one request";
    case BlockProblem::wrong_length:
      break;
  }
  return what;
}

}  // namespace zeropose::cli
