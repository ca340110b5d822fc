#include "config/calibration_page.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include "calib/comparison.h"
#include "calib/data_sheet.h"
#include "calib/verdict.h"
#include "config/calibration_plots.h"
#include "config/calibration_rows.h"
#include "config/svg.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr double page_width = 210, page_height = 297, margin = 14, inner = page_width - 2 * margin;
constexpr std::string_view dark = "#1c2430", soft = "#5b6675", rule = "#dde2e9", red = "#c62828";
constexpr std::size_t most_listed = 1000;

std::string_view colour_of(Quality quality) {
  switch (quality) {
    case Quality::good:
      return "#2e7d32";
    case Quality::usable:
      return "#b26a00";
    default:
      return red;
  }
}

// Lines of at most so many letters, broken at blanks.
std::vector<std::string> wrapped(const std::string& text, std::size_t letters) {
  std::istringstream words(text);
  std::vector<std::string> lines{""};
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > letters) lines.emplace_back();
    lines.back() += lines.back().empty() ? word : concat({" ", word});
  }
  return lines;
}

// Draws from top to bottom and remembers how far it came.
class Page {
 public:
  explicit Page(const CalibrationReport& report) : report_(report) {}

  std::string draw() {
    draw_header();
    draw_verdict();
    const double top = y_;
    draw_parameters();
    const double left_end = y_;
    y_ = top;
    draw_data_sheet();
    draw_comparison();
    y_ = std::max(y_, left_end) + 9;
    draw_plots();
    draw_notes();
    draw_list();
    return svg_.page(page_width, std::max(page_height, std::ceil(y_ + margin)));
  }

 private:
  void draw_header() {
    y_ = margin + 4;
    const std::string name = report_.name.empty() ? "" : concat({" ", report_.name});
    svg_.text(margin, y_, concat({"Camera calibration", name}), {.size_mm = 6, .bold = true});
    const auto used = std::count_if(report_.result.deviations.begin(), report_.result.deviations.end(),
                                    [](const auto& deviation) { return deviation.used; });
    const bool division = std::holds_alternative<Division>(report_.result.model.distortion);
    y_ += 5.5;
    svg_.text(margin, y_,
              concat({"Image ", std::to_string(report_.problem.width_px), " x ",
                      std::to_string(report_.problem.height_px), " px, ",
                      division ? "division model (K)" : "Brown-Conrady model (k1 k2 p1 p2 k3)", ", ",
                      std::to_string(used), " of ", std::to_string(report_.problem.points.size()),
                      " points used. ", report_.source}),
              {.size_mm = 2.8, .colour = soft});
    y_ += 4;
  }

  void draw_verdict() {
    const CalibrationVerdict verdict = judge(report_.problem, report_.result, report_.further_unknowns);
    const double top = y_;
    struct Line {
      std::string text;
      std::optional<Quality> mark;  // before the first line of a finding
    };
    std::vector<Line> lines;
    for (const Finding& finding : verdict.findings) {
      std::optional<Quality> mark = finding.quality;
      for (std::string& line : wrapped(finding.text, 112))
        lines.push_back({std::move(line), std::exchange(mark, std::nullopt)});
    }
    const double height = 9 + 4 * static_cast<double>(lines.size());
    svg_.rectangle(margin, top, inner, height, {.fill = colour_of(verdict.quality), .opacity = 0.08});
    svg_.rectangle(margin, top, 1.6, height, {.fill = colour_of(verdict.quality)});
    svg_.text(margin + 5, top + 5.6, verdict.summary,
              {.size_mm = 3.6, .colour = colour_of(verdict.quality), .bold = true});
    y_ = top + 10.2;
    for (const Line& line : lines) {
      if (line.mark) svg_.circle(margin + 6, y_ - 0.9, 0.8, {.fill = colour_of(*line.mark)});
      svg_.text(margin + 8.5, y_, line.text, {.size_mm = 2.7});
      y_ += 4;
    }
    y_ = top + height + 8;
  }

