// What a calibration file was stays known, and comes back by command only.
#include <gtest/gtest.h>

#include <fstream>

#include "config/calibration_store.h"
#include "config/files.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

class CalibrationStore : public testing::Test {
 protected:
  void SetUp() override { write("first"); }
  void write(const std::string& text) const { std::ofstream(file) << text; }
  CalibrationEntry activate(const std::string& text) const {
    return activate_calibration(file, text, "for " + text, "2026-01-31T12:00:00Z");
  }
  CalibrationEntry undo() const { return undo_calibration(file, "2026-01-31T13:00:00Z"); }
  std::string now() const { return read_file(file); }

  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "cell.calibration.json";
};

TEST_F(CalibrationStore, KeepsWhatWasThereBefore) {
  EXPECT_TRUE(calibration_history(file).empty());
  EXPECT_FALSE(active_entry(file));
  activate("second");
  EXPECT_EQ(now(), "second");
  const auto history = calibration_history(file);
  ASSERT_EQ(history.size(), 2u);
  EXPECT_EQ(history[0].text, "first");
  EXPECT_EQ(history[0].why, "found in place");
  EXPECT_EQ(history[0].before, 0);
  EXPECT_EQ(history[1].text, "second");
  EXPECT_EQ(history[1].why, "for second");
  EXPECT_EQ(history[1].before, 1);
  EXPECT_EQ(history[1].hash, short_hash("second"));
  EXPECT_EQ(active_entry(file)->number, 2);
}

TEST_F(CalibrationStore, HoldsWholeFiles) {
  const std::string before = read_file(ZEROPOSE_SOURCE_DIR "/config/cells/car-body.calibration.json");
  write(before);
  activate("second");
  EXPECT_EQ(undo().text, before);
  EXPECT_EQ(now(), before);
}

TEST_F(CalibrationStore, UndoGoesBackStepByStepAndLosesNothing) {
  activate("second");
  activate("third");
  EXPECT_EQ(undo().text, "second");
  EXPECT_EQ(now(), "second");
  EXPECT_EQ(undo().text, "first");
  EXPECT_EQ(now(), "first");
  EXPECT_THROW(undo(), ConfigError);
  EXPECT_EQ(now(), "first");
  EXPECT_EQ(calibration_history(file).size(), 5u);
  activate("fourth");
  EXPECT_EQ(undo().text, "first");
}

TEST_F(CalibrationStore, AFileEditedByHandIsKeptToo) {
  activate("second");
  write("edited");
  EXPECT_FALSE(active_entry(file));
  activate("third");
  EXPECT_EQ(undo().text, "edited");
  EXPECT_EQ(undo().text, "second");
}

TEST_F(CalibrationStore, ADamagedRecordIsNamed) {
  activate("second");
  const std::filesystem::path record = file.string() + ".history/00001.json";
  std::string text = read_file(record);
  text.replace(text.find("first"), 5, "fist!");
  std::ofstream(record) << text;
  try {
    activate("third");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("00001.json"), std::string::npos) << error.what();
  }
  EXPECT_EQ(now(), "second");
}

}  // namespace
}  // namespace zeropose
