#include "config/json_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "config/closest.h"
#include "config/config_error.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::size_t max_mistakes = 100;
constexpr double largest_mm = 1e6;
constexpr double largest_deg = 360;

std::string text_of(double value) {
  std::ostringstream stream;
  stream << std::setprecision(12) << value;
  return stream.str();
}

// The number without any conversion from other kinds; nullopt: no finite number.
std::optional<double> number_of(const JsonValue& value) {
  if (const auto* real = std::get_if<double>(&value.value))
    return std::isfinite(*real) ? std::optional(*real) : std::nullopt;
  if (const auto* whole = std::get_if<std::int64_t>(&value.value)) return static_cast<double>(*whole);
  if (const auto* whole = std::get_if<std::uint64_t>(&value.value)) return static_cast<double>(*whole);
  return std::nullopt;
}

std::optional<std::int64_t> integer_of(const JsonValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value.value)) return *whole;
  if (const auto* whole = std::get_if<std::uint64_t>(&value.value))
    if (*whole <= std::numeric_limits<std::int64_t>::max()) return static_cast<std::int64_t>(*whole);
  return std::nullopt;
}

std::string text_of(const NumberRange& range) {
  const bool has_min = range.min > -std::numeric_limits<double>::max();
  const bool has_max = range.max < std::numeric_limits<double>::max();
  if (has_min && has_max && !range.above)
    return concat({"a number from ", text_of(range.min), " to ", text_of(range.max)});
  std::string text = "a number";
  if (has_min) text += (range.above ? " above " : " of at least ") + text_of(range.min);
  if (has_max) text += concat({has_min ? " and" : "", " at most ", text_of(range.max)});
  return text;
}

const JsonValue& empty_object() {
  static const JsonValue value{JsonValue::Object{}};
  return value;
}

const JsonValue& null_value() {
  static const JsonValue value{};
  return value;
}

}  // namespace

JsonReading JsonReading::of_the_format() {
  JsonReading reading("format");
  reading.reads_the_format_ = true;
  return reading;
}

void JsonReading::add_mistake(const std::string& path, const std::string& found,
                              const std::string& expected) {
  if (only_counts()) {
    ++uncounted_;
    return;
  }
  mistakes_.push_back(file_ + ": " + (path.empty() ? "" : path + ": ") + "found " + found + ", expected " +
                      expected);
}

bool JsonReading::only_counts() const { return mistakes_.size() == max_mistakes; }

std::vector<std::string> JsonReading::mistakes() const {
  std::vector<std::string> all = mistakes_;
  if (uncounted_ > 0) all.push_back(file_ + ": and " + std::to_string(uncounted_) + " mistakes more");
  return all;
}

void JsonReading::throw_if_wrong() const {
  if (!mistakes_.empty()) throw ConfigError(mistakes());
}

void JsonReading::note_key(const std::string& path) {
  std::string pattern;
  bool inside = false;
  for (const char c : path) {
    if (c == ']') inside = false;
    if (!inside) pattern += c;
    if (c == '[') inside = true;
  }
  known_keys_.insert(std::move(pattern));
}

std::string path_of(const std::string& path, std::size_t index) {
  return path + "[" + std::to_string(index) + "]";
}

JsonObject::JsonObject(const JsonValue& value, std::string path, JsonReading& reading)
    : value_(value), path_(std::move(path)), reading_(reading) {}

std::string JsonObject::path(std::string_view key) const {
  return path_ + (path_.empty() ? "" : ".") + std::string(key);
}

bool JsonObject::has(std::string_view key) const {
  return reading_.reads_the_format() || value_.find(key) != nullptr;
}

void JsonObject::note(std::string_view key) {
  asked_.emplace(key);
  if (reading_.reads_the_format()) reading_.note_key(path(key));
}

const JsonValue* JsonObject::demand(std::string_view key, std::string_view expected) {
  note(key);
  if (reading_.reads_the_format()) return &null_value();
  const JsonValue* value = value_.find(key);
  if (value == nullptr) reading_.add_mistake(path(key), "no such key", std::string(expected));
  return value;
}

void JsonObject::add_mistake(std::string_view key, const std::string& found, const std::string& expected) {
  reading_.add_mistake(path(key), found, expected);
}

bool JsonObject::refuse(std::string_view key, const JsonValue& value, const std::string& expected) {
  reading_.add_mistake(path(key), short_text(value), expected);
  return false;
}

