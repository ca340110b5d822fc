// What the cell has learned and must not lose: zero measurements, one file per job in the state directory.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "config/atomic_file.h"
#include "config/cell.h"
#include "config/config_error.h"
#include "measure/zero.h"

namespace zeropose {

struct ZeroRecord {
  std::string job;  // its name
  Zero zero;
  std::string time_utc;              // ISO 8601: 2026-01-31T12:34:56Z
  Vector6 spread = Vector6::Zero();  // as in ZeroResult: mm and rad
  int frames = 0;
  std::uint32_t config_hash = 0, calibration_hash = 0;  // of the files it was measured with
  std::uint32_t id = 0;  // set by load_zero: first four bytes of SHA-256 over the file, never 0
};

// Saves atomically; every number comes back bit for bit. The record before stays as FILE.previous. Returns
// the zero's id. Throws std::system_error when it is not safely stored (the old one is then still in place),
// and std::invalid_argument for a record that load_zero would refuse. The directory must exist.
std::uint32_t save_zero(const std::filesystem::path& directory, const ZeroRecord& record,
                        FileCalls& calls = system_file_calls());

// nullopt: there is none. Throws ConfigError when there is one but it cannot be trusted.
std::optional<ZeroRecord> load_zero(const std::filesystem::path& directory, const std::string& job);

// A job's zero as far as a cell may use it (spec 85 R20).
struct StoredZero {
  Code code = Code::internal;
  std::string reason;                // one sentence, empty when ok
  std::optional<ZeroRecord> record;  // only when ok
};

// Codes: zero_missing (there is none), storage_failed (it is damaged or cannot be read), zero_outdated (made
// with another cell file or another calibration, or for another number of marks). Never throws for what a
// file can be.
StoredZero load_zero_for(const std::filesystem::path& directory, const Cell& cell, const Job& job);

// Where the zero of a job lies: zero-JOB.json, other bytes than letters, digits, '-', '_' as %XX.
std::filesystem::path zero_path(const std::filesystem::path& directory, const std::string& job);

std::string iso8601_utc(std::chrono::system_clock::time_point time);

}  // namespace zeropose
