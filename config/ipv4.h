#pragma once

#include <string>

namespace zeropose {

// True for four decimal numbers 0..255 with dots, as inet_pton takes them.
bool is_ipv4(const std::string& text);

}  // namespace zeropose