  // Numbers end at these places, words begin there.
  void draw_row(std::initializer_list<std::pair<double, std::string>> cells, bool head,
                std::string_view colour = dark) {
    std::size_t column = 0;
    for (const auto& [x, words] : cells)
      svg_.text(x, y_, words,
                {.size_mm = head ? 2.5 : 2.8,
                 .colour = head ? soft : colour,
                 .anchor = column++ == 0 ? "start" : "end"});
    y_ += head ? 1.3 : 4.1;
    if (!head) return;
    y_ += 3.2;
  }

  void draw_parameters() {
    svg_.text(margin, y_, "Parameters", {.size_mm = 3.2, .bold = true});
    y_ += 5;
    const bool compared = report_.active.has_value();
    draw_row({{margin, ""},
              {margin + 38, "value"},
              {margin + 58, "1 sigma"},
              {margin + 82, compared ? "active" : ""},
              {margin + 104, compared ? "difference" : ""}},
             true);
    svg_.line(margin, y_ - 3.4, margin + (compared ? 104 : 58), y_ - 3.4, {.stroke = rule, .width_mm = 0.3});
    for (const ParameterRow& row :
         parameter_rows(report_.result, report_.frame_offset_z_mm, report_.active)) {
      const std::string unit = row.unit.empty() ? "" : concat({" ", row.unit});
      draw_row({{margin, concat({name_of(row.parameter), unit})},
                {margin + 38, fixed_text(row.value, row.decimals)},
                {margin + 58, row.sigma < 0 ? "-" : fixed_text(row.sigma, row.decimals)},
                {margin + 82, row.active ? fixed_text(*row.active, row.decimals) : ""},
                {margin + 104, row.active ? fixed_text(row.value - *row.active, row.decimals) : ""}},
               false);
    }
    svg_.text(margin, y_, "x y z rx ry rz: the pose of the camera, X_WC. \"-\": held or not estimated.",
              {.size_mm = 2.3, .colour = soft});
    if (report_.frame_offset_z_mm == 0) return;
    y_ += 3.4;
    svg_.text(margin, y_,
              concat({"The camera's frame is moved by ", fixed_text(report_.frame_offset_z_mm, 3),
                      " mm along its z axis."}),
              {.size_mm = 2.3, .colour = red});
  }

  static constexpr double right = margin + 116, right_end = page_width - margin;

  void draw_data_sheet() {
    svg_.text(right, y_, "As a data sheet states it", {.size_mm = 3.2, .bold = true});
    y_ += 5;
    if (!(report_.sy_mm > 0)) {
      svg_.text(right, y_, "The pixel pitch was not given.", {.size_mm = 2.6, .colour = soft});
      y_ += 4.1;
      svg_.text(right, y_, "Only fx and fy can be estimated.", {.size_mm = 2.6, .colour = soft});
      y_ += 8;
      return;
    }
    const DataSheet sheet = data_sheet(report_.result.model, report_.sy_mm);
    draw_row({{right, "focal length f"}, {right_end, concat({fixed_text(sheet.f_mm, 3), " mm"})}}, false);
    draw_row({{right, "pixel pitch Sx"}, {right_end, concat({fixed_text(sheet.sx_mm * 1e3, 4), " µm"})}},
             false);
    draw_row({{right, "pixel pitch Sy"}, {right_end, concat({fixed_text(sheet.sy_mm * 1e3, 4), " µm"})}},
             false);
    if (std::holds_alternative<Division>(report_.result.model.distortion))
      draw_row({{right, "k = K / f²"}, {right_end, concat({fixed_text(sheet.k_per_mm2, 7), " /mm²"})}},
               false);
    draw_row({{right, "origin from centre"},
              {right_end, concat({fixed_text(sheet.origin_from_centre_px.x(), 2), ", ",
                                  fixed_text(sheet.origin_from_centre_px.y(), 2), " px"})}},
             false);
    y_ += 4.5;
  }

