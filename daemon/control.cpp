#include "daemon/control.h"

#include <openssl/evp.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/cycle.h"
#include "daemon/gap_json.h"
#include "daemon/overlay.h"
#include "daemon/pose_json.h"
#include "daemon/proposal_json.h"
#include "daemon/survey_json.h"
#include "daemon/wheel_json.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;

double milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double microseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

Json verdict(Code code, const std::string& reason) {
  return {{"status", code == Code::ok ? "ok" : "not ok"},
          {"code", static_cast<int>(code)},
          {"name", text_of(code).name},
          {"reason", reason},
          {"remedy", text_of(code).remedy}};
}

Json zero_json(const ZeroRecord& record) {
  const double radius_mm = record.zero.profile_radius_mm;  // of a wheel
  Json compensation = Json::array();
  for (const auto& shift : record.zero.compensation_O_mm)
    compensation.push_back({shift.x(), shift.y(), shift.z()});
  return {{"id", record.id},
          {"time", record.time_utc},
          {"X_WO0", six_json(record.zero.X_WO0)},
          {"compensation_mm", compensation},
          {"profile_radius_mm", radius_mm > 0 ? Json(radius_mm) : Json()}};
}

Json check_json(const CameraCheck& check) {
  return {{"state", name_of(check.stand)},   {"seen", check.seen},     {"expected", check.expected},
          {"rms_px", check.rms_px},          {"chance", check.chance}, {"farthest", check.farthest},
          {"farthest_px", check.farthest_px}};
}

Json trend_json(const HealthTrend& trend) {
  return {{"mean", trend.mean}, {"first", trend.first}, {"ratio", trend.ratio()}, {"changed", trend.changed}};
}

// null before the first picture.
Json health_json(const CameraHealth& health) {
  if (!health.seen) return nullptr;
  const PictureHealth& picture = health.picture;
  return {{"noise_grey", picture.noise_grey},
          {"saturated_share", picture.saturated_share},
          {"dark_share", picture.dark_share},
          {"mean_grey", picture.mean_grey},
          {"focus_px", picture.focus_px ? Json(*picture.focus_px) : Json()},
          {"focus_trend", trend_json(health.focus)},
          {"noise_trend", trend_json(health.noise)}};
}

Json camera_json(const CameraStatus& camera) {
  const CameraStatistics& counted = camera.statistics;
  Json json{{"name", camera.name},
            {"alive", camera.state == CameraState::alive},
            {"last_problem", camera.last_problem},
            {"references", check_json(camera.check)},
            {"health", health_json(camera.health)},
            {"frames", counted.frames},
            {"timeouts", counted.timeouts},
            {"damaged", counted.damaged},
            {"resent_packets", counted.resent_packets},
            {"underruns", counted.underruns}};
  if (counted.temperature_c) json["temperature_c"] = *counted.temperature_c;
  if (!counted.ptp_state.empty()) json["ptp_state"] = counted.ptp_state;
  return json;
}

Json status_answer(Cycle& cycle) {
  const Status status = cycle.status();
  Json cameras = Json::array();
  for (const auto& camera : status.cameras) cameras.push_back(camera_json(camera));
  Json answer{{"status", "ok"},
              {"cell", cycle.cell().name},
              {"simulated", cycle.cell().simulated},
              {"job", status.job},
              {"ready", status.ready},
              {"cameras_known", status.cameras_known},
              {"cameras", cameras},
              {"cycles", status.cycles},
              {"zero_state", verdict(status.zero_code, status.zero_reason)}};
  answer["proposal"] = proposal_json(status.proposal, cycle.cell());
  if (status.zero) answer["zero"] = zero_json(*status.zero);
  if (status.last_gaps) {
    const auto job = std::ranges::find(cycle.cell().jobs, status.job, &Job::name);
    answer["gaps"] = gaps_json(*job, cycle.cell(), *status.last_gaps);
    answer["gaps"]["verdict"] = verdict(status.last_gaps->code, status.last_gaps->reason);
  }
  return answer;
}

Json mark_json(const Job& job, const Cell& cell, const Measurement& m, std::size_t view) {
  const MarkFinding& finding = m.findings[view];
  return {{"mark", job.marks[job.views[view].mark].name},
          {"camera", camera_name(cell, job, job.views[view].camera)},
          {"finding", name_of(finding.status)},
          {"u_px", finding.u_px.x()},
          {"v_px", finding.u_px.y()}};
}

// The findings of the views with the deviations of those that were found: observations are the found views in
// order.
Json marks_json(const Job& job, const Cell& cell, const Measurement& m) {
  Json marks = Json::array();
  std::size_t observation = 0;
  for (std::size_t view = 0; view < m.findings.size(); ++view) {
    Json mark = mark_json(job, cell, m, view);
    if (m.findings[view].status == MarkStatus::found && observation < m.pose.deviations.size()) {
      const Deviation& deviation = m.pose.deviations[observation++];
      mark["dev_px"] = {deviation.dev_px.x(), deviation.dev_px.y()};
      mark["dev_mm"] = {deviation.dev_mm.x(), deviation.dev_mm.y()};
      mark["used"] = deviation.used;
      mark["removed"] = deviation.removed;
    }
    marks.push_back(std::move(mark));
  }
  return marks;
}

