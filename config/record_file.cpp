#include "config/record_file.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "config/config_error.h"
#include "config/files.h"
#include "config/json_reader.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::string_view content_key = ",\"content\":";
constexpr std::string_view tail = "}\n";

std::uint32_t id_of(std::string_view file_text) {
  const std::uint32_t hash = short_hash(file_text);
  return hash == 0 ? 1 : hash;
}

std::string text_of_record(const RecordKind& kind, const std::string& content) {
  const nlohmann::ordered_json head = {
      {"format", kind.format}, {"version", kind.version}, {"sha256", hex(sha256(content))}};
  std::string text = head.dump();
  text.pop_back();
  return concat({text, content_key, content, tail});
}

// The bytes under the checksum: between "content": and the closing brace.
std::string_view content_of(std::string_view text) {
  const std::size_t key = text.find(content_key);
  if (key == std::string_view::npos || !text.ends_with(tail)) return {};
  const std::string_view rest = text.substr(key + content_key.size());
  return rest.substr(0, rest.size() - tail.size());
}

void check_head(const JsonValue& tree, std::string_view text, const RecordKind& kind, JsonReading& reading) {
  std::string format, sum;
  int version = 0;
  read_object(tree, "", reading, [&](JsonObject& record) {
    if (record.read("format", format) && format != kind.format)
      record.add_mistake("format", in_quotes(format), in_quotes(kind.format));
    if (record.read("version", version, 1, 1000000) && version != kind.version)
      record.add_mistake("version", std::to_string(version), std::to_string(kind.version));
    const std::string actual = hex(sha256(content_of(text)));
    if (record.read("sha256", sum) && sum != actual)
      record.add_mistake(
          "sha256", in_quotes(sum),
          concat({"the checksum of the content, ", actual, ": the record was damaged or edited"}));
    record.has("content") ? record.skip("content")
                          : record.add_mistake("content", "no such key", "the content of the record");
  });
}

}  // namespace

std::uint32_t save_record(const std::filesystem::path& path, const RecordKind& kind,
                          const std::string& content, FileCalls& calls) {
  const std::string text = text_of_record(kind, content);
  replace_file(path, text, calls);
  return id_of(text);
}

std::optional<LoadedRecord> load_record(const std::filesystem::path& path, const RecordKind& kind) {
  std::error_code ignored;  // what else may be wrong is said by read_file
  if (std::filesystem::symlink_status(path, ignored).type() == std::filesystem::file_type::not_found)
    return std::nullopt;
  const std::string text = read_file(path);
  JsonValue tree = parse_json(text, path.string());
  JsonReading reading(path.string());
  check_head(tree, text, kind, reading);
  reading.throw_if_wrong();
  return LoadedRecord{*tree.find("content"), id_of(text)};
}

}  // namespace zeropose
