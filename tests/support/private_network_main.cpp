// main() of tests that serve GigE Vision cameras on loopback: inside a network of their own.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tests/support/netns.h"

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const std::vector<std::string> addresses = {
      "127.0.0.11", "127.0.0.12", "127.0.0.13", "127.0.0.14", "127.0.0.21", "127.0.0.22",
      "127.0.0.31", "127.0.0.41", "127.0.0.51", "127.0.0.52", "127.0.0.53", "127.0.0.54",
      "127.0.0.55", "127.0.0.56", "127.0.0.61", "127.0.0.62", "127.0.0.71", "127.0.0.72",
      "127.0.0.73", "127.0.0.74", "127.0.0.75", "127.0.0.76"};
  const std::string impossible = zeropose::enter_private_network(addresses);
  if (!impossible.empty()) {
    std::printf("skipped, all of them: %s\n", impossible.c_str());
    constexpr int skipped = 77;  // as CTest is told
    return ::testing::GTEST_FLAG(list_tests) ? RUN_ALL_TESTS() : skipped;
  }
  return RUN_ALL_TESTS();
}
