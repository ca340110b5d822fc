// Whole files in, and the hashes that name what was in them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace zeropose {

inline constexpr std::size_t max_file_bytes = 16 * 1024 * 1024;

// The bytes of a regular file of at most max_file_bytes. Throws ConfigError that names the file: missing, a
// directory, not readable, too large.
std::string read_file(const std::filesystem::path& path);

using Sha256 = std::array<std::uint8_t, 32>;
Sha256 sha256(std::string_view bytes);
std::string hex(const Sha256& digest);

// The first four bytes of the SHA-256, high byte first (spec 80): the hash of a file as stored.
std::uint32_t short_hash(std::string_view bytes);

}  // namespace zeropose
