#include "config/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/closest.h"
#include "config/tables.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const CsvColumns columns{{"name", "x", "y"}, {"weight"}};

std::vector<std::string> mistakes_in(const std::string& text) {
  try {
    CsvTable table(text, "t.csv", columns);
    for (std::size_t row = 0; row < table.rows(); ++row) {
      table.text(row, "name");
      table.number(row, "x");
      table.number(row, "y", -10, 10);
      table.number_or(row, "weight", 1, 0, 1);
    }
    table.throw_if_wrong();
  } catch (const ConfigError& error) {
    return error.mistakes();
  }
  return {};
}

TEST(Csv, ColumnsComeInAnyOrder) {
  CsvTable table("y, name ,x\n# comment\n\n2,a,1.5e1\n-2, b ,+3\n", "t.csv", columns);
  ASSERT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.text(0, "name"), "a");
  EXPECT_EQ(table.number(0, "x"), 15);
  EXPECT_EQ(table.number(1, "x"), 3);
  EXPECT_EQ(table.number(1, "y"), -2);
  EXPECT_EQ(table.text(1, "name"), "b");
  EXPECT_EQ(table.number_or(1, "weight", 0.25, 0, 1), 0.25);
  EXPECT_NO_THROW(table.throw_if_wrong());
}

TEST(Csv, ToleratesWindowsFilesAndQuotes) {
  CsvTable table("\xef\xbb\xbfname,x,y\r\n\"a, \"\"b\"\"\",1,2\r\n", "t.csv", columns);
  ASSERT_EQ(table.rows(), 1U);
  EXPECT_EQ(table.text(0, "name"), "a, \"b\"");
  EXPECT_EQ(table.number(0, "y"), 2);
}

TEST(Csv, NoRowsIsATable) {
  EXPECT_EQ(CsvTable("name,x,y", "t.csv", columns).rows(), 0U);
  EXPECT_EQ(CsvTable("# only\nname,x,y\n#1,2,3\n", "t.csv", columns).rows(), 0U);
}

TEST(Csv, HeaderMistakesAreNamed) {
  EXPECT_THAT(mistakes_in(""), ElementsAre("t.csv: found no header line, expected the columns name x y"));
  EXPECT_THAT(mistakes_in("name,x"), ElementsAre("t.csv:1: found no column y, expected it"));
  EXPECT_THAT(mistakes_in("# c\nname,x,y,x"),
              ElementsAre("t.csv:2: found the column \"x\" twice, expected once"));
  EXPECT_THAT(mistakes_in("name,x,y,wieght"),
              ElementsAre("t.csv:1: found the unknown column \"wieght\", expected \"weight\"?"));
}

TEST(Csv, OtherSeparatorsAreSaidOnce) {
  EXPECT_THAT(
      mistakes_in("name;x;y\na;1,5;2,5\n"),
      ElementsAre("t.csv:1: the columns are parted by semicolons, expected commas, and decimal points in "
                  "the numbers"));
  EXPECT_THAT(mistakes_in("name\tx\ty\na\t1\t2\n"), ElementsAre(testing::HasSubstr("parted by tabs")));
}

TEST(Csv, CellMistakesAreNamedAllAtOnce) {
  EXPECT_THAT(mistakes_in("name,x,y\na,1,2,3\nb,1\n"),
              ElementsAre("t.csv:2: found 4 values, expected the 3 of the header",
                          "t.csv:3: found 2 values, expected the 3 of the header"));
  EXPECT_THAT(mistakes_in("name,x,y\na,one,2\n,1.5.1,\nc,1,11\n"),
              ElementsAre("t.csv:2: x: found \"one\", expected a finite number",
                          "t.csv:3: name: found nothing, expected a name",
                          "t.csv:3: x: found \"1.5.1\", expected a finite number",
                          "t.csv:3: y: found nothing, expected a number from -10 to 10",
                          "t.csv:4: y: found \"11\", expected a number from -10 to 10"));
}

