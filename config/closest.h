// "Did you mean": the word nearest to a misspelt one.
#pragma once

#include <span>
#include <string_view>

namespace zeropose {

// The word with the fewest single-letter edits (insert, delete, replace) from `word`, or an empty view when
// every one needs more than a third of the word's length (at least one edit is allowed).
std::string_view closest(std::string_view word, std::span<const std::string_view> words);

}  // namespace zeropose
