#include "daemon/cli/plan.h"

#include <cmath>
#include <memory>

#include "config/cell.h"
#include "config/text.h"
#include "daemon/cli/answer.h"
#include "measure/plan.h"

namespace zeropose {
namespace {

using namespace cli;

constexpr const char* plan_help =
    R"(Nothing is measured: the object stands in its nominal pose and every mark in an image is found with --sigma-px;
the job's system_sigma_px and the marks' sigma_mm are added. For each application point the standard deviation of the
result there; the motions of the object that the marks tell worst; for each mark the smallest error that is sure to
be found (99 %) and what a smaller one could do at an application point; for each camera what is left without it, and
how well its pose is found again from its reference points with known coordinates after it was moved.
A mark that nothing checks is a reason for another one near it.
Example:
  zeropose plan --cell config/cells/car-body.json
Exit status: 0 a result of this layout would be published, 1 it would not (code and reason say why), 2 wrong usage or
unreadable input.)";

struct Options {
  std::string cell, job;
  double sigma_px = 0.02;
  bool json = false;
};

// JSON has no infinity: where there is no limit, there is no number.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::string shown(double value, const char* unit, int digits) {
  if (!std::isfinite(value)) return "without limit";
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value << unit;
  return text.str();
}

const Job& job_of(const Cell& cell, const std::string& name) {
  if (name.empty()) return cell.jobs.front();
  for (const Job& job : cell.jobs)
    if (job.name == name) return job;
  std::string names;
  for (const Job& job : cell.jobs) names += (names.empty() ? "" : ", ") + job.name;
  throw std::invalid_argument(concat({"--job: found ", in_quotes(name), ", expected one of: ", names}));
}

Json verdict_json(const Verdict& verdict) {
  return {{"code", static_cast<int>(verdict.code)},
          {"name", text_of(verdict.code).name},
          {"reason", verdict.reason}};
}

Json view_json(const Cell& cell, const Job& job, const PlannedView& planned) {
  Json json = {{"camera", cell.calibration[planned.view.camera].name},
               {"mark", job.marks[planned.view.mark].name},
               {"seen", planned.seen},
               {"border_px", finite(planned.border_px)},
               {"border_mm", finite(planned.border_mm)},
               {"diameter_px", planned.diameter_px}};
  if (!planned.seen) return json;
  json["redundancy"] = planned.reliability.redundancy;
  json["detectable_px"] = finite(planned.reliability.detectable_px);
  json["detectable_mm"] = finite(planned.detectable_mm);
  json["hidden_mm"] = finite(planned.reliability.hidden_mm);
  return json;
}

Json recovery_json(const PlannedRecovery& recovery) {
  return {{"points", recovery.points},
          {"reason", recovery.reason},
          {"sigma_mm", finite(recovery.sigma_mm)},
          {"sigma_deg", finite(recovery.sigma_deg)}};
}

Json camera_json(const Cell& cell, const PlannedCamera& planned) {
  return {{"camera", cell.calibration[planned.camera].name},
          {"marks", planned.marks},
          {"covered_share", planned.covered_share},
          {"without",
           {{"verdict", verdict_json(planned.loss.verdict)},
            {"sigma_mm", finite(planned.loss.sigma_mm)},
            {"hidden_mm", finite(planned.loss.hidden_mm)}}},
          {"references", cell.references.views.empty() ? Json() : recovery_json(planned.recovery)}};
}

Json plan_json(const Cell& cell, const Job& job, const Plan& plan) {
  Vector6 sigma = plan.sigma;
  sigma.tail<3>() *= degrees_per_radian;
  Json json = {{"status", plan.verdict.code == Code::ok ? "ok" : "failed"},
               {"reason", plan.verdict.reason},
               {"code", static_cast<int>(plan.verdict.code)},
               {"job", job.name},
               {"sigma", plan.points.empty() ? Json() : json_of(sigma)},
               {"sigma_mm", finite(plan.sigma_mm)},
               {"hidden_mm", finite(plan.hidden_mm)},
               {"points", Json::array()},
               {"weak_directions", Json::array()},
               {"views", Json::array()},
               {"cameras", Json::array()}};
  for (const PlannedPoint& point : plan.points)
    json["points"].push_back(
        {{"name", point.name}, {"sigma_mm", point.sigma_mm}, {"sigma_W_mm", json_of(point.sigma_W_mm)}});
  for (const PlannedDirection& direction : plan.directions)
    json["weak_directions"].push_back({{"sigma_mm", direction.sigma_mm},
                                       {"translation_mm", json_of(direction.translation_W_mm)},
                                       {"rotation_deg", json_of(direction.rotation_W_deg)}});
  for (const PlannedView& planned : plan.views) json["views"].push_back(view_json(cell, job, planned));
  for (const PlannedCamera& planned : plan.cameras) json["cameras"].push_back(camera_json(cell, planned));
  return json;
}

