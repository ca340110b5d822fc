// The examples of docs/checks.md can be put into a cell file as they stand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "example_cell.h"

namespace zeropose {
namespace {

// The JSON texts of the page that belong into a member of this kind.
std::vector<Json> examples_for(const std::string& member) {
  const std::string page = read_file(ZEROPOSE_SOURCE_DIR "/docs/checks.md");
  const std::string mark = "<!-- member of a " + member + ": loaded by a test -->\n```json\n";
  std::vector<Json> examples;
  for (auto at = page.find(mark); at != std::string::npos; at = page.find(mark, at + 1)) {
    const auto from = at + mark.size();
    examples.push_back(Json::parse(page.substr(from, page.find("```", from) - from)));
  }
  return examples;
}

TEST(ChecksPage, ItsExamplesAreValid) {
  const std::vector<Json> jobs = examples_for("job"), robots = examples_for("robot");
  ASSERT_EQ(jobs.size(), 2U);
  ASSERT_EQ(robots.size(), 1U);
  for (const Json& part : jobs) {
    Json json = example();
    json["jobs"][0].merge_patch(part);
    EXPECT_THAT(mistakes_in(json), testing::IsEmpty()) << part;
  }
  Json json = example();
  json["robots"][0].merge_patch(robots.front());
  EXPECT_THAT(mistakes_in(json), testing::IsEmpty());
}

}  // namespace
}  // namespace zeropose
