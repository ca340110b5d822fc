#include "config/calibration_page.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "calib/comparison.h"
#include "calib/data_sheet.h"
#include "calib/verdict.h"
#include "config/calibration_plots.h"
#include "config/calibration_rows.h"
#include "config/point_sections.h"
#include "config/report_sheet.h"
#include "config/text.h"

namespace zeropose {
namespace {

class Page {
 public:
  explicit Page(const CalibrationReport& report) : report_(report) {}

  std::string draw() {
    draw_header();
    const CalibrationVerdict verdict = judge(report_.problem, report_.result, report_.further_unknowns);
    sheet_.banner(verdict.quality, verdict.summary, verdict.findings);
    const double top = sheet_.y;
    draw_parameters();
    const double left_end = sheet_.y;
    sheet_.y = top;
    draw_data_sheet();
    draw_comparison();
    sheet_.y = std::max(sheet_.y, left_end) + 9;
    draw_point_plots(sheet_, report_.problem, report_.result);
    draw_notes();
    sheet_.list(list_of_points(report_.problem, report_.result));
    return sheet_.page();
  }

 private:
  static constexpr double margin = ReportSheet::margin, right = ReportSheet::right,
                          right_end = ReportSheet::right_end;

  void draw_header() {
    const auto used = std::count_if(report_.result.deviations.begin(), report_.result.deviations.end(),
                                    [](const auto& deviation) { return deviation.used; });
    const bool division = std::holds_alternative<Division>(report_.result.model.distortion);
    sheet_.title(concat({"Camera calibration", report_.name.empty() ? "" : ": ", report_.name}),
                 concat({"Image ", std::to_string(report_.problem.width_px), " x ",
                         std::to_string(report_.problem.height_px), " px, ",
                         division ? "division model (K)" : "Brown-Conrady model (k1 k2 p1 p2 k3)", ", ",
                         std::to_string(used), " of ", std::to_string(report_.problem.points.size()),
                         " points used. ", report_.source}));
  }

  void draw_parameters() {
    sheet_.heading(margin, "Parameters");
    std::vector<ValueRow> rows;
    for (const ParameterRow& row : parameter_rows(report_.result, report_.frame_offset_z_mm, report_.active))
      rows.push_back({concat({name_of(row.parameter), row.unit.empty() ? "" : " ", row.unit}), row.decimals,
                      row.value, row.sigma, row.active, row.difference});
    sheet_.values(margin, rows);
    sheet_.note(
        margin,
        concat({"x y z rx ry rz: the pose of the camera, ", report_.pose, ". \"-\": held or not estimated."}),
        100, ReportSheet::soft, 2.3);
    if (report_.frame_offset_z_mm == 0) return;
    sheet_.note(margin,
                concat({"The camera's frame is moved by ", fixed_text(report_.frame_offset_z_mm, 3),
                        " mm along its z axis."}),
                100, ReportSheet::red, 2.3);
  }

  void draw_data_sheet() {
    sheet_.heading(right, "As a data sheet states it");
    if (!(report_.sy_mm > 0)) {
      sheet_.note(right, "The pixel pitch was not given. Only fx and fy can be estimated.", 34);
      sheet_.y += 4;
      return;
    }
    const DataSheet sheet = data_sheet(report_.result.model, report_.sy_mm);
    sheet_.row({{right, "focal length f"}, {right_end, concat({fixed_text(sheet.f_mm, 3), " mm"})}});
    sheet_.row({{right, "pixel pitch Sx"}, {right_end, concat({fixed_text(sheet.sx_mm * 1e3, 4), " µm"})}});
    sheet_.row({{right, "pixel pitch Sy"}, {right_end, concat({fixed_text(sheet.sy_mm * 1e3, 4), " µm"})}});
    if (std::holds_alternative<Division>(report_.result.model.distortion))
      sheet_.row({{right, "k = K / f²"}, {right_end, concat({fixed_text(sheet.k_per_mm2, 7), " /mm²"})}});
    sheet_.row({{right, "origin from centre"},
                {right_end, concat({fixed_text(sheet.origin_from_centre_px.x(), 2), ", ",
                                    fixed_text(sheet.origin_from_centre_px.y(), 2), " px"})}});
    sheet_.y += 4.5;
  }

