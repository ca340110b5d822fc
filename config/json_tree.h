// JSON text to a tree, strictly: comments allowed, duplicate keys, overflowing numbers and deep nesting
// refused.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace zeropose {

// One JSON value. Objects keep the order of the file.
struct JsonValue {
  using Array = std::vector<JsonValue>;
  using Object = std::vector<std::pair<std::string, JsonValue>>;
  // An integer that fits neither integer type arrives as double.
  std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double, std::string, Array, Object> value =
      nullptr;

  const JsonValue* find(std::string_view key) const;  // nullptr: no object or no such key
};

// As it would be written, cut to a length fit for a message: 1.9, "four", an array of 2.
std::string short_text(const JsonValue& value);

// Throws ConfigError: `file:line:column: found ..., expected ...` for the first syntax error, `file: path:
// ...` for every duplicate key.
JsonValue parse_json(std::string_view text, const std::string& file);

}  // namespace zeropose