void print_pose(std::ostream& text, const Plan& plan) {
  Vector6 sigma = plan.sigma;
  sigma.tail<3>() *= degrees_per_radian;
  text << "sigma of the pose, mm and degrees along and about the world's axes:\n"
       << table_of({sigma.data(), 6}) << "\nsigma at the points, mm: largest, along x, y, z\n";
  for (const PlannedPoint& point : plan.points)
    text << table_of({&point.sigma_mm, 1}) << table_of({point.sigma_W_mm.data(), 3}) << "  " << point.name
         << "\n";
  text << "motions of the object, the weakest first: sigma mm, of it translation mm, rotation degrees\n";
  for (const PlannedDirection& direction : plan.directions)
    text << table_of({&direction.sigma_mm, 1}) << " " << table_of({direction.translation_W_mm.data(), 3})
         << " " << table_of({direction.rotation_W_deg.data(), 3}) << "\n";
}

void print_views(std::ostream& text, const Cell& cell, const Job& job, const Plan& plan) {
  text << "marks: how far from the border of the image; the smallest error that is sure to be found; what a "
          "smaller\n"
          "one could do at a point\n";
  for (const PlannedView& planned : plan.views) {
    text << "  " << cell.calibration[planned.view.camera].name << " " << job.marks[planned.view.mark].name
         << ": ";
    if (!planned.seen) {
      text << "not in the image\n";
      continue;
    }
    text << shown(planned.border_px, " px", 0) << ", " << shown(planned.border_mm, " mm", 0);
    if (!plan.points.empty() && std::isfinite(planned.reliability.hidden_mm))
      text << "; " << shown(planned.reliability.detectable_px, " px", 2) << ", "
           << shown(planned.detectable_mm, " mm", 2) << "; "
           << shown(planned.reliability.hidden_mm, " mm", 3);
    else if (!plan.points.empty())
      text << "; nothing checks it";
    text << "\n";
  }
}

void print_cameras(std::ostream& text, const Cell& cell, const Plan& plan) {
  text << "cameras: marks, share of the image that they span; without it: sigma and unnoticed error at the "
          "worst "
          "point\n";
  for (const PlannedCamera& planned : plan.cameras) {
    const PlannedLoss& loss = planned.loss;
    text << "  " << cell.calibration[planned.camera].name << ": " << planned.marks << " marks, "
         << shown(100 * planned.covered_share, " %; ", 0);
    if (std::isfinite(loss.sigma_mm))
      text << "sigma " << shown(loss.sigma_mm, " mm", 3) << ", unnoticed " << shown(loss.hidden_mm, " mm", 3);
    else
      text << "no pose";
    if (loss.verdict.code != Code::ok)
      text << ": not published, code " << static_cast<int>(loss.verdict.code) << " (" << loss.verdict.reason
           << ")";
    text << "\n";
  }
}

void print_recovery(std::ostream& text, const Cell& cell, const Plan& plan) {
  if (cell.references.views.empty()) return;
  text << "reference points: how well the pose of a camera that was moved is found again, sigma\n";
  for (const PlannedCamera& planned : plan.cameras) {
    const PlannedRecovery& recovery = planned.recovery;
    text << "  " << cell.calibration[planned.camera].name << ": " << recovery.points << " points, ";
    if (recovery.reason.empty())
      text << shown(recovery.sigma_mm, " mm", 3) << ", " << shown(recovery.sigma_deg, " deg", 4) << "\n";
    else
      text << "not at all: " << recovery.reason << "\n";
  }
}

std::string plan_text(const Cell& cell, const Job& job, const Plan& plan) {
  std::ostringstream text;
  if (!plan.points.empty()) print_pose(text, plan);
  print_views(text, cell, job, plan);
  print_cameras(text, cell, plan);
  print_recovery(text, cell, plan);
  text << "worst point: sigma " << shown(plan.sigma_mm, " mm", 3) << ", by one wrong mark unnoticed "
       << shown(plan.hidden_mm, " mm", 3) << "\n";
  if (plan.verdict.code != Code::ok)
    text << "no answer: code " << static_cast<int>(plan.verdict.code) << " "
         << text_of(plan.verdict.code).name << ": " << plan.verdict.reason << "\n";
  return text.str();
}

Answer plan_of(const Options& options) {
  Cell cell = load_cell(options.cell);
  const Job& job = job_of(cell, options.job);
  if (job.gaps || job.wheel)
    return failure(concat({"job ", job.name, job.gaps ? " evens gaps" : " measures a wheel",
                           ": it has no marks to plan with"}));
  cell.calibration = cameras_for(cell, job);
  const Plan result = plan({cell.calibration, job, options.sigma_px, &cell.references});
  return {result.verdict.code == Code::ok ? done : no_answer, plan_json(cell, job, result),
          plan_text(cell, job, result)};
}

}  // namespace

void add_plan(cli::Verb app, int& exit_status) {
  auto options = std::make_shared<Options>();
  const Verb verb = app.add_subcommand("plan", "What accuracy a cell's cameras and marks will give");
  verb.add_option("--cell", options->cell, "the cell file").required();
  verb.add_option("--job", options->job, "name of the job (the first)");
  verb.add_option("--sigma-px", options->sigma_px, "of a found mark, per axis, px (0.02)").range(1e-6, 100.0);
  verb.add_flag(
      "--json", options->json,
      "one JSON object on stdout: status, reason, code, job, sigma (mm, degrees), sigma_mm, hidden_mm,\n"
      "points, weak_directions, views, cameras; null: no limit");
  verb.footer(plan_help);
  verb.callback(
      [options, &exit_status] { exit_status = run([&] { return plan_of(*options); }, options->json); });
}

}  // namespace zeropose
