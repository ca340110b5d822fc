// A private network for one test program: its own loopback, on which nothing else can be touched.
#pragma once

#include <span>
#include <string>

namespace zeropose {

// Moves this process into a new network namespace (and user namespace, when not root), brings its loopback up
// and adds the addresses with a /8 mask. Precondition: the process has one thread. Returns why it is
// impossible; empty: done.
std::string enter_private_network(std::span<const std::string> addresses);

}  // namespace zeropose