TEST(Csv, ManyMistakesAreCounted) {
  std::string text = "name,x,y\n";
  for (int i = 0; i < 150; ++i) text += "a,b,0\n";
  const std::vector<std::string> mistakes = mistakes_in(text);
  ASSERT_EQ(mistakes.size(), 101U);
  EXPECT_EQ(mistakes.back(), "t.csv: and 50 mistakes more");
}

TEST(Csv, NumbersAreFiniteAndWhole) {
  double number = 7;
  for (const char* bad :
       {"", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "1 2", "--1", "+-1", "1e", "true"})
    EXPECT_FALSE(parse_number(bad, number)) << bad;
  EXPECT_EQ(number, 7);
  EXPECT_TRUE(parse_number(" -1.25e-3 ", number));
  EXPECT_EQ(number, -1.25e-3);
}

TEST(Csv, ClosestWord) {
  const std::vector<std::string_view> words{"weight", "width_px", "x"};
  EXPECT_EQ(closest("wight", words), "weight");
  EXPECT_EQ(closest("width", words), "");
  EXPECT_EQ(closest("widthpx", words), "width_px");
  EXPECT_EQ(closest("zebra", words), "");
}

std::string observation_error(const std::string& text) {
  const TemporaryFolder directory;
  const std::vector<CalibratedCamera> cameras{{"left", {}, Pose::Identity()}};
  std::vector<Mark> marks(2);
  marks[0].name = "a";
  marks[1].name = "b";
  try {
    load_observations(directory.write("o.csv", text), cameras, marks);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Tables, ObservationsFindTheirCamerasAndMarks) {
  const TemporaryFolder directory;
  const std::vector<CalibratedCamera> cameras{{"left", {}, Pose::Identity()},
                                              {"right", {}, Pose::Identity()}};
  std::vector<Mark> marks(2);
  marks[0].name = "a";
  marks[1].name = "b";
  const auto observations = load_observations(
      directory.write("o.csv", "camera,mark,u_px,v_px,suu,svv,suv\nright,b,1,2,,,\nleft,b,3,4,4,9,-1\n"),
      cameras, marks);
  ASSERT_EQ(observations.size(), 2U);
  EXPECT_EQ(observations[0].camera, 1U);
  EXPECT_EQ(observations[0].mark, 1U);
  EXPECT_EQ(observations[0].covariance_px2, Eigen::Matrix2d::Identity());
  EXPECT_EQ(observations[1].covariance_px2(0, 1), -1);
  EXPECT_EQ(observations[1].covariance_px2(1, 1), 9);
  EXPECT_EQ(observations[1].u_px, Eigen::Vector2d(3, 4));
}

TEST(Tables, WrongObservationsAreNamed) {
  const std::string header = "camera,mark,u_px,v_px,suu,svv,suv\n";
  EXPECT_EQ(observation_error(header + "left,a,1,2,,,\n"), "no error");
  EXPECT_THAT(observation_error(header + "middle,a,1,2,,,\n"), HasSubstr(":2: camera: found \"middle\""));
  EXPECT_THAT(observation_error(header + "left,c,1,2,,,\n"), HasSubstr(":2: mark: found \"c\""));
  EXPECT_THAT(observation_error(header + "left,a,1,2,1,,\n"), HasSubstr(":2: svv: found nothing"));
  EXPECT_THAT(observation_error(header + "left,a,1,2,1,1,1\n"), HasSubstr(":2: suv: found"));
  EXPECT_THAT(observation_error(header + "left,a,1,2,0,1,0\n"), HasSubstr(":2: suu: found \"0\""));
  EXPECT_THAT(observation_error(header + "left,a,1,2,,,\nleft,a,1,2,,,\n"),
              HasSubstr(":3: mark: found \"a\" again in this camera"));
}

}  // namespace
}  // namespace zeropose
