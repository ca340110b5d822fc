// Tables as CSV: a header with column names in any order, commas, lines that begin with # are comments
// (spec 92). CRLF, a byte order mark, blank lines and "quoted" cells are tolerated.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/config_error.h"

namespace zeropose {

struct CsvColumns {
  std::vector<std::string_view> required, optional;
};

// The cells of the known columns. Reading a wrong number does not throw: it is collected, and
// throw_if_wrong() names all of them.
class CsvTable {
 public:
  // Throws ConfigError: no header, columns missing, unknown or twice, rows of another length than the header.
  CsvTable(std::string_view text, std::string file, const CsvColumns& columns);

  std::size_t rows() const { return rows_.size(); }
  bool has(std::string_view column) const;
  bool is_blank(std::size_t row, std::string_view column) const;  // also when the column is absent

  // A name: a mistake when blank.
  std::string text(std::size_t row, std::string_view column);
  double number(std::size_t row, std::string_view column, double min, double max);
  double number(std::size_t row, std::string_view column);  // any finite one
  // The fallback where the column is absent or the cell blank.
  double number_or(std::size_t row, std::string_view column, double fallback, double min, double max);

  void add_mistake(std::size_t row, std::string_view column, std::string_view found,
                   std::string_view expected);
  void throw_if_wrong() const;

 private:
  struct Row {
    std::size_t line = 0;
    std::vector<std::string> cells;
  };

  void note(std::string mistake);
  void read_header(const CsvColumns& columns);
  const std::string* cell(std::size_t row, std::string_view column) const;

  std::string file_;
  std::size_t header_line_ = 0;
  std::vector<std::string> header_;
  std::vector<Row> rows_;
  std::vector<std::string> mistakes_;
  std::size_t uncounted_ = 0;  // beyond the first hundred
};

CsvTable load_csv(const std::filesystem::path& path, const CsvColumns& columns);

// A finite decimal number and nothing else but blanks around it.
bool parse_number(std::string_view text, double& number);

// The numbers of a text, parted by commas or blanks. Throws ConfigError that names `place`.
std::vector<double> parse_numbers(std::string text, const std::string& place);

}  // namespace zeropose
