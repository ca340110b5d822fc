// The page that maintenance reads at 3 am is the table in the code.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "measure/code.h"

namespace zeropose {
namespace {

std::string codes_page() {
  std::ostringstream page;
  page << "# Codes\n\nWhat a result's code says and what to do. 0 ok, 1xx request, 2xx camera and image, 3xx "
          "marks, 4xx "
          "geometry and deviations,\n5xx limits, 6xx references and drift, 7xx config and storage, 9xx "
          "internal.\n\n"
          "| code | name | cause | remedy |\n|---|---|---|---|\n";
  for (const CodeText& text : code_table())
    page << "| " << static_cast<int>(text.code) << " | " << text.name << " | " << text.cause << " | "
         << text.remedy << " |\n";
  return page.str();
}

TEST(CodesPage, IsTheTableInTheCode) {
  std::ifstream file(ZEROPOSE_SOURCE_DIR "/docs/codes.md");
  std::stringstream content;
  content << file.rdbuf();
  EXPECT_EQ(content.str(), codes_page()) << "docs/codes.md must read:\n" << codes_page();
}

}  // namespace
}  // namespace zeropose