bool JsonObject::read(std::string_view key, std::string& value) {
  const std::string expected = "a text of 1 to 200 printable characters";
  const JsonValue* found = demand(key, expected);
  if (found == nullptr) return false;
  const auto* text = std::get_if<std::string>(&found->value);
  const auto unprintable = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (text == nullptr || text->empty() || text->size() > 200 ||
      std::any_of(text->begin(), text->end(), unprintable))
    return refuse(key, *found, expected);
  value = *text;
  return true;
}

bool JsonObject::read(std::string_view key, bool& value) {
  const JsonValue* found = demand(key, "true or false");
  if (found == nullptr) return false;
  const bool* given = std::get_if<bool>(&found->value);
  if (given == nullptr) return refuse(key, *found, "true or false");
  value = *given;
  return true;
}

bool JsonObject::read(std::string_view key, double& value, NumberRange range) {
  const JsonValue* found = demand(key, text_of(range));
  if (found == nullptr) return false;
  const std::optional<double> number = number_of(*found);
  const bool inside =
      number && *number <= range.max && (range.above ? *number > range.min : *number >= range.min);
  if (!inside) return refuse(key, *found, text_of(range));
  value = *number;
  return true;
}

bool JsonObject::read(std::string_view key, int& value, int min, int max) {
  const std::string expected = concat({"an integer from ", std::to_string(min), " to ", std::to_string(max)});
  const JsonValue* found = demand(key, expected);
  if (found == nullptr) return false;
  const std::optional<std::int64_t> number = integer_of(*found);
  if (!number || *number < min || *number > max) return refuse(key, *found, expected);
  value = static_cast<int>(*number);
  return true;
}

bool JsonObject::numbers(const JsonValue& found, const std::string& path, std::span<double> values,
                         std::span<const double> largest, const std::string& expected) {
  const auto* array = std::get_if<JsonValue::Array>(&found.value);
  if (array == nullptr || array->size() != values.size()) {
    reading_.add_mistake(path, short_text(found), expected);
    return false;
  }
  bool good = true;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::optional<double> number = number_of((*array)[i]);
    const double bound = largest[std::min(i, largest.size() - 1)];
    if (number && std::abs(*number) <= bound) {
      values[i] = *number;
      continue;
    }
    good = false;
    reading_.add_mistake(path_of(path, i), short_text((*array)[i]),
                         text_of(NumberRange{-bound, bound, false}));
  }
  return good;
}

bool JsonObject::read(std::string_view key, std::span<double> values, double largest) {
  const std::string expected = concat({"an array of ", std::to_string(values.size()), " numbers"});
  const JsonValue* found = demand(key, expected);
  return found != nullptr && numbers(*found, path(key), values, {&largest, 1}, expected);
}

bool JsonObject::read(std::string_view key, std::vector<Eigen::Vector3d>& values, double largest) {
  const JsonValue* found = demand(key, "an array of [x, y, z]");
  if (found == nullptr) return false;
  const auto* array = std::get_if<JsonValue::Array>(&found->value);
  if (array == nullptr) return refuse(key, *found, "an array of [x, y, z]");
  std::vector<Eigen::Vector3d> vectors(array->size(), Eigen::Vector3d::Zero());
  bool good = true;
  for (std::size_t i = 0; i < vectors.size(); ++i)
    good &= numbers((*array)[i], path_of(path(key), i), {vectors[i].data(), 3}, {&largest, 1},
                    "an array of 3 numbers");
  if (good) values = std::move(vectors);
  return good;
}

bool JsonObject::read(std::string_view key, Eigen::Vector3d& value, double largest) {
  Eigen::Vector3d read_value = Eigen::Vector3d::Zero();
  if (!read(key, std::span<double>(read_value.data(), 3), largest)) return false;
  value = read_value;
  return true;
}

bool JsonObject::read(std::string_view key, Pose& X_AB) {
  constexpr std::array bounds{largest_mm, largest_mm, largest_mm, largest_deg, largest_deg, largest_deg};
  const std::string expected = "a pose [x, y, z, rx, ry, rz] in mm and degrees";
  const JsonValue* found = demand(key, expected);
  std::array<double, 6> n{};
  if (found == nullptr || !numbers(*found, path(key), n, bounds, expected)) return false;
  X_AB = from_six_numbers({n[0], n[1], n[2], n[3], n[4], n[5]});
  return true;
}

bool JsonObject::read_range(std::string_view key, double& min, double& max, double largest) {
  const std::string expected = "an array [min, max] with min < max";
  const JsonValue* found = demand(key, expected);
  std::array<double, 2> bounds{};
  if (found == nullptr || !numbers(*found, path(key), bounds, {&largest, 1}, expected)) return false;
  if (bounds[0] >= bounds[1]) {
    add_mistake(key, concat({"[", text_of(bounds[0]), ", ", text_of(bounds[1]), "]"}), expected);
    return false;
  }
  min = bounds[0];
  max = bounds[1];
  return true;
}

