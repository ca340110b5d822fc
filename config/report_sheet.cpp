#include "config/report_sheet.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::string_view rule = "#dde2e9";
constexpr double row_height = 3.3;

std::string_view colour_of(Quality quality) {
  switch (quality) {
    case Quality::good:
      return "#2e7d32";
    case Quality::usable:
      return ReportSheet::amber;
    default:
      return ReportSheet::red;
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

// Of the page that this height is on.
double page_end(double y) {
  return std::ceil(y / ReportSheet::height) * ReportSheet::height - ReportSheet::margin;
}

}  // namespace

void ReportSheet::title(const std::string& words, const std::string& below) {
  svg.text(margin, y + 4, words, {.size_mm = 6, .bold = true});
  y += 9.5;
  note(margin, below, 118, soft, 2.8);
  y += 0.3;
}

void ReportSheet::banner(Quality quality, const std::string& summary, const std::vector<Finding>& findings) {
  struct Line {
    std::string text;
    std::optional<Quality> mark;  // before the first line of a finding
  };
  std::vector<Line> lines;
  for (const Finding& finding : findings) {
    std::optional<Quality> mark = finding.quality;
    for (std::string& line : wrapped(finding.text, 112))
      lines.push_back({std::move(line), std::exchange(mark, std::nullopt)});
  }
  const double top = y, high = 9 + 4 * static_cast<double>(lines.size());
  svg.rectangle(margin, top, inner, high, {.fill = colour_of(quality), .opacity = 0.08});
  svg.rectangle(margin, top, 1.6, high, {.fill = colour_of(quality)});
  svg.text(margin + 5, top + 5.6, summary, {.size_mm = 3.6, .colour = colour_of(quality), .bold = true});
  y = top + 10.2;
  for (const Line& line : lines) {
    if (line.mark) svg.circle(margin + 6, y - 0.9, 0.8, {.fill = colour_of(*line.mark)});
    svg.text(margin + 8.5, y, line.text, {.size_mm = 2.7});
    y += 4;
  }
  y = top + high + 8;
}

void ReportSheet::heading(double x, const std::string& words) {
  svg.text(x, y, words, {.size_mm = 3.2, .bold = true});
  y += 5;
}

void ReportSheet::cells(std::initializer_list<std::pair<double, std::string>> cells, double size_mm,
                        std::string_view colour) {
  std::size_t column = 0;
  for (const auto& [x, words] : cells)
    svg.text(x, y, words, {.size_mm = size_mm, .colour = colour, .anchor = column++ == 0 ? "start" : "end"});
}

void ReportSheet::row(std::initializer_list<std::pair<double, std::string>> places) {
  cells(places, 2.8, dark);
  y += 4.1;
}

void ReportSheet::head(double x, double x_end, std::initializer_list<std::pair<double, std::string>> places) {
  cells(places, 2.5, soft);
  svg.line(x, y + 1.1, x_end, y + 1.1, {.stroke = rule, .width_mm = 0.3});
  y += 4.5;
}

void ReportSheet::values(double x, const std::vector<ValueRow>& rows) {
  const bool compared = std::ranges::any_of(rows, [](const ValueRow& row) { return row.active.has_value(); });
  head(x, x + (compared ? 104 : 58),
       {{x, ""},
        {x + 38, "value"},
        {x + 58, "1 sigma"},
        {x + 82, compared ? "active" : ""},
        {x + 104, compared ? "difference" : ""}});
  for (const ValueRow& value : rows)
    row({{x, value.name},
         {x + 38, fixed_text(value.value, value.decimals)},
         {x + 58, value.sigma < 0 ? "-" : fixed_text(value.sigma, value.decimals)},
         {x + 82, value.active ? fixed_text(*value.active, value.decimals) : ""},
         {x + 104, value.active ? fixed_text(value.difference, value.decimals) : ""}});
}

void ReportSheet::note(double x, const std::string& words, std::size_t letters, std::string_view colour,
                       double size_mm) {
  for (const std::string& line : wrapped(words, letters)) {
    svg.text(x, y, line, {.size_mm = size_mm, .colour = colour});
    y += 1.42 * size_mm;
  }
}

void ReportSheet::keep(double height_mm) {
  if (page_end(y) - y < height_mm) y = page_end(y) + 2 * margin + 4;
}

// In columns beside each other, page after page.
void ReportSheet::list(const ReportList& list) {
  keep(25);
  svg.text(margin, y, list.title, {.size_mm = 3.2, .bold = true});
  svg.text(width - margin, y, list.remark, {.size_mm = 2.4, .colour = soft, .anchor = "end"});
  y += 5;
  double top = y;
  for (std::size_t next = 0; next < list.rows.size();) {
    const double end = page_end(top);
    const auto room = static_cast<std::size_t>(std::max(0.0, (end - top - 5) / row_height));
    const std::size_t rest = list.rows.size() - next,
                      rows = std::min(room, (rest + list.side_by_side - 1) / list.side_by_side);
    if (rows > 2 || rest <= list.side_by_side * room) {
      for (std::size_t part = 0; part < list.side_by_side; ++part)
        next = list_part(list, margin + static_cast<double>(part) * (list.width_mm + 6), top, next, rows);
      y = top + 5 + row_height * static_cast<double>(rows);
    }
    top = end + 2 * margin;
  }
  y += 6;
}

std::size_t ReportSheet::list_part(const ReportList& list, double x, double top, std::size_t next,
                                   std::size_t rows) {
  if (next >= list.rows.size()) return next;
  const auto cell = [&](const ReportList::Column& column, double at, const std::string& words,
                        const TextStyle& style) {
    TextStyle placed = style;
    placed.anchor = column.words ? "start" : "end";
    svg.text(x + column.at_mm, at, words, placed);
  };
  for (const ReportList::Column& column : list.columns)
    cell(column, top, column.head, {.size_mm = 2.2, .colour = soft});
  svg.line(x, top + 1.1, x + list.width_mm, top + 1.1, {.stroke = rule, .width_mm = 0.3});
  double at = top + 4.4;
  for (std::size_t i = 0; i < rows && next < list.rows.size(); ++i, ++next, at += row_height) {
    const ReportList::Row& row = list.rows[next];
    for (std::size_t c = 0; c < std::min(row.cells.size(), list.columns.size()); ++c)
      cell(list.columns[c], at, row.cells[c], {.size_mm = 2.3, .colour = row.used ? dark : red});
  }
  return next;
}

std::string ReportSheet::page() const { return svg.page(width, std::max(height, std::ceil(y + margin))); }

}  // namespace zeropose
