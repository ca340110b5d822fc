// The sheet that all reports are written on: A4 wide, filled from top to bottom, lists make it longer.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/verdict.h"
#include "config/svg.h"

namespace zeropose {

// An estimate as a row of a table.
struct ValueRow {
  std::string name;  // with the unit
  int decimals = 3;
  double value = 0;
  double sigma = -1;             // -1: held or not estimated
  std::optional<double> active;  // what is in use
  double difference = 0;         // from that
};

struct ReportList {
  std::string title, remark;
  // Heads, and where the column ends, mm from the list's left edge. words: where it begins, and not broken.
  struct Column {
    std::string head;
    double at_mm = 0;
    bool words = false;
  };
  struct Row {
    std::vector<std::string> cells;
    bool used = true;  // else red
  };
  std::vector<Column> columns;
  std::vector<Row> rows;
  std::size_t side_by_side = 1;
  double width_mm = 0;  // of one of them
};

class ReportSheet {
 public:
  static constexpr double width = 210, height = 297, margin = 14, inner = width - 2 * margin;
  static constexpr double right = margin + 116, right_end = width - margin;  // of the column beside a table
  static constexpr std::string_view dark = "#1c2430", soft = "#5b6675", red = "#c62828", amber = "#b26a00";

  Svg svg;
  double y = margin;  // how far the sheet is filled

  void title(const std::string& words, const std::string& below);
  void banner(Quality quality, const std::string& summary, const std::vector<Finding>& findings);
  void heading(double x, const std::string& words);
  // The first cell begins at its place, the others end there.
  void row(std::initializer_list<std::pair<double, std::string>> cells);
  void head(double x, double x_end, std::initializer_list<std::pair<double, std::string>> cells);
  // Value, sigma and, where there is one, what is in use and the difference.
  void values(double x, const std::vector<ValueRow>& rows);
  // Broken into lines of at most so many letters.
  void note(double x, const std::string& words, std::size_t letters, std::string_view colour = soft,
            double size_mm = 2.6);
  void list(const ReportList& list);
  // On to the next page where so much would not fit on this one, so that it can be printed.
  void keep(double height_mm);
  std::string page() const;

 private:
  void cells(std::initializer_list<std::pair<double, std::string>> cells, double size_mm,
             std::string_view colour);
  std::size_t list_part(const ReportList& list, double x, double top, std::size_t next, std::size_t rows);
};

}  // namespace zeropose