bool JsonObject::read(std::string_view key, std::vector<std::string>& values) {
  const JsonValue* found = demand(key, "an array of texts");
  if (found == nullptr) return false;
  const auto* array = std::get_if<JsonValue::Array>(&found->value);
  if (array == nullptr) return refuse(key, *found, "an array of texts");
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < array->size(); ++i) {
    const auto* text = std::get_if<std::string>(&(*array)[i].value);
    if (text != nullptr && !text->empty())
      texts.push_back(*text);
    else
      reading_.add_mistake(path_of(path(key), i), short_text((*array)[i]), "a text that is not empty");
  }
  const bool good = texts.size() == array->size();
  if (good) values = std::move(texts);
  return good;
}

bool JsonObject::read(std::string_view key, const std::function<void(JsonObject&)>& read_members) {
  const JsonValue* found = demand(key, "an object");
  if (found == nullptr) return false;
  read_object(*found, path(key), reading_, read_members);
  return std::holds_alternative<JsonValue::Object>(found->value);
}

bool JsonObject::read_each(std::string_view key, std::size_t least,
                           const std::function<void(JsonObject&)>& read_members) {
  const std::string expected = least > 0
                                   ? concat({"an array of at least ", std::to_string(least), " objects"})
                                   : "an array of objects";
  const JsonValue* found = demand(key, expected);
  if (found == nullptr) return false;
  if (reading_.reads_the_format()) {
    read_object(*found, path(key) + "[]", reading_, read_members);
    return true;
  }
  const auto* array = std::get_if<JsonValue::Array>(&found->value);
  if (array == nullptr) return refuse(key, *found, expected);
  for (std::size_t i = 0; i < array->size(); ++i)
    read_object((*array)[i], path_of(path(key), i), reading_, read_members);
  if (array->size() < least) return refuse(key, *found, expected);
  return true;
}

bool JsonObject::read_each_optional(std::string_view key,
                                    const std::function<void(JsonObject&)>& read_members) {
  return read_each_optional(key, 0, read_members);
}

bool JsonObject::read_each_optional(std::string_view key, std::size_t least,
                                    const std::function<void(JsonObject&)>& read_members) {
  note(key);
  return has(key) && read_each(key, least, read_members);
}

bool JsonObject::read_word(std::string_view key, std::span<const std::string_view> words,
                           std::size_t& index) {
  std::string expected = "one of";
  for (const std::string_view word : words)
    expected += std::string(words.front() == word ? " " : ", ") + std::string(word);
  const JsonValue* found = demand(key, expected);
  if (found == nullptr) return false;
  const auto* text = std::get_if<std::string>(&found->value);
  const auto word = text == nullptr ? words.end() : std::find(words.begin(), words.end(), *text);
  if (word == words.end()) return refuse(key, *found, expected);
  index = static_cast<std::size_t>(word - words.begin());
  return true;
}

void JsonObject::read_members(const std::function<void(const std::string&, JsonObject&)>& read_member) {
  any_key_ = true;
  const auto* object = std::get_if<JsonValue::Object>(&value_.value);
  if (object == nullptr) return;
  for (const auto& [key, value] : *object)
    read_object(value, path(key), reading_,
                [&, &name = key](JsonObject& member) { read_member(name, member); });
}

void JsonObject::finish() {
  const auto* object = std::get_if<JsonValue::Object>(&value_.value);
  if (object == nullptr || any_key_) return;
  const std::vector<std::string_view> known(asked_.begin(), asked_.end());
  for (const auto& [key, value] : *object) {
    if (asked_.contains(key)) continue;
    const std::string_view close = reading_.only_counts() ? std::string_view() : closest(key, known);
    reading_.add_mistake(
        path(key), "an unknown key",
        close.empty() ? std::string("no key of this name") : concat({in_quotes(close), "?"}));
  }
}

void read_object(const JsonValue& value, const std::string& path, JsonReading& reading,
                 const std::function<void(JsonObject&)>& read_members) {
  const bool is_object = std::holds_alternative<JsonValue::Object>(value.value);
  if (!is_object && !reading.reads_the_format()) {
    reading.add_mistake(path, short_text(value), "an object");
    return;
  }
  JsonObject object(is_object ? value : empty_object(), path, reading);
  read_members(object);
  object.finish();
}

}  // namespace zeropose
