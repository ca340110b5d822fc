// Typed, strict reading of a JSON tree: every mistake is collected with its key path, none stops the reading.
//
//   JsonReading reading(file);
//   read_object(tree, "", reading, [&](JsonObject& cell) { cell.read("name", name); ... });
//   reading.throw_if_wrong();
//
// Booleans, integers and numbers are never converted into each other, so 1.9 is no integer and true no
// number.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/rigid.h"
#include "config/json_tree.h"

namespace zeropose {

// Collects what is wrong with one file.
class JsonReading {
 public:
  explicit JsonReading(std::string file) : file_(std::move(file)) {}

  // A reading that walks through a format instead of a file: see known_keys().
  static JsonReading of_the_format();

  void add_mistake(const std::string& path, const std::string& found, const std::string& expected);
  // Throws ConfigError. More than a hundred mistakes are counted only.
  void throw_if_wrong() const;
  std::vector<std::string> mistakes() const;
  bool only_counts() const;  // there are a hundred already

  // The path of every key that was asked for, indices as []: "jobs[].marks[].name".
  const std::set<std::string>& known_keys() const { return known_keys_; }
  void note_key(const std::string& path);
  bool reads_the_format() const { return reads_the_format_; }

 private:
  std::string file_;
  std::vector<std::string> mistakes_;
  std::size_t uncounted_ = 0;
  std::set<std::string> known_keys_;
  bool reads_the_format_ = false;
};

// Inclusive. `above` excludes the minimum.
struct NumberRange {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  bool above = false;
};

std::string path_of(const std::string& path, std::size_t index);  // path[index]

// One object of the tree. The value of a wrong or missing key stays untouched. read() demands the key,
// read_optional() leaves the value as it is when the key is absent; both return true when they read a value.
class JsonObject {
 public:
  JsonObject(const JsonValue& value, std::string path, JsonReading& reading);

  bool read(std::string_view key, std::string& value);
  bool read(std::string_view key, bool& value);
  bool read(std::string_view key, double& value, NumberRange range);
  bool read(std::string_view key, int& value, int min, int max);
  bool read(std::string_view key, Eigen::Vector3d& value,
            double largest);  // [x, y, z], |component| <= largest
  // As many numbers as `values` has, each |number| <= largest.
  bool read(std::string_view key, std::span<double> values, double largest);
  // An array of [x, y, z], any number of them.
  bool read(std::string_view key, std::vector<Eigen::Vector3d>& values, double largest);
  // [x, y, z, rx, ry, rz] in mm and degrees (spec 10); lengths to 1e6 mm, angles to 360 deg.
  bool read(std::string_view key, Pose& X_AB);
  bool read(std::string_view key, std::vector<std::string>& values);
  bool read_range(std::string_view key, double& min, double& max, double largest);  // [min, max], min < max
  bool read(std::string_view key, const std::function<void(JsonObject&)>& read_members);
  // An array of at least `least` objects.
  bool read_each(std::string_view key, std::size_t least,
                 const std::function<void(JsonObject&)>& read_members);

  // As read(), but the key may be absent.
  template <typename... Arguments>
  bool read_optional(std::string_view key, Arguments&&... arguments) {
    note(key);
    return has(key) && read(key, std::forward<Arguments>(arguments)...);
  }
  bool read_each_optional(std::string_view key, const std::function<void(JsonObject&)>& read_members);
  bool read_each_optional(std::string_view key, std::size_t least,
                          const std::function<void(JsonObject&)>& read_members);

  // One of the given words; `index` becomes its index.
  bool read_word(std::string_view key, std::span<const std::string_view> words, std::size_t& index);

  // Every member as an object, whatever its key: a map by name.
  void read_members(const std::function<void(const std::string& key, JsonObject&)>& read_member);

  bool has(std::string_view key) const;
  const std::string& path() const { return path_; }
  std::string path(std::string_view key) const;
  void add_mistake(std::string_view key, const std::string& found, const std::string& expected);

  // Takes note of a key that is read elsewhere.
  void skip(std::string_view key) { note(key); }

  // Reports every key that nobody asked for.
  void finish();

 private:
  const JsonValue* demand(std::string_view key, std::string_view expected);
  void note(std::string_view key);
  bool refuse(std::string_view key, const JsonValue& value, const std::string& expected);
  bool numbers(const JsonValue& found, const std::string& path, std::span<double> values,
               std::span<const double> largest, const std::string& expected);

  const JsonValue& value_;
  std::string path_;
  JsonReading& reading_;
  std::set<std::string, std::less<>> asked_;
  bool any_key_ = false;
};

// Checks that the value is an object, lets read_members read it and reports unknown keys.
void read_object(const JsonValue& value, const std::string& path, JsonReading& reading,
                 const std::function<void(JsonObject&)>& read_members);

}  // namespace zeropose
