#include "daemon/cli/calibration_answer.h"

#include <algorithm>
#include <sstream>

#include "calib/comparison.h"
#include "calib/data_sheet.h"
#include "calib/verdict.h"
#include "config/calibration_rows.h"
#include "config/cameras.h"
#include "config/svg.h"
#include "config/text.h"

namespace zeropose {
namespace {

using namespace cli;

Json data_sheet_json(const CameraModel& model, double pitch_mm) {
  const DataSheet sheet = data_sheet(model, pitch_mm);
  return {{"f", sheet.f_mm},
          {"Sx", sheet.sx_mm},
          {"Sy", sheet.sy_mm},
          {"k", sheet.k_per_mm2},
          {"origin_from_centre", json_of(sheet.origin_from_centre_px)}};
}

Json deviations_json(const CalibrationReport& report) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < report.result.deviations.size(); ++i) {
    const CalibrationDeviation& deviation = report.result.deviations[i];
    deviations.push_back({{"u_px", report.problem.points[i].u_px.x()},
                          {"v_px", report.problem.points[i].u_px.y()},
                          {"dev_px", json_of(deviation.dev_px)},
                          {"dev_mm", json_of(deviation.dev_mm)},
                          {"depth_mm", deviation.depth_mm},
                          {"used", deviation.used}});
  }
  return deviations;
}

Json verdict_json(const CalibrationVerdict& verdict) {
  Json findings = Json::array();
  for (const Finding& finding : verdict.findings)
    findings.push_back({{"quality", name_of(finding.quality)}, {"text", finding.text}});
  return {{"quality", name_of(verdict.quality)}, {"summary", verdict.summary}, {"findings", findings}};
}

Json coverage_json(const Coverage& coverage) {
  return {{"image_area", coverage.area},
          {"reach", coverage.reach},
          {"depth_min_mm", coverage.depth_min_mm},
          {"depth_max_mm", coverage.depth_max_mm}};
}

Json comparison_json(const CalibrationReport& report) {
  const Coverage coverage = coverage_of(report.problem, report.result);
  const double depth_mm = (coverage.depth_min_mm + coverage.depth_max_mm) / 2;
  const CameraComparison comparison =
      compare(*report.active, {"", report.result.model, report.result.X_WC}, depth_mm);
  Json json = {{"depth_mm", depth_mm},
               {"worst_internals_px", comparison.worst_internals_px},
               {"worst_camera_px", comparison.worst_camera_px},
               {"moved_mm", comparison.moved_mm},
               {"turned_deg", comparison.turned_deg}};
  for (const ParameterRow& row : parameter_rows(report.result, 0, report.active))
    if (row.active) json["difference"][std::string(name_of(row.parameter))] = row.difference;
  for (const PixelShift& shift : comparison.shifts)
    json["shifts"].push_back({{"at_px", json_of(shift.at_px)},
                              {"internals_px", shift.internals_px ? json_of(*shift.internals_px) : Json()},
                              {"camera_px", shift.camera_px ? json_of(*shift.camera_px) : Json()}});
  return json;
}

Json diagnosis_json(const CalibrationDiagnosis& diagnosis) {
  return {
      {"condition", diagnosis.condition}, {"coplanar", diagnosis.coplanar}, {"warnings", diagnosis.warnings}};
}

Json steps_json(const CalibrationResult& result) {
  Json steps = Json::array();
  for (const CalibrationStep& step : result.steps)
    steps.push_back({{"name", step.name}, {"detail", step.detail}, {"rms_px", step.rms_px}});
  return steps;
}

void print_parameters(std::ostream& text, const CalibrationReport& report, bool rad) {
  const CalibrationResult& result = report.result;
  text << "parameter          value      1 sigma" << (report.active ? "       active   difference" : "")
       << "\n";
  for (const ParameterRow& row : parameter_rows(result, report.frame_offset_z_mm, report.active)) {
    const bool angle = row.unit == "deg";
    const double unit = angle && rad ? 1 / degrees_per_radian : 1;
    const int digits = row.decimals + (angle && rad ? 2 : 0);
    const auto cell = [&](double value) { text << std::setw(13) << fixed_text(value * unit, digits); };
    text << std::left << std::setw(11)
         << concat({name_of(row.parameter), " ", angle && rad ? "rad" : row.unit}) << std::right;
    cell(row.value);
    if (row.sigma < 0)
      text << std::setw(13) << "held";
    else
      cell(row.sigma);
    if (row.active) {
      cell(*row.active);
      cell(row.difference);
    }
    text << "\n";
  }
  text << "X_CW, mm and degrees:\n"
       << table_of(six_of(with_frame_offset(result.X_WC, report.frame_offset_z_mm).inverse())) << "\n";
  if (report.frame_offset_z_mm != 0)
    text << "The camera's frame is moved by " << report.frame_offset_z_mm
         << " mm along its z axis: not for measuring.\n";
  if (!(report.sy_mm > 0)) return;
  const DataSheet sheet = data_sheet(result.model, report.sy_mm);
  text << "data sheet: f " << fixed_text(sheet.f_mm, 3) << " mm, Sx " << fixed_text(sheet.sx_mm, 6)
       << " mm, Sy " << fixed_text(sheet.sy_mm, 6) << " mm, k " << fixed_text(sheet.k_per_mm2, 7)
       << " /mm^2, origin from the centre " << fixed_text(sheet.origin_from_centre_px.x(), 2) << ", "
       << fixed_text(sheet.origin_from_centre_px.y(), 2) << " px\n";
}

