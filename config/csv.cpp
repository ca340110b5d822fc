#include "config/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>

#include "config/closest.h"
#include "config/files.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::size_t max_mistakes = 100;
constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// The next line without its end; takes it off the text.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

// The next cell; takes it and its comma off the line. A quoted cell may hold commas and doubled quotes.
std::string take_cell(std::string_view& line) {
  line = line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
  std::string cell;
  if (line.starts_with('"')) {
    for (line.remove_prefix(1); !line.empty(); line.remove_prefix(1)) {
      if (line.starts_with("\"\""))
        line.remove_prefix(1);
      else if (line.front() == '"')
        break;
      cell += line.front();
    }
    line.remove_prefix(std::min<std::size_t>(1, line.size()));
  }
  const std::size_t comma = std::min(line.find(','), line.size());
  cell += trimmed(line.substr(0, comma));
  line.remove_prefix(comma);
  return cell;
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells{take_cell(line)};
  while (!line.empty()) {
    line.remove_prefix(1);
    cells.push_back(take_cell(line));
  }
  return cells;
}

std::string list_of(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += concat({text.empty() ? "" : " ", word});
  return text;
}

std::string text_of(double value) {
  std::ostringstream stream;
  stream << value;
  return stream.str();
}

std::string range_text(double min, double max) {
  const double any = std::numeric_limits<double>::max();
  if (min <= -any && max >= any) return "a finite number";
  if (max >= any) return concat({"a number of at least ", text_of(min)});
  return concat({"a number from ", text_of(min), " to ", text_of(max)});
}

}  // namespace

bool parse_number(std::string_view text, double& number) {
  text = trimmed(text);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return false;
  number = value;
  return true;
}

std::vector<double> parse_numbers(std::string text, const std::string& place) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  std::vector<double> numbers;
  std::vector<std::string> mistakes;
  for (std::string word; stream >> word;) {
    numbers.push_back(0);
    if (!parse_number(word, numbers.back()))
      mistakes.push_back(concat({place, ": found ", in_quotes(word), ", expected a finite number"}));
  }
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  return numbers;
}

CsvTable::CsvTable(std::string_view text, std::string file, const CsvColumns& columns)
    : file_(std::move(file)) {
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view content = trimmed(take_line(text));
    if (content.empty() || content.front() == '#') continue;
    if (header_line_ == 0) {
      header_line_ = line;
      header_ = cells_of(content);
      continue;
    }
    rows_.push_back({line, cells_of(content)});
    if (rows_.back().cells.size() != header_.size())
      note(concat({file_, ":", std::to_string(line), ": found ", std::to_string(rows_.back().cells.size()),
                   " values, expected the ", std::to_string(header_.size()), " of the header"}));
  }
  read_header(columns);
  throw_if_wrong();
}

void CsvTable::read_header(const CsvColumns& columns) {
  std::vector<std::string_view> known = columns.required;
  known.insert(known.end(), columns.optional.begin(), columns.optional.end());
  if (header_line_ == 0) {
    mistakes_.push_back(
        concat({file_, ": found no header line, expected the columns ", list_of(columns.required)}));
    return;
  }
  const std::string place = concat({file_, ":", std::to_string(header_line_), ": "});
  if (header_.size() == 1 && header_.front().find_first_of(";\t") != std::string::npos) {
    mistakes_ = {concat({place, "the columns are parted by ",
                         header_.front().find(';') != std::string::npos ? "semicolons" : "tabs",
                         ", expected commas, and decimal points in the numbers"})};
    return;
  }
  for (const std::string_view column : columns.required)
    if (!has(column)) mistakes_.push_back(concat({place, "found no column ", column, ", expected it"}));
  for (auto column = header_.begin(); column != header_.end(); ++column) {
    if (std::find(header_.begin(), column, *column) != column)
      mistakes_.push_back(concat({place, "found the column ", in_quotes(*column), " twice, expected once"}));
    else if (std::find(known.begin(), known.end(), *column) == known.end()) {
      const std::string_view close = closest(*column, known);
      mistakes_.push_back(concat({place, "found the unknown column ", in_quotes(*column), ", expected ",
                                  close.empty() ? list_of(known) : concat({in_quotes(close), "?"})}));
    }
  }
}

bool CsvTable::has(std::string_view column) const {
  return std::find(header_.begin(), header_.end(), column) != header_.end();
}

const std::string* CsvTable::cell(std::size_t row, std::string_view column) const {
  const auto found = std::find(header_.begin(), header_.end(), column);
  if (found == header_.end()) return nullptr;
  return &rows_.at(row).cells.at(static_cast<std::size_t>(std::distance(header_.begin(), found)));
}

bool CsvTable::is_blank(std::size_t row, std::string_view column) const {
  const std::string* found = cell(row, column);
  return found == nullptr || found->empty();
}

std::string CsvTable::text(std::size_t row, std::string_view column) {
  const std::string* found = cell(row, column);
  if (found == nullptr || found->empty()) {
    add_mistake(row, column, "nothing", "a name");
    return {};
  }
  return *found;
}

double CsvTable::number(std::size_t row, std::string_view column, double min, double max) {
  const std::string* found = cell(row, column);
  double value = 0;
  if (found != nullptr && parse_number(*found, value) && value >= min && value <= max) return value;
  const bool blank = found == nullptr || found->empty();
  add_mistake(row, column, blank ? "nothing" : in_quotes(*found), range_text(min, max));
  return 0;
}

double CsvTable::number(std::size_t row, std::string_view column) {
  const double any = std::numeric_limits<double>::max();
  return number(row, column, -any, any);
}

double CsvTable::number_or(std::size_t row, std::string_view column, double fallback, double min,
                           double max) {
  return is_blank(row, column) ? fallback : number(row, column, min, max);
}

void CsvTable::add_mistake(std::size_t row, std::string_view column, std::string_view found,
                           std::string_view expected) {
  note(concat({file_, ":", std::to_string(rows_.at(row).line), ": ", column, ": found ", found, ", expected ",
               expected}));
}

void CsvTable::note(std::string mistake) {
  if (mistakes_.size() < max_mistakes)
    mistakes_.push_back(std::move(mistake));
  else
    ++uncounted_;
}

void CsvTable::throw_if_wrong() const {
  std::vector<std::string> all = mistakes_;
  if (uncounted_ > 0) all.push_back(concat({file_, ": and ", std::to_string(uncounted_), " mistakes more"}));
  if (!all.empty()) throw ConfigError(std::move(all));
}

CsvTable load_csv(const std::filesystem::path& path, const CsvColumns& columns) {
  return {read_file(path), path.string(), columns};
}

}  // namespace zeropose
