// What the wires demand of their options, for those who want to know before they open one.
#pragma once

#include "protocol/link_options.h"

namespace zeropose {

// Throw std::invalid_argument that says what is wrong and what is allowed.
void check(const ModbusRtuOptions& options);
void check(const ModbusClientOptions& options);

}  // namespace zeropose
