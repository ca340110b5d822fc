// Records that must survive a power cut: one JSON file each, with format, version and checksum inside.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/atomic_file.h"
#include "config/json_tree.h"

namespace zeropose {

struct RecordKind {
  std::string format;  // "zeropose zero"
  int version = 1;
};

struct LoadedRecord {
  JsonValue content;
  std::uint32_t id = 0;  // first four bytes of SHA-256 over the file as stored; 1 instead of 0
};

// `content` is the text of one JSON object. Returns the id of the record. Throws std::system_error when it is
// not safely stored: the old record is then still in place (see replace_file).
std::uint32_t save_record(const std::filesystem::path& path, const RecordKind& kind,
                          const std::string& content, FileCalls& calls = system_file_calls());

// nullopt: no such file. Throws ConfigError that names what is wrong: format, version, checksum, JSON.
std::optional<LoadedRecord> load_record(const std::filesystem::path& path, const RecordKind& kind);

}  // namespace zeropose