  void draw_comparison() {
    svg_.text(right, y_, "Against the active calibration", {.size_mm = 3.2, .bold = true});
    y_ += 5;
    if (!report_.active) {
      svg_.text(right, y_, "None was given to compare with.", {.size_mm = 2.6, .colour = soft});
      y_ += 4.1;
      return;
    }
    const Coverage coverage = coverage_of(report_.problem, report_.result);
    const double depth_mm = (coverage.depth_min_mm + coverage.depth_max_mm) / 2;
    const CameraComparison comparison =
        compare(*report_.active, {report_.name, report_.result.model, report_.result.X_WC}, depth_mm);
    constexpr std::string_view places[] = {"top left", "top right", "bottom right", "bottom left", "centre"};
    draw_row({{right, "px shift at"}, {right + 44, "internals"}, {right_end, "with pose"}}, true);
    svg_.line(right, y_ - 3.4, right_end, y_ - 3.4, {.stroke = rule, .width_mm = 0.3});
    const auto shift_text = [](const std::optional<Eigen::Vector2d>& shift_px) {
      return shift_px ? fixed_text(shift_px->norm(), 2) : std::string("no image");
    };
    for (std::size_t i = 0; i < comparison.shifts.size(); ++i)
      draw_row({{right, std::string(places[i])},
                {right + 44, shift_text(comparison.shifts[i].internals_px)},
                {right_end, shift_text(comparison.shifts[i].camera_px)}},
               false);
    draw_row({{right, "camera moved"}, {right_end, concat({fixed_text(comparison.moved_mm, 3), " mm"})}},
             false);
    draw_row({{right, "camera turned"}, {right_end, concat({fixed_text(comparison.turned_deg, 4), " deg"})}},
             false);
    for (const std::string& line : wrapped(
             concat(
                 {"With pose: of points ", fixed_text(depth_mm, 0),
                  " mm away. Where this is small against the shift of the internals, the pose makes up for "
                  "them."}),
             52)) {
      svg_.text(right, y_, line, {.size_mm = 2.3, .colour = soft});
      y_ += 3.2;
    }
  }

  void draw_plots() {
    const double room = 74;
    const PlotFrame image = image_frame({margin + 10, y_, 92, room}, report_.problem);
    draw_quiver(svg_, image, report_.problem, report_.result);
    draw_histogram(svg_, {margin + 120, y_, inner - 120, 28}, report_.result);
    draw_depths(svg_, {margin + 120, y_ + 45, inner - 120, 20}, report_.result);
    y_ += std::max(image.height, 65.0) + 17;
  }

  void draw_notes() {
    const double top = y_;
    const PlotFrame image = image_frame({margin, y_, 66, 42}, report_.problem);
    draw_coverage(svg_, image, report_.problem, coverage_of(report_.problem, report_.result));
    const double x = margin + 76;
    y_ = top - 2;
    svg_.text(x, y_, "Steps", {.size_mm = 3.2, .bold = true});
    y_ += 4.2;
    for (const CalibrationStep& step : report_.result.steps)
      note(x,
           concat({step.name, step.detail.empty() ? "" : ": ", step.detail, " (RMS ",
                   fixed_text(step.rms_px, 3), " px)"}),
           dark);
    for (const auto& [limit, unit] :
         {std::pair(report_.problem.reject_px, " px"), {report_.problem.reject_mm, " mm"}})
      if (limit > 0)
        note(x, concat({"Points that deviate by more than ", number_text(limit), unit, " are rejected."}),
             soft);
    note(x, concat({"Condition of the normal equations: ", number_text(report_.result.diagnosis.condition)}),
         soft);
    y_ += 3;
    svg_.text(x, y_, "Warnings", {.size_mm = 3.2, .bold = true});
    y_ += 4.2;
    for (const std::string& warning : report_.result.diagnosis.warnings) note(x, warning, "#b26a00");
    if (report_.result.diagnosis.warnings.empty()) note(x, "none", soft);
    y_ = std::max(y_, top + image.height) + 12;
  }

  static std::string number_text(double value) {
    std::ostringstream text;
    text.precision(3);
    text << value;
    return text.str();
  }

