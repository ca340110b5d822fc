// A result block for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "daemon/cli/answer.h"
#include "protocol/codec.h"

namespace zeropose::cli {

// What contradicts itself or is unknown in a block whose CRC is right; one sentence each.
std::vector<std::string> oddities(const ResultBlock& block);

Json block_json(const ResultBlock& block);
std::string block_text(const ResultBlock& block);  // one line, without its end

// What a block that cannot be decoded means, and what to do.
std::string text_of(BlockProblem problem);

}  // namespace zeropose::cli
