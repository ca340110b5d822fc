#include "config/calibration_store.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "config/atomic_file.h"
#include "config/files.h"
#include "config/json_reader.h"
#include "config/record_file.h"
#include "config/text.h"

namespace zeropose {
namespace {

namespace fs = std::filesystem;

const RecordKind entry_kind{"zeropose calibration", 1};
constexpr int most_entries = 99999;

fs::path folder_of(const fs::path& calibration) { return calibration.string() + ".history"; }

fs::path entry_path(const fs::path& calibration, int number) {
  std::string digits = std::to_string(number);
  digits.insert(0, 5 - std::min<std::size_t>(5, digits.size()), '0');
  return folder_of(calibration) / (digits + ".json");
}

CalibrationEntry entry_of(const JsonValue& content, const std::string& file, int number) {
  CalibrationEntry entry;
  entry.number = number;
  JsonReading reading(file);
  read_object(content, "", reading, [&](JsonObject& object) {
    object.read("before", entry.before, 0, most_entries);
    object.read("time", entry.time_utc);
    object.read("why", entry.why);
    object.skip("text");
    const JsonValue* text = content.find("text");
    const auto* file_text = text != nullptr ? std::get_if<std::string>(&text->value) : nullptr;
    if (file_text != nullptr)
      entry.text = *file_text;  // longer than the texts that read() takes
    else
      object.add_mistake("text", "no text", "the whole calibration file");
  });
  reading.throw_if_wrong();
  entry.hash = short_hash(entry.text);
  return entry;
}

// Keeps what is or will be in the file's place; the file itself is not touched.
CalibrationEntry keep(const fs::path& calibration, CalibrationEntry entry) {
  fs::create_directories(folder_of(calibration));
  const nlohmann::ordered_json content = {
      {"before", entry.before}, {"time", entry.time_utc}, {"why", entry.why}, {"text", entry.text}};
  save_record(entry_path(calibration, entry.number), entry_kind, content.dump());
  entry.hash = short_hash(entry.text);
  return entry;
}

int last_number(const std::vector<CalibrationEntry>& history) {
  return history.empty() ? 0 : history.back().number;
}

// The newest entry with these words.
std::optional<CalibrationEntry> entry_with(const std::vector<CalibrationEntry>& history,
                                           const std::string& text) {
  const auto found =
      std::find_if(history.rbegin(), history.rend(), [&](const auto& entry) { return entry.text == text; });
  if (found == history.rend()) return std::nullopt;
  return *found;
}

// The entry of what the file holds now, kept if nobody knows it yet.
CalibrationEntry present(const fs::path& calibration, const std::string& time_utc) {
  const std::vector<CalibrationEntry> history = calibration_history(calibration);
  const std::string text = read_file(calibration);
  if (const auto known = entry_with(history, text)) return *known;
  return keep(calibration,
              {last_number(history) + 1, last_number(history), time_utc, "found in place", text, 0});
}

}  // namespace

std::vector<CalibrationEntry> calibration_history(const fs::path& calibration) {
  std::vector<CalibrationEntry> history;
  for (int number = 1; number <= most_entries; ++number) {
    const fs::path path = entry_path(calibration, number);
    const auto record = load_record(path, entry_kind);
    if (!record) break;
    history.push_back(entry_of(record->content, path.string(), number));
  }
  return history;
}

std::optional<CalibrationEntry> active_entry(const fs::path& calibration) {
  return entry_with(calibration_history(calibration), read_file(calibration));
}

CalibrationEntry activate_calibration(const fs::path& calibration, const std::string& text,
                                      const std::string& why, const std::string& time_utc) {
  const CalibrationEntry before = present(calibration, time_utc);
  const int number = last_number(calibration_history(calibration)) + 1;
  const CalibrationEntry entry = keep(calibration, {number, before.number, time_utc, why, text, 0});
  replace_file(calibration, text);
  return entry;
}

std::optional<CalibrationEntry> entry_before(const fs::path& calibration) {
  const std::vector<CalibrationEntry> history = calibration_history(calibration);
  const auto now = entry_with(history, read_file(calibration));
  const int before = now ? now->before : last_number(history);
  if (before == 0) return std::nullopt;
  return history.at(static_cast<std::size_t>(before - 1));
}

CalibrationEntry undo_calibration(const fs::path& calibration, const std::string& time_utc) {
  const CalibrationEntry now = present(calibration, time_utc);
  const std::vector<CalibrationEntry> history = calibration_history(calibration);
  if (now.before == 0)
    throw ConfigError({concat({calibration.string(), ": found entry ", std::to_string(now.number),
                               ", the first one, expected one with another before it"})});
  const CalibrationEntry& back = history.at(static_cast<std::size_t>(now.before - 1));
  const int number = last_number(history) + 1;
  const CalibrationEntry entry =
      keep(calibration,
           {number, back.before, time_utc, concat({"back to ", std::to_string(back.number)}), back.text, 0});
  replace_file(calibration, entry.text);
  return entry;
}

}  // namespace zeropose
