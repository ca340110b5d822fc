// The larger published data sets are not part of the project: tests on them are skipped where they are
// missing.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace zeropose::test {

inline constexpr const char* data_not_found = "skipped: data not found";

// A file of the shared data: below the environment variable ZEROPOSE_DATA, or beside the sources.
inline std::optional<std::string> shared_data(const std::string& inside) {
  const char* const given = std::getenv("ZEROPOSE_DATA");
  const std::filesystem::path file =
      std::filesystem::path(given ? given : ZEROPOSE_SOURCE_DIR "/../shared/data") / inside;
  if (!std::filesystem::exists(file)) return std::nullopt;
  return file.string();
}

}  // namespace zeropose::test
