#include "daemon/cli/live.h"

#include <openssl/evp.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "daemon/control.h"
#include "measure/code.h"
#include "protocol/line_socket.h"

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

struct LiveOptions {
  std::filesystem::path socket = default_control_socket();
  bool json = false;
  double wait_s = 0;
  std::string camera, out;
  bool plain = false;
};

Json question(const LiveOptions& options, const Json& ask_for) {
  return Json::parse(ask(options.socket, ask_for.dump(), 30s));
}

std::string pose_text(const Json& six) {
  std::ostringstream text;
  text << std::fixed;
  for (std::size_t i = 0; i < 6; ++i)
    text << (i ? "  " : "") << std::setw(9) << std::setprecision(i < 3 ? 3 : 4) << six[i].get<double>();
  return text.str();
}

std::string short_text(const Json& number) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << number.get<double>();
  return text.str();
}

std::string text_or(const Json& value, const char* key) { return value.value(key, std::string()); }

void print_verdict(const Json& answer) {
  std::cout << (answer["status"] == "ok" ? "ok" : "NOT OK");
  if (answer.contains("code") && answer["code"] != 0)
    std::cout << ": code " << answer["code"] << ' ' << text_or(answer, "name")
              << "\n  what: " << text_or(answer, "reason") << "\n  do:   " << text_or(answer, "remedy");
  else if (answer["status"] == "error")
    std::cout << ": " << text_or(answer, "reason");
  std::cout << '\n';
}

// What the camera's reference points say; nothing where they were not looked at.
std::string stand_text(const Json& camera) {
  const Json references = camera.value("references", Json::object());
  const std::string state = references.value("state", "unchecked");
  if (state == "unchecked") return {};
  return ", " + std::string(state == "moved" ? "MOVED" : state) + " by its reference points (" +
         short_text(references["rms_px"]) + " px, " + references["seen"].dump() + " of " +
         references["expected"].dump() + " seen)";
}

std::string change_text(const Json& health, const char* key, const char* what) {
  const Json& trend = health[key];
  if (!trend["changed"]) return {};
  return std::string(", ") + what + " CHANGED from " + short_text(trend["first"]) + " to " +
         short_text(trend["mean"]);
}

// What its pictures say; nothing before the first.
std::string health_text(const Json& camera) {
  const Json health = camera.value("health", Json());
  if (!health.is_object()) return {};
  return "\n    noise " + short_text(health["noise_grey"]) + " grey, mean " +
         short_text(health["mean_grey"]) + ", saturated " +
         short_text(100 * health["saturated_share"].get<double>()) + " %, focus " +
         (health["focus_px"].is_null() ? "unknown" : short_text(health["focus_px"]) + " px") +
         change_text(health, "focus_trend", "blur of the marks") +
         change_text(health, "noise_trend", "noise");
}

double length_of(const Json& six, std::size_t first) {
  return std::hypot(six[first].get<double>(), six[first + 1].get<double>(), six[first + 2].get<double>());
}

// A translation that the points do not tell has none.
std::string sigma_text(const Json& sigma) {
  return sigma[0].is_null() ? "of the turn alone, the shift is not known" : pose_text(sigma);
}

std::string shift_text(const Json& camera) {
  if (camera["sigma"][0].is_null()) return {};
  return "shifted by " + short_text(length_of(camera["X_CoCn"], 0)) + " mm, ";
}

std::string effect_text(const Json& effect) {
  if (effect.is_null()) return "unknown";
  return effect["X_O0O"].is_null()
             ? "code " + effect["code"].dump() + " " + text_or(effect, "name")
             : pose_text(effect["X_O0O"]) + "  by " + effect["effective_marks"].dump() + " marks";
}

// Where moved cameras are by their reference points, and what that changes.
void print_proposal(const Json& answer) {
  const Json proposal = answer.value("proposal", Json());
  if (proposal.is_null()) return;
  for (const auto& camera : proposal["cameras"]) {
    std::cout << "  " << text_or(camera, "camera") << " by its reference points ("
              << text_or(camera, "method") << "): ";
    if (camera["X_CoCn"].is_null()) {
      std::cout << "no answer: " << text_or(camera, "reason") << '\n';
      continue;
    }
    std::cout << "turned by about " << short_text(length_of(camera["X_CoCn"], 3)) << " deg, "
              << shift_text(camera) << short_text(camera["rms_px"]) << " px left\n    X_WC was "
              << pose_text(camera["X_WC_before"]) << "\n    X_WC is  " << pose_text(camera["X_WC"])
              << "\n    sigma    " << sigma_text(camera["sigma"]) << '\n';
    for (const auto& warning : camera["warnings"])
      std::cout << "    warning: " << warning.get<std::string>() << '\n';
  }
  std::cout
      << "  this picture's x y z mm, rx ry rz deg\n    as calibrated: "
      << effect_text(proposal["effect"]["believed"])
      << "\n    as proposed:   " << effect_text(proposal["effect"]["proposed"])
      << "\n  accept it: zeropose measure --json > measured.json; zeropose recalibrate --cell ... --name ... "
         "--measured measured.json --output new.json; zeropose calibration activate\n";
}

