// Small pieces of messages.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace zeropose {

inline std::string concat(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

inline std::string in_quotes(std::string_view text) { return concat({"\"", text, "\""}); }

}  // namespace zeropose
