// The robot programmer's page says what the code does: its tables are the code's.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "protocol/register_map.h"

namespace zeropose {
namespace {

std::string page() {
  std::ifstream file(std::string(ZEROPOSE_SOURCE_DIR) + "/docs/modbus.md");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const auto first = text.find(begin), last = text.find(end);
  if (first == std::string::npos || last == std::string::npos) return "";
  const auto start = text.find('\n', first) + 1;
  return text.substr(start, last - start);
}

std::string framed(const std::string& text) {
  std::ostringstream all;
  all << '\n' << text << '\n';
  return all.str();
}

TEST(Docs, RegisterMap) {
  EXPECT_EQ(between(page(), "<!-- register map", "<!-- end of register map"),
            framed(register_map_markdown()));
}

TEST(Docs, ValuesOnTheWire) {
  EXPECT_EQ(between(page(), "<!-- values", "<!-- end of values"), framed(wire_values_markdown()));
}

}  // namespace
}  // namespace zeropose
