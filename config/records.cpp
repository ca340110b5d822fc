#include "config/records.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "config/files.h"
#include "config/json_reader.h"
#include "config/record_file.h"
#include "config/text.h"

namespace zeropose {
namespace {

using Json = nlohmann::ordered_json;
using RotationAndPosition = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

constexpr double largest = 1e6;                  // mm or rad: anything beyond is damage
constexpr double rotation_tolerance = 1e-9;      // of R^T R - I
const RecordKind zero_kind{"zeropose zero", 2};  // 2: with the pixels of the reference points

std::string hash_text(std::uint32_t hash) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (int shift = 28; shift >= 0; shift -= 4) text += digits[(hash >> shift) & 15U];
  return text;
}

bool is_rotation(const Eigen::Matrix3d& R) {
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < rotation_tolerance && R.determinant() > 0;
}

bool is_time(const std::string& text) {
  static constexpr std::string_view pattern = "0000-00-00T00:00:00Z";
  return text.size() == pattern.size() &&
         std::equal(text.begin(), text.end(), pattern.begin(),
                    [](char c, char p) { return p == '0' ? c >= '0' && c <= '9' : c == p; });
}

Json json_of(std::span<const double> values) {
  return Json(std::vector<double>(values.begin(), values.end()));
}

Json json_of(const Observation& reference) {
  const Eigen::Matrix2d& S = reference.covariance_px2;
  return {{"camera", reference.camera},
          {"point", reference.mark},
          {"u_px", reference.u_px.x()},
          {"v_px", reference.u_px.y()},
          {"suu", S(0, 0)},
          {"svv", S(1, 1)},
          {"suv", S(0, 1)}};
}

// The pose twice: six numbers for people, the rows of [R | p] to read back exactly.
Json json_of(const ZeroRecord& record) {
  const Pose& X_WO0 = record.zero.X_WO0;
  const SixNumbers six = to_six_numbers(X_WO0);
  const RotationAndPosition rows = X_WO0.matrix().topRows<3>();
  Json compensation = Json::array();
  for (const Eigen::Vector3d& shift : record.zero.compensation_O_mm)
    compensation.push_back(json_of({shift.data(), 3}));
  Json references = Json::array();
  for (const Observation& reference : record.zero.references) references.push_back(json_of(reference));
  Json json{{"job", record.job},
            {"time_utc", record.time_utc},
            {"frames", record.frames},
            {"config_hash", hash_text(record.config_hash)},
            {"calibration_hash", hash_text(record.calibration_hash)},
            {"X_WO0", {six.x_mm, six.y_mm, six.z_mm, six.rx_deg, six.ry_deg, six.rz_deg}},
            {"X_WO0_rows", json_of({rows.data(), 12})},
            {"spread", json_of({record.spread.data(), 6})},
            {"compensation_mm", compensation},
            {"references", references}};
  if (record.zero.profile_radius_mm > 0) json["profile_radius_mm"] = record.zero.profile_radius_mm;
  return json;
}

void read_hash(JsonObject& object, std::string_view key, std::uint32_t& hash) {
  std::string text;
  if (!object.read(key, text)) return;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, hash, 16);
  if (error != std::errc() || stop != end || text.size() != 8)
    object.add_mistake(key, in_quotes(text), "eight hexadecimal digits");
}

void read_pose(JsonObject& object, Pose& X_WO0) {
  Pose shown = Pose::Identity();
  RotationAndPosition rows;
  const bool has_shown = object.read("X_WO0", shown);
  if (!object.read("X_WO0_rows", std::span<double>(rows.data(), 12), largest)) return;
  Pose exact = Pose::Identity();
  exact.linear() = rows.leftCols<3>();
  exact.translation() = rows.col(3);
  if (!is_rotation(exact.linear()))
    object.add_mistake("X_WO0_rows", "rows that are no rotation", "the rows of [R | p]");
  else if (has_shown && difference(shown, exact).norm() > 1e-6)
    object.add_mistake("X_WO0", "another pose than in X_WO0_rows", "the same pose twice");
  else
    X_WO0 = exact;
}

// Camera and point are indices in the cell file whose hash the record carries.
Observation read_reference(JsonObject& object) {
  Observation reference;
  int camera = 0, point = 0;
  object.read("camera", camera, 0, 1000);
  object.read("point", point, 0, 100000);
  reference.camera = static_cast<std::size_t>(camera);
  reference.mark = static_cast<std::size_t>(point);
  Eigen::Matrix2d& S = reference.covariance_px2;
  object.read("u_px", reference.u_px.x(), {-largest, largest});
  object.read("v_px", reference.u_px.y(), {-largest, largest});
  object.read("suu", S(0, 0), {0, largest, true});
  object.read("svv", S(1, 1), {0, largest, true});
  if (object.read("suv", S(0, 1), {-largest, largest}) && !(S(0, 1) * S(0, 1) < S(0, 0) * S(1, 1)))
    object.add_mistake("suv", std::to_string(S(0, 1)), "suv^2 < suu svv: a covariance");
  S(1, 0) = S(0, 1);
  return reference;
}