// Each gap, and the motion that evens them; nothing for a job with marks.
void print_gaps(const Json& answer) {
  const Json gaps = answer.value("gaps", Json());
  if (!gaps.is_object()) return;
  for (const Json& gap : gaps["places"]) {
    std::cout << "  " << text_or(gap, "camera") << ": gap " << text_or(gap, "gap") << ' ';
    if (gap.contains("gap_mm"))
      std::cout << short_text(gap["gap_mm"]) << " mm"
                << (gap.value("removed", false) ? ", removed as wrong" : "") << '\n';
    else
      std::cout << "not measured: " << text_or(gap, "finding") << ": " << text_or(gap, "reason") << '\n';
  }
  if (!gaps.contains("motion")) return;
  std::cout << "  uneven by " << short_text(gaps["uneven_mm"]) << " mm, "
            << (gaps["even_already"]
                    ? "even already"
                    : "after the motion by " + short_text(gaps["predicted_worst_mm"]) + " mm")
            << "\n";
}

// Camber and toe; nothing for another job.
void print_wheel(const Json& answer) {
  const Json wheel = answer.value("wheel", Json());
  if (!wheel.is_object() || !wheel.contains("camber_deg")) return;
  std::cout << "  camber " << short_text(wheel["camber_deg"]) << " deg, sigma "
            << short_text(wheel["sigma_camber_deg"]) << "; toe " << short_text(wheel["toe_deg"])
            << " deg, sigma " << short_text(wheel["sigma_toe_deg"]) << "; profile at a radius of "
            << short_text(wheel["profile_radius_mm"]) << " mm\n";
}

// Of what effective_marks counts.
std::string counted_in(const Json& answer) {
  if (answer.contains("gaps")) return " gaps";
  return answer.contains("wheel") ? " profile points" : " marks";
}

void print_status(const Json& answer) {
  std::cout << "cell " << text_or(answer, "cell") << (answer["simulated"] ? " (simulated)" : "") << ", job "
            << text_or(answer, "job") << ": " << (answer["ready"] ? "ready" : "NOT READY") << '\n';
  for (const auto& camera : answer["cameras"])
    std::cout << "  " << text_or(camera, "name") << ": "
              << (camera["alive"] ? "there" : "MISSING: " + text_or(camera, "last_problem"))
              << stand_text(camera) << health_text(camera) << '\n';
  print_proposal(answer);
  if (answer.contains("zero"))
    std::cout << "  zero: " << text_or(answer["zero"], "time") << '\n';
  else if (answer["zero_state"]["code"] == static_cast<int>(Code::no_procedure))
    std::cout << "  " << text_or(answer["zero_state"], "reason") << '\n';
  else
    std::cout << "  zero: " << text_or(answer["zero_state"], "name") << ": "
              << text_or(answer["zero_state"], "remedy") << '\n';
  if (answer.contains("gaps") && answer["gaps"]["verdict"]["code"] != 0)
    std::cout << "  the last measurement was refused: " << text_or(answer["gaps"]["verdict"], "name") << ": "
              << text_or(answer["gaps"]["verdict"], "reason") << '\n';
  print_gaps(answer);
}

void print_measurement(const Json& answer) {
  print_verdict(answer);
  print_proposal(answer);
  print_gaps(answer);
  print_wheel(answer);
  if (answer.contains("X_O0O"))
    std::cout << "  x y z mm, rx ry rz deg: " << pose_text(answer["X_O0O"]) << "\n  "
              << answer["effective_marks"] << counted_in(answer) << " in " << answer["effective_cameras"]
              << " cameras, largest deviation " << short_text(answer["largest_deviation_mm"]) << " mm, sigma "
              << short_text(answer["sigma_mm"]) << " mm\n";
  for (const auto& mark : answer.value("marks", Json::array()))
    if (mark["finding"] != "found" || mark.value("removed", false))
      std::cout << "  " << text_or(mark, "camera") << ": mark " << text_or(mark, "mark") << ' '
                << (mark["finding"] == "found" ? "removed as wrong"
                                               : "not found: " + text_or(mark, "finding"))
                << '\n';
}

