// The calibration file of a cell and all that it was before: nothing is activated but by command, everything
// is kept, everything can be undone (spec 40).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/config_error.h"

namespace zeropose {

// What a calibration file was from some moment on. Kept beside it in FILE.history/, one record for each.
struct CalibrationEntry {
  int number = 0;  // from 1, oldest first
  int before = 0;  // the entry that it took the place of; 0: none is known
  std::string time_utc;
  std::string why;         // in the words of who activated it
  std::string text;        // the whole file
  std::uint32_t hash = 0;  // short_hash(text): what robots and zeros know it by
};

// Oldest first. Throws ConfigError for a record that is damaged.
std::vector<CalibrationEntry> calibration_history(const std::filesystem::path& calibration);

// The entry that the file holds now; nullopt: it was never activated by command, or edited since.
std::optional<CalibrationEntry> active_entry(const std::filesystem::path& calibration);

// Puts `text` in the file's place; what was there is kept first (as "found in place" when no entry knows it).
// Precondition: the text is a calibration that the cell accepts. Throws std::system_error: the old file is
// then still in place.
CalibrationEntry activate_calibration(const std::filesystem::path& calibration, const std::string& text,
                                      const std::string& why, const std::string& time_utc);

// What undo_calibration() would go back to; nullopt: nothing is known before.
std::optional<CalibrationEntry> entry_before(const std::filesystem::path& calibration);

// Goes back to what was active before. Throws ConfigError when nothing is known before.
CalibrationEntry undo_calibration(const std::filesystem::path& calibration, const std::string& time_utc);

}  // namespace zeropose
