// Reads the small tables of tests/golden: a header line with column names, comma separated, # starts a
// comment.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace zeropose::test {

class CsvTable {
 public:
  // path: absolute, or relative to the root of the sources; throws std::runtime_error when it cannot be read.
  explicit CsvTable(const std::string& path) {
    std::ifstream file(std::filesystem::path(ZEROPOSE_SOURCE_DIR) / path);
    if (!file) throw std::runtime_error("cannot read " + path);
    for (std::string line; std::getline(file, line);) {
      if (line.ends_with('\r')) line.pop_back();
      if (line.empty() || line.front() == '#') continue;
      (columns_.empty() ? columns_ : rows_.emplace_back()) = split(line);
    }
  }

  std::size_t size() const { return rows_.size(); }
  const std::string& text(std::size_t row, const std::string& column) const {
    const auto found = std::find(columns_.begin(), columns_.end(), column);
    if (found == columns_.end()) throw std::runtime_error("no column " + column);
    return rows_.at(row).at(static_cast<std::size_t>(found - columns_.begin()));
  }
  double number(std::size_t row, const std::string& column) const { return std::stod(text(row, column)); }

 private:
  static std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    return cells;
  }

  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace zeropose::test
