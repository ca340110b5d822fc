#include "config/json_tree.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "config/config_error.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::size_t max_depth = 32;
constexpr std::size_t max_shown = 60;

std::string place(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, std::min(offset, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t start = before.rfind('\n') == std::string_view::npos ? 0 : before.rfind('\n') + 1;
  return std::to_string(line) + ":" + std::to_string(before.size() - start + 1);
}

// "[json.exception.parse_error.101] parse error at line 1, column 2: reason" -> "reason"
std::string reason_of(const std::string& message) {
  const std::size_t after_place = message.find("column ");
  const std::size_t from =
      after_place == std::string::npos ? message.find("] ") : message.find(": ", after_place);
  return from == std::string::npos ? message : message.substr(from + 2);
}

// Receives the parser's events and builds the tree.
class TreeBuilder {
 public:
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;

  TreeBuilder(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  bool null() { return put({nullptr}); }
  bool boolean(bool value) { return put({value}); }
  bool number_integer(number_integer_t value) { return put({std::int64_t{value}}); }
  bool number_unsigned(number_unsigned_t value) { return put({std::uint64_t{value}}); }
  bool number_float(double value, const std::string&) { return put({value}); }
  bool string(std::string& value) { return put({std::move(value)}); }
  bool binary(nlohmann::json::binary_t&) { return false; }
  bool start_array(std::size_t) { return open({JsonValue::Array{}}); }
  bool end_array() { return close(); }
  bool start_object(std::size_t) { return open({JsonValue::Object{}}); }
  bool end_object() { return close(); }

  bool key(std::string& name) {
    Level& level = levels_.back();
    level.key = name;
    level.duplicate = !level.seen.insert(name).second;
    if (level.duplicate) mistakes_.push_back(file_ + ": " + path() + ": found the key twice, expected once");
    return true;
  }

  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& error) {
    // The position counts the characters read, the last of which is the wrong one.
    mistakes_.push_back(file_ + ":" + place(text_, position > 0 ? position - 1 : 0) +
                        ": found a syntax error (" + reason_of(error.what()) + "), expected JSON");
    return false;
  }

  JsonValue result() {
    if (!mistakes_.empty()) throw ConfigError(std::move(mistakes_));
    return std::move(root_);
  }

 private:
  struct Level {
    JsonValue* value;
    std::string key;
    std::set<std::string> seen;
    bool duplicate = false;
  };

  // Where the next value belongs. A duplicate key's value is built and thrown away.
  JsonValue* place_for(JsonValue value) {
    if (levels_.empty()) return &(root_ = std::move(value));
    Level& level = levels_.back();
    if (auto* array = std::get_if<JsonValue::Array>(&level.value->value))
      return &array->emplace_back(std::move(value));
    if (level.duplicate)
      return &(discarded_.emplace_back(std::make_unique<JsonValue>(std::move(value))), *discarded_.back());
    auto& object = std::get<JsonValue::Object>(level.value->value);
    return &object.emplace_back(level.key, std::move(value)).second;
  }

  bool put(JsonValue value) {
    place_for(std::move(value));
    return true;
  }

  bool open(JsonValue value) {
    if (levels_.size() == max_depth) {
      mistakes_.push_back(file_ + ": " + path() + ": found nesting deeper than 32, expected less");
      return false;
    }
    JsonValue* opened = place_for(std::move(value));
    levels_.push_back({opened, {}, {}});
    return true;
  }

  bool close() {
    levels_.pop_back();
    return true;
  }

  std::string path() const {
    std::string text;
    for (const Level& level : levels_) {
      if (const auto* array = std::get_if<JsonValue::Array>(&level.value->value))
        text += concat({"[", std::to_string(array->empty() ? 0 : array->size() - 1), "]"});
      else
        text += (text.empty() ? "" : ".") + level.key;
    }
    return text;
  }

  std::string_view text_;
  std::string file_;
  JsonValue root_;
  std::vector<Level> levels_;
  std::vector<std::unique_ptr<JsonValue>> discarded_;
  std::vector<std::string> mistakes_;
};

std::string cut(std::string text) {
  if (text.size() <= max_shown) return text;
  std::size_t end = max_shown;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

struct ShortText {
  std::string operator()(std::nullptr_t) const { return "null"; }
  std::string operator()(const JsonValue::Array& array) const {
    return concat({"an array of ", std::to_string(array.size())});
  }
  std::string operator()(const JsonValue::Object&) const { return "an object"; }
  std::string operator()(const std::string& text) const { return cut(nlohmann::json(text).dump()); }
  template <typename Scalar>
  std::string operator()(Scalar scalar) const {
    return nlohmann::json(scalar).dump();
  }
};

}  // namespace

const JsonValue* JsonValue::find(std::string_view key) const {
  const auto* object = std::get_if<Object>(&value);
  if (object == nullptr) return nullptr;
  const auto member =
      std::find_if(object->begin(), object->end(), [&](const auto& m) { return m.first == key; });
  return member == object->end() ? nullptr : &member->second;
}

std::string short_text(const JsonValue& value) { return std::visit(ShortText{}, value.value); }

JsonValue parse_json(std::string_view text, const std::string& file) {
  TreeBuilder builder(text, file);
  const bool strict = true, ignore_comments = true;
  nlohmann::json::sax_parse(text.begin(), text.end(), &builder, nlohmann::json::input_format_t::json, strict,
                            ignore_comments);
  return builder.result();
}

}  // namespace zeropose
