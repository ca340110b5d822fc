#include "config/ipv4.h"

#include <arpa/inet.h>

namespace zeropose {

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1 && text.find('\0') == std::string::npos;
}

}  // namespace zeropose