ZeroRecord read_zero(JsonObject& object) {
  ZeroRecord record;
  object.read("job", record.job);
  if (object.read("time_utc", record.time_utc) && !is_time(record.time_utc))
    object.add_mistake("time_utc", in_quotes(record.time_utc), "a time such as 2026-01-31T12:34:56Z");
  object.read("frames", record.frames, 1, 1000000);
  read_hash(object, "config_hash", record.config_hash);
  read_hash(object, "calibration_hash", record.calibration_hash);
  read_pose(object, record.zero.X_WO0);
  object.read("spread", std::span<double>(record.spread.data(), 6), largest);
  object.read("compensation_mm", record.zero.compensation_O_mm, largest);
  object.read_each("references", 0,
                   [&](JsonObject& member) { record.zero.references.push_back(read_reference(member)); });
  object.read_optional("profile_radius_mm", record.zero.profile_radius_mm, NumberRange{0, largest, true});
  return record;
}

ZeroRecord zero_of(const JsonValue& content, const std::string& file, const std::string& job) {
  JsonReading reading(file);
  ZeroRecord record;
  read_object(content, "content", reading, [&](JsonObject& object) {
    record = read_zero(object);
    if (!record.job.empty() && record.job != job)
      object.add_mistake("job", in_quotes(record.job), in_quotes(job));
  });
  reading.throw_if_wrong();
  return record;
}

// What it was made with that is another one now, or nothing.
std::string why_outdated(const ZeroRecord& record, const Cell& cell, const Job& job) {
  const bool config = record.config_hash != cell.config_hash;
  const bool calibration = record.calibration_hash != cell.calibration_hash;
  if (config && calibration) return "another cell file and another calibration";
  if (config) return "another cell file";
  if (calibration) return "another calibration";
  if (job.wheel && !(record.zero.profile_radius_mm > 0)) return "no profile of a tyre";
  const std::size_t marks = record.zero.compensation_O_mm.size();
  if (marks == job.marks.size()) return {};
  return concat({std::to_string(marks), " marks, the job has ", std::to_string(job.marks.size())});
}

// Letters, digits, '-' and '_' stay; long names are cut and told apart by a hash.
std::string file_name_of(const std::string& name) {
  constexpr std::size_t longest = 120;
  static constexpr char digits[] = "0123456789ABCDEF";
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' || c == '_';
    if (plain)
      text += c;
    else
      text += {'%', digits[byte >> 4], digits[byte & 15]};
  }
  return text.size() <= longest ? text : text.substr(0, longest) + "-" + hex(sha256(name));
}

}  // namespace

std::filesystem::path zero_path(const std::filesystem::path& directory, const std::string& job) {
  return directory / concat({"zero-", file_name_of(job), ".json"});
}

std::uint32_t save_zero(const std::filesystem::path& directory, const ZeroRecord& record, FileCalls& calls) {
  std::string content;
  try {
    content = json_of(record).dump();
    // What cannot be read back must not replace what can: NaN, no rotation, no time.
    zero_of(parse_json(content, "zero"), "zero", record.job);
  } catch (const std::exception& error) {
    throw std::invalid_argument(concat({"a zero that cannot be saved: ", error.what()}));
  }
  return save_record(zero_path(directory, record.job), zero_kind, content, calls);
}

std::optional<ZeroRecord> load_zero(const std::filesystem::path& directory, const std::string& job) {
  const std::filesystem::path path = zero_path(directory, job);
  const std::optional<LoadedRecord> loaded = load_record(path, zero_kind);
  if (!loaded) return std::nullopt;
  ZeroRecord record = zero_of(loaded->content, path.string(), job);
  record.id = loaded->id;
  return record;
}

StoredZero load_zero_for(const std::filesystem::path& directory, const Cell& cell, const Job& job) {
  StoredZero stored;
  try {
    stored.record = load_zero(directory, job.name);
  } catch (const std::exception& error) {
    return {Code::storage_failed,
            concat({"the zero measurement of job ", job.name, " cannot be used: ", error.what()}),
            {}};
  }
  if (!stored.record)
    return {Code::zero_missing, concat({"no zero measurement was made for job ", job.name}), {}};
  if (std::string why = why_outdated(*stored.record, cell, job); !why.empty())
    return {Code::zero_outdated,
            concat({"the zero measurement of job ", job.name, " of ", stored.record->time_utc,
                    " was made with ", why}),
            {}};
  stored.code = Code::ok;
  return stored;
}

std::string iso8601_utc(std::chrono::system_clock::time_point time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return {text.data(), length};
}

}  // namespace zeropose