  void note(double x, const std::string& text, std::string_view colour) {
    for (const std::string& line : wrapped(text, 68)) {
      svg_.text(x, y_, line, {.size_mm = 2.6, .colour = colour});
      y_ += 3.7;
    }
  }

  // Every point in two columns, rejected ones in red; of very many the worst.
  void draw_list() {
    const auto& deviations = report_.result.deviations;
    std::vector<std::size_t> order(std::min(deviations.size(), report_.problem.points.size()));
    std::iota(order.begin(), order.end(), std::size_t{0});
    const bool all = order.size() <= most_listed;
    if (!all) {
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return deviations[a].dev_px.norm() > deviations[b].dev_px.norm();
      });
      order.resize(most_listed);
    }
    constexpr double row_height = 3.3;
    begin_list(all);
    double top = y_;
    for (std::size_t next = 0; next < order.size();) {
      double page_end = std::ceil(top / page_height) * page_height - margin;
      const auto rows_left = static_cast<std::size_t>(std::max(0.0, (page_end - top - 5) / row_height));
      const std::size_t rest = order.size() - next, rows = std::min(rows_left, (rest + 1) / 2);
      if (rows > 2 || rest <= 2 * rows_left) {
        for (const double x : {margin, margin + inner / 2 + 3.0})
          next = draw_column(x, top, order, next, rows);
        y_ = top + 5 + row_height * static_cast<double>(rows);
      }
      top = page_end + 2 * margin;
    }
  }

  void begin_list(bool all) {
    const double left_on_page = std::ceil(y_ / page_height) * page_height - margin - y_;
    if (left_on_page < 25) y_ = std::ceil(y_ / page_height) * page_height + margin + 4;
    svg_.text(margin, y_,
              all ? "Deviations of all points, found minus projected"
                  : "Deviations of the 1000 worst points, found minus projected",
              {.size_mm = 3.2, .bold = true});
    svg_.text(page_width - margin, y_, "mm: at the point's distance. Red: rejected.",
              {.size_mm = 2.4, .colour = soft, .anchor = "end"});
    y_ += 5;
  }

  std::size_t draw_column(double x, double top, const std::vector<std::size_t>& order, std::size_t next,
                          std::size_t rows) {
    constexpr double ends[] = {6, 18, 30, 42, 54, 65, 77, 88};
    constexpr std::string_view heads[] = {"no.",      "u px",    "v px", "dev u px",
                                          "dev v px", "size px", "u mm", "v mm"};
    if (next >= order.size()) return next;
    for (std::size_t i = 0; i < 8; ++i)
      svg_.text(x + ends[i], top, heads[i], {.size_mm = 2.2, .colour = soft, .anchor = "end"});
    svg_.line(x, top + 1.1, x + ends[7], top + 1.1, {.stroke = rule, .width_mm = 0.3});
    double y = top + 4.4;
    for (std::size_t row = 0; row < rows && next < order.size(); ++row, ++next, y += 3.3) {
      const std::size_t i = order[next];
      const CalibrationDeviation& deviation = report_.result.deviations[i];
      const Eigen::Vector2d& u_px = report_.problem.points[i].u_px;
      const std::string cells[] = {std::to_string(i + 1),
                                   fixed_text(u_px.x(), 2),
                                   fixed_text(u_px.y(), 2),
                                   fixed_text(deviation.dev_px.x(), 3),
                                   fixed_text(deviation.dev_px.y(), 3),
                                   fixed_text(deviation.dev_px.norm(), 3),
                                   fixed_text(deviation.dev_mm.x(), 3),
                                   fixed_text(deviation.dev_mm.y(), 3)};
      for (std::size_t cell = 0; cell < 8; ++cell)
        svg_.text(x + ends[cell], y, cells[cell],
                  {.size_mm = 2.3, .colour = deviation.used ? dark : red, .anchor = "end"});
    }
    return next;
  }

  const CalibrationReport& report_;
  Svg svg_;
  double y_ = 0;
};

}  // namespace

std::string calibration_page(const CalibrationReport& report) { return Page(report).draw(); }

}  // namespace zeropose