void print_worst_points(std::ostream& text, const CalibrationReport& report) {
  std::vector<std::size_t> order(report.result.deviations.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return report.result.deviations[a].dev_px.norm() > report.result.deviations[b].dev_px.norm();
  });
  text << "worst points: no., u v, deviation in u v, px, in x y, mm\n";
  for (std::size_t i = 0; i < std::min<std::size_t>(5, order.size()); ++i) {
    const CalibrationDeviation& deviation = report.result.deviations[order[i]];
    text << std::setw(5) << order[i] + 1 << table_of({report.problem.points[order[i]].u_px.data(), 2}, 2)
         << table_of({deviation.dev_px.data(), 2}, 3) << table_of({deviation.dev_mm.data(), 2}, 3)
         << (deviation.used ? "" : "  rejected") << "\n";
  }
}

}  // namespace

Json cli::sigma_json(const ReportedUncertainty& uncertainty) {
  Json sigma = Json::object();
  for (std::size_t i = 0; i < uncertainty.parameters.size(); ++i)
    sigma[std::string(name_of(uncertainty.parameters[i]))] = uncertainty.sigma(static_cast<Eigen::Index>(i));
  return sigma;
}

Json cli::correlation_json(const ReportedUncertainty& uncertainty) {
  Json correlation = Json::object();
  const auto& names = uncertainty.parameters;
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < names.size(); ++j)
      correlation[std::string(name_of(names[i]))][std::string(name_of(names[j]))] =
          uncertainty.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  return correlation;
}

Json cli::calibration_json(const CalibrationReport& report) {
  const Pose X_WC = with_frame_offset(report.result.X_WC, report.frame_offset_z_mm);
  Json json = {{"status", "ok"}, {"reason", ""}};
  json["camera"] = Json::parse(camera_text({"", report.result.model, X_WC}));
  json["X_CW"] = six_of(X_WC.inverse());
  json["frame_offset_z_mm"] = report.frame_offset_z_mm;
  if (report.sy_mm > 0) json["data_sheet"] = data_sheet_json(report.result.model, report.sy_mm);
  const ReportedUncertainty uncertainty =
      reported_uncertainty(report.result.uncertainty, report.result.X_WC, report.frame_offset_z_mm);
  json["sigma"] = sigma_json(uncertainty);
  json["correlation"] = correlation_json(uncertainty);
  json["sigma_px"] = report.result.sigma_px;
  json["rms_px"] = report.result.rms_px;
  json["residual_sum"] = report.result.residual_sum;
  json["verdict"] = verdict_json(judge(report.problem, report.result, report.further_unknowns));
  json["coverage"] = coverage_json(coverage_of(report.problem, report.result));
  if (report.active) json["comparison"] = comparison_json(report);
  json["deviations"] = deviations_json(report);
  json["steps"] = steps_json(report.result);
  json["diagnosis"] = diagnosis_json(report.result.diagnosis);
  return json;
}

std::string cli::calibration_text(const CalibrationReport& report, bool rad) {
  const CalibrationResult& result = report.result;
  std::ostringstream text;
  const CalibrationVerdict verdict = judge(report.problem, result, report.further_unknowns);
  text << verdict.summary << "\n";
  for (const Finding& finding : verdict.findings)
    text << "  " << std::left << std::setw(11) << name_of(finding.quality) << std::right << finding.text
         << "\n";
  for (const std::string& warning : result.diagnosis.warnings) text << "warning: " << warning << "\n";
  text << "\n";
  print_parameters(text, report, rad);
  text << "\nsteps:\n";
  for (const CalibrationStep& step : result.steps)
    text << "  " << step.name << (step.detail.empty() ? "" : ": ") << step.detail << ", RMS "
         << fixed_text(step.rms_px, 4) << " px\n";
  print_worst_points(text, report);
  return text.str();
}

Answer cli::calibration_failure(const CalibrationResult& result) {
  Answer answer = failure(concat({name_of(result.status), ": ", result.reason}));
  answer.json["diagnosis"] = diagnosis_json(result.diagnosis);
  answer.json["steps"] = steps_json(result);
  return answer;
}

}  // namespace zeropose