  void draw_comparison() {
    sheet_.heading(right, "Against the active calibration");
    if (!report_.active) {
      sheet_.note(right, "None was given to compare with.", 52);
      return;
    }
    const Coverage coverage = coverage_of(report_.problem, report_.result);
    const double depth_mm = (coverage.depth_min_mm + coverage.depth_max_mm) / 2;
    const CameraComparison comparison =
        compare(*report_.active, {report_.name, report_.result.model, report_.result.X_WC}, depth_mm);
    constexpr std::string_view places[] = {"top left", "top right", "bottom right", "bottom left", "centre"};
    sheet_.head(right, right_end,
                {{right, "px shift at"}, {right + 44, "internals"}, {right_end, "with pose"}});
    const auto shift_text = [](const std::optional<Eigen::Vector2d>& shift_px) {
      return shift_px ? fixed_text(shift_px->norm(), 2) : std::string("no image");
    };
    for (std::size_t i = 0; i < comparison.shifts.size(); ++i)
      sheet_.row({{right, std::string(places[i])},
                  {right + 44, shift_text(comparison.shifts[i].internals_px)},
                  {right_end, shift_text(comparison.shifts[i].camera_px)}});
    sheet_.row({{right, "camera moved"}, {right_end, concat({fixed_text(comparison.moved_mm, 3), " mm"})}});
    sheet_.row(
        {{right, "camera turned"}, {right_end, concat({fixed_text(comparison.turned_deg, 4), " deg"})}});
    sheet_.note(right,
                concat({"With pose: of points ", fixed_text(depth_mm, 0),
                        " mm away. Where this is small against the shift of the internals, the pose makes up "
                        "for them."}),
                52, ReportSheet::soft, 2.3);
  }

  void draw_notes() {
    const double top = sheet_.y, x = margin + 76;
    const PlotFrame image = image_frame({margin, top, 66, 42}, report_.problem);
    draw_coverage(sheet_.svg, image, report_.problem, coverage_of(report_.problem, report_.result));
    sheet_.y = top - 2;
    sheet_.heading(x, "Steps");
    for (const CalibrationStep& step : report_.result.steps)
      sheet_.note(x,
                  concat({step.name, step.detail.empty() ? "" : ": ", step.detail, " (RMS ",
                          fixed_text(step.rms_px, 3), " px)"}),
                  68, ReportSheet::dark);
    for (const auto& [limit, unit] :
         {std::pair(report_.problem.reject_px, " px"), {report_.problem.reject_mm, " mm"}})
      if (limit > 0)
        sheet_.note(
            x, concat({"Points that deviate by more than ", number_text(limit), unit, " are rejected."}), 68);
    sheet_.note(
        x, concat({"Condition of the normal equations: ", number_text(report_.result.diagnosis.condition)}),
        68);
    sheet_.y += 3;
    sheet_.heading(x, "Warnings");
    for (const std::string& warning : report_.result.diagnosis.warnings)
      sheet_.note(x, warning, 68, ReportSheet::amber);
    if (report_.result.diagnosis.warnings.empty()) sheet_.note(x, "none", 68);
    sheet_.y = std::max(sheet_.y, top + image.height) + 12;
  }

  static std::string number_text(double value) {
    std::ostringstream text;
    text.precision(3);
    text << value;
    return text.str();
  }

  const CalibrationReport& report_;
  ReportSheet sheet_;
};

}  // namespace

std::string calibration_page(const CalibrationReport& report) { return Page(report).draw(); }

}  // namespace zeropose
