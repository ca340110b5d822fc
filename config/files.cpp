#include "config/files.h"

#include <openssl/evp.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "config/config_error.h"

namespace zeropose {
namespace {

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& found) {
  throw ConfigError({path.string() + ": found " + found + ", expected a readable file of at most 16 MB"});
}

}  // namespace

ConfigError::ConfigError(std::vector<std::string> mistakes)
    : std::runtime_error(joined(mistakes)), mistakes_(std::move(mistakes)) {}

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) refuse(path, "no such file");
  if (error) refuse(path, error.message());
  if (status.type() == std::filesystem::file_type::directory) refuse(path, "a directory");
  if (status.type() != std::filesystem::file_type::regular) refuse(path, "no regular file");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse(path, std::generic_category().message(errno));
  std::string bytes;
  std::vector<char> chunk(std::size_t{64} * 1024);
  while (stream) {
    stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    bytes.append(chunk.data(), static_cast<std::size_t>(stream.gcount()));
    if (bytes.size() > max_file_bytes) refuse(path, "more than 16 MB");
  }
  if (stream.bad()) refuse(path, "a read error");
  return bytes;
}

Sha256 sha256(std::string_view bytes) {
  Sha256 digest{};
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) != 1 ||
      length != digest.size())
    throw std::runtime_error("libcrypto cannot compute SHA-256");
  return digest;
}

std::string hex(const Sha256& digest) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : digest) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

std::uint32_t short_hash(std::string_view bytes) {
  const Sha256 digest = sha256(bytes);
  return std::uint32_t{digest[0]} << 24 | std::uint32_t{digest[1]} << 16 | std::uint32_t{digest[2]} << 8 |
         digest[3];
}

}  // namespace zeropose
