// What --version prints: program, version, commit, build type, libraries.
#pragma once

#include <string>

namespace zeropose {

std::string version_text(const std::string& program);

}  // namespace zeropose
