// What is thrown when a file that people write or edit is wrong.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace zeropose {

// Everything that is wrong with a file, one line per mistake: file, line or key path, what was found, what is
// expected.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<std::string> mistakes);
  const std::vector<std::string>& mistakes() const { return mistakes_; }

 private:
  std::vector<std::string> mistakes_;
};

}  // namespace zeropose