// The reference points that were looked for, where they are and where they were at the zero measurement.
Json references_json(const Cell& cell, const std::optional<ZeroRecord>& zero, const Measurement& m) {
  Json references = Json::array();
  for (std::size_t i = 0; i < m.reference_findings.size(); ++i) {
    const View& view = cell.references.views[i];
    const MarkFinding& finding = m.reference_findings[i];
    if (finding.status == MarkStatus::not_searched) continue;
    Json& json = references.emplace_back(Json{{"camera", cell.cameras[view.camera].name},
                                              {"point", cell.references.points[view.mark].mark.name},
                                              {"finding", name_of(finding.status)}});
    if (finding.status == MarkStatus::found) json["after_px"] = {finding.u_px.x(), finding.u_px.y()};
    if (!zero) continue;
    for (const Observation& before : zero->zero.references)
      if (before.camera == view.camera && before.mark == view.mark)
        json["before_px"] = {before.u_px.x(), before.u_px.y()};
  }
  return references;
}

Json measure_answer(Cycle& cycle) {
  const MeasureOutcome outcome = cycle.measure_now();
  const Measurement& m = outcome.measurement;
  Json answer = verdict(m.code, m.reason);
  answer["grab_ms"] = milliseconds(outcome.grab);
  answer["compute_ms"] = milliseconds(outcome.compute);
  if (!outcome.frames.empty()) answer["trigger_spread_us"] = microseconds(outcome.trigger_spread);
  if (outcome.device_spread) answer["device_spread_us"] = microseconds(*outcome.device_spread);
  answer["marks"] = marks_json(*outcome.job, cycle.cell(), m);
  if (m.gaps) answer["gaps"] = gaps_json(*outcome.job, cycle.cell(), m);
  if (m.wheel) answer["wheel"] = wheel_json(*m.wheel);
  answer["references"] = references_json(cycle.cell(), cycle.status().zero, m);
  answer["proposal"] = proposal_json(outcome.proposal, cycle.cell());
  answer["cameras"] = Json::array();
  for (std::size_t i = 0; i < outcome.health.size(); ++i)
    answer["cameras"].push_back(
        {{"name", outcome.frames[i].camera}, {"health", health_json(outcome.health[i])}});
  if (m.code != Code::ok) return answer;
  answer["X_O0O"] = six_json(m.X_O0O);
  if (!m.gaps) answer["X_WO"] = six_json(m.pose.X_WO);
  answer["effective_marks"] = m.pose.effective_marks;
  answer["effective_cameras"] = m.pose.effective_cameras;
  answer["largest_deviation_mm"] = m.largest_deviation_mm;
  answer["sigma_mm"] = m.sigma_mm;
  return answer;
}

Json zero_answer(Cycle& cycle) {
  const ZeroOutcome outcome = cycle.zero_now();
  Json answer = verdict(outcome.code, outcome.reason);
  if (outcome.record) answer["zero"] = zero_json(*outcome.record);
  answer["spread_mm_deg"] = {outcome.spread(0),
                             outcome.spread(1),
                             outcome.spread(2),
                             outcome.spread(3) * degrees_per_radian,
                             outcome.spread(4) * degrees_per_radian,
                             outcome.spread(5) * degrees_per_radian};
  return answer;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes.data(),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::vector<std::uint8_t> picture_of(const ImageView& image, const Snapshot& snapshot, bool marks) {
  if (marks && snapshot.lines) return overlay_png(image, *snapshot.lines);
  if (marks && !snapshot.gaps.empty()) return overlay_png(image, snapshot.gaps);
  return overlay_png(image, marks ? snapshot.marks : std::vector<MarkOverlay>{});
}

Json snapshot_answer(Cycle& cycle, const std::string& name, bool marks) {
  const auto& cameras = cycle.cell().cameras;
  const auto camera =
      std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == name; });
  if (camera == cameras.end())
    return {{"status", "error"}, {"reason", "no camera is called \"" + name + "\""}};
  const Snapshot snapshot = cycle.snapshot_now(static_cast<std::size_t>(camera - cameras.begin()));
  Json answer = verdict(code_of(snapshot.grabbed.status), snapshot.grabbed.reason);
  if (snapshot.grabbed.status != GrabStatus::ok) return answer;
  const ImageView image = view_of(snapshot.grabbed.frame);
  answer["png"] = base64(picture_of(image, snapshot, marks));
  return answer;
}

Json answer_question(Cycle& cycle, const Json& question) {
  const std::string cmd = question.at("cmd").get<std::string>();
  if (cmd == "status") return status_answer(cycle);
  if (cmd == "measure") return measure_answer(cycle);
  if (cmd == "zero") return zero_answer(cycle);
  if (cmd == "snapshot")
    return snapshot_answer(cycle, question.at("camera").get<std::string>(), question.value("marks", true));
  if (cmd == "survey-start")
    return {{"status", "ok"}, {"survey", cycle.start_survey(survey_options(cycle.cell(), question))}};
  if (cmd == "survey") return survey_json(cycle.survey_now());
  if (cmd == "survey-end")
    return cycle.end_survey(question.at("survey").get<std::uint64_t>()), Json{{"status", "ok"}};
  return {{"status", "error"},
          {"reason", "unknown cmd \"" + cmd +
                         "\"; known: status, measure, zero, snapshot, survey-start, survey, survey-end"}};
}

}  // namespace

std::string answer_control(Cycle& cycle, const std::string& line) {
  try {
    return answer_question(cycle, Json::parse(line)).dump();
  } catch (const std::exception& error) {
    return Json{{"status", "error"}, {"reason", error.what()}}.dump();
  }
}

std::filesystem::path default_control_socket() {
  if (const char* runtime = std::getenv("RUNTIME_DIRECTORY"))
    return std::filesystem::path(runtime) / "control.sock";
  if (::geteuid() == 0) return "/run/zeropose/control.sock";
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"))
    return std::filesystem::path(runtime) / "zeropose/control.sock";
  return "/tmp/zeropose-" + std::to_string(::geteuid()) + "/control.sock";
}

}  // namespace zeropose