void print_zero(const Json& answer) {
  print_verdict(answer);
  if (!answer.contains("zero")) return;
  std::cout << "  X_WO0 x y z mm, rx ry rz deg: " << pose_text(answer["zero"]["X_WO0"])
            << "\n  spread of one frame:          " << pose_text(answer["spread_mm_deg"]) << '\n';
}

std::string bytes_of_base64(const std::string& text) {
  std::string bytes(text.size() / 4 * 3, '\0');
  EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                  reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size()));
  bytes.resize(bytes.size() -
               static_cast<std::size_t>(
                   std::count(text.end() - std::min<std::ptrdiff_t>(2, std::ssize(text)), text.end(), '=')));
  return bytes;
}

void print_snapshot(const LiveOptions& options, Json& answer) {
  if (!answer.contains("png")) return print_verdict(answer);
  std::ofstream file(options.out, std::ios::binary);
  file << bytes_of_base64(answer["png"].get<std::string>());
  file.close();
  if (!file) throw std::runtime_error(options.out + ": cannot be written");
  answer.erase("png");
  answer["file"] = options.out;
  if (!options.json) std::cout << options.out << '\n';
}

// The status as soon as the daemon answers and knows its cameras, or whatever it is when the time is up.
Json status_within(const LiveOptions& options) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.wait_s);
  for (;;) {
    const bool last = std::chrono::steady_clock::now() >= deadline;
    try {
      const Json answer = question(options, {{"cmd", "status"}});
      const auto& cameras = answer["cameras"];
      const bool all = !cameras.empty() &&  // as in a daemon that has just begun
                       std::all_of(cameras.begin(), cameras.end(),
                                   [](const Json& camera) { return camera["alive"].get<bool>(); });
      if (last || all) return answer;
    } catch (const std::runtime_error&) {
      if (last) throw;
    }
    std::this_thread::sleep_for(100ms);
  }
}

using Print = std::function<void(Json&)>;

void run_verb(const LiveOptions& options, int& exit_status, const std::function<Json()>& get,
              const Print& print) {
  try {
    Json answer = get();
    exit_status = answer["status"] == "ok" ? 0 : 1;
    if (options.json && !answer.contains("png")) std::cout << answer.dump() << '\n';
    if (!options.json || answer.contains("png")) print(answer);
  } catch (const std::exception& error) {
    exit_status = 2;
    std::cerr << error.what() << '\n';
    if (options.json) std::cout << Json{{"status", "error"}, {"reason", error.what()}}.dump() << '\n';
  }
}

cli::Verb live_verb(cli::Verb app, LiveOptions& options, const std::string& name, const std::string& text) {
  const cli::Verb verb = app.add_subcommand(name, text);
  verb.add_option("--socket", options.socket, "the daemon's Unix socket").shows_default();
  verb.add_flag("--json", options.json, "exactly one JSON object on stdout");
  return verb;
}

}  // namespace

void add_live_verbs(cli::Verb app, int& exit_status) {
  const auto options = std::make_shared<LiveOptions>();
  const cli::Verb status =
      live_verb(app, *options, "status", "What the daemon knows: cameras, zero, ready or not and why");
  status.add_option("--wait", options->wait_s, "seconds to wait for the daemon and all its cameras")
      .shows_default();
  status.callback([options, &exit_status] {
    run_verb(
        *options, exit_status, [&] { return status_within(*options); }, print_status);
  });
  live_verb(app, *options, "measure", "Measure once; no robot sees the result")
      .callback([options, &exit_status] {
        run_verb(
            *options, exit_status,
            [&] {
              return question(*options, {{"cmd", "measure"}});
            },
            print_measurement);
      });
  live_verb(app, *options, "zero", "Take the zero measurement: the object must stand in its ideal position")
      .callback([options, &exit_status] {
        run_verb(
            *options, exit_status,
            [&] {
              return question(*options, {{"cmd", "zero"}});
            },
            print_zero);
      });
  const cli::Verb snapshot =
      live_verb(app, *options, "snapshot", "One frame of a camera as PNG, with search areas and found marks");
  snapshot.add_option("--camera", options->camera, "the camera's name").required();
  snapshot.add_option("--out", options->out, "the PNG file to write").required();
  snapshot.add_flag("--plain", options->plain, "without search areas and marks");
  snapshot.callback([options, &exit_status] {
    run_verb(
        *options, exit_status,
        [&] {
          return question(*options,
                          {{"cmd", "snapshot"}, {"camera", options->camera}, {"marks", !options->plain}});
        },
        [&](Json& answer) { print_snapshot(*options, answer); });
  });
}

}  // namespace zeropose
