#include "config/json_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "config/config_error.h"
#include "example_cell.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> errors_of(const std::string& text) {
  try {
    parse_json(text, "f");
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

TEST(JsonTree, SyntaxErrorsHaveLineAndColumn) {
  EXPECT_THAT(errors_of("{\n  \"a\": 1,\n  \"b\" 2\n}"),
              ElementsAre(HasSubstr("f:3:7: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": NaN}"), ElementsAre(HasSubstr("f:1:7: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": Infinity}"), ElementsAre(HasSubstr("f:1:7: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": 1,}"), ElementsAre(HasSubstr("f:1:9: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": 1} x"), ElementsAre(HasSubstr("f:1:10: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": 01}"), ElementsAre(HasSubstr("f:1:8: found a syntax error")));
  EXPECT_THAT(errors_of("{\"a\": \"\xff\"}"), ElementsAre(HasSubstr("f:1:8: found a syntax error")));
  EXPECT_THAT(errors_of("/* open"), ElementsAre(HasSubstr("found a syntax error")));
}

TEST(JsonTree, NumbersTooLargeAreRefused) {
  EXPECT_THAT(errors_of("{\"a\": 1e999}"),
              ElementsAre(testing::AllOf(HasSubstr("f:1:"), HasSubstr("1e999"))));
}

TEST(JsonTree, DuplicateKeysAreNamedWithTheirPath) {
  EXPECT_THAT(
      errors_of(R"({"a": 1, "b": [{}, {"c": {"d": 1}, "c": {"d": 2}}], "a": {"x": [1, {}]}, "z": 1})"),
      ElementsAre("f: b[1].c: found the key twice, expected once",
                  "f: a: found the key twice, expected once"));
}

TEST(JsonTree, CommentsAreAllowed) {
  const JsonValue tree = parse_json("// a\n{ /* b */ \"a\": 1 // c\n}", "f");
  ASSERT_NE(tree.find("a"), nullptr);
  EXPECT_EQ(short_text(*tree.find("a")), "1");
}

TEST(JsonTree, DeepNestingIsRefused) {
  const std::string deep(100000, '[');
  EXPECT_THAT(errors_of(deep), ElementsAre(HasSubstr("found nesting deeper than 32")));
}

TEST(JsonTree, KindsStayApart) {
  const JsonValue tree =
      parse_json(R"([null, true, -1, 1, 1.0, "1", [], {}, 1e5, 18446744073709551616])", "f");
  const auto& items = std::get<JsonValue::Array>(tree.value);
  const std::vector<std::size_t> kinds{0, 1, 2, 3, 4, 5, 6, 7, 4, 4};
  ASSERT_EQ(items.size(), kinds.size());
  for (std::size_t i = 0; i < kinds.size(); ++i) EXPECT_EQ(items[i].value.index(), kinds[i]) << i;
}

TEST(JsonTree, ObjectsKeepTheirOrder) {
  const JsonValue tree = parse_json(R"({"z": 1, "a": 2, "m": 3})", "f");
  const auto& object = std::get<JsonValue::Object>(tree.value);
  EXPECT_EQ(object[0].first + object[1].first + object[2].first, "zam");
}

TEST(JsonTree, LongTextsAreCutBetweenLetters) {
  std::string umlauts;
  for (int i = 0; i < 100; ++i) umlauts += "\xc3\xbc";
  const std::string text = short_text({umlauts});
  EXPECT_LT(text.size(), 70U);
  EXPECT_NO_THROW(Json(text).dump());
}

// R12: a large file of nothing but unknown keys.
TEST(JsonTree, HugeFilesAreRefused) {
  std::string text = "{\"a\": 0";
  for (int i = 0; text.size() < max_file_bytes / 4; ++i) text += ", \"key" + std::to_string(i) + "\": 1";
  EXPECT_EQ(mistakes_in(text + "}").size(), 101U);
}

// R12: whatever happens to the file, it is refused whole or read whole.
TEST(JsonTree, EveryTruncationOfTheCellIsRefused) {
  const std::string& text = example_text();
  const std::size_t end = text.rfind('}');
  for (std::size_t length = 0; length <= end; length += 7)
    EXPECT_FALSE(mistakes_in(text.substr(0, length)).empty()) << length;
}

TEST(JsonTree, RandomDamageNeverPassesUnnoticedOrCrashes) {
  std::mt19937 random(12);
  std::uniform_int_distribution<std::size_t> position(0, example_text().size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  int refused = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string text = example_text();
    for (int k = 0; k < 3; ++k) text[position(random)] = static_cast<char>(byte(random));
    refused += mistakes_in(text).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace zeropose
