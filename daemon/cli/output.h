// Files that verbs write.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "config/text.h"

namespace zeropose::cli {

// A file in use is never overwritten silently. Throws std::invalid_argument when it exists and nobody said
// --replace.
inline void refuse_existing(const std::filesystem::path& path, bool replace) {
  std::error_code ignored;
  if (!replace && std::filesystem::exists(path, ignored))
    throw std::invalid_argument(
        concat({path.string(), ": the file exists; another name, or --replace (the old one is kept as ",
                path.string(), ".previous)"}));
}

}  // namespace zeropose::cli
