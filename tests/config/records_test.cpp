#include "config/records.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "config/files.h"
#include "tests/support/temporary_folder.h"

namespace zeropose {
namespace {

using testing::HasSubstr;
using testing::Not;

ZeroRecord example(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  ZeroRecord record;
  record.job = "body";
  record.zero.X_WO0.linear() = exp_so3({any(random), any(random), any(random)});
  record.zero.X_WO0.translation() = 1000 * Eigen::Vector3d(any(random), any(random), any(random));
  for (int mark = 0; mark < 12; ++mark)
    record.zero.compensation_O_mm.emplace_back(any(random), any(random), any(random));
  for (std::size_t point = 0; point < 3; ++point) {
    Observation& reference = record.zero.references.emplace_back();
    reference.camera = point % 2;
    reference.mark = point;
    reference.u_px = 500 * Eigen::Vector2d(any(random), any(random));
    reference.covariance_px2 << 1 + any(random) / 2, 0.1, 0.1, 1 + any(random) / 2;
  }
  for (double& value : record.spread) value = any(random) / 3;
  record.time_utc = "2026-01-31T12:34:56Z";
  record.frames = 10;
  record.config_hash = 0x0000beefU;
  record.calibration_hash = 0xfedcba98U;
  return record;
}

void expect_same(const ZeroRecord& a, const ZeroRecord& b) {
  EXPECT_EQ(a.job, b.job);
  EXPECT_TRUE(a.zero.X_WO0.matrix() == b.zero.X_WO0.matrix());
  EXPECT_TRUE(a.zero.compensation_O_mm == b.zero.compensation_O_mm);
  ASSERT_EQ(a.zero.references.size(), b.zero.references.size());
  for (std::size_t i = 0; i < a.zero.references.size(); ++i) {
    const Observation &r = a.zero.references[i], &s = b.zero.references[i];
    EXPECT_EQ(r.camera, s.camera);
    EXPECT_EQ(r.mark, s.mark);
    EXPECT_TRUE(r.u_px == s.u_px);
    EXPECT_TRUE(r.covariance_px2 == s.covariance_px2);
  }
  EXPECT_EQ(a.zero.profile_radius_mm, b.zero.profile_radius_mm);
  EXPECT_TRUE(a.spread == b.spread);
  EXPECT_EQ(a.time_utc, b.time_utc);
  EXPECT_EQ(a.frames, b.frames);
  EXPECT_EQ(a.config_hash, b.config_hash);
  EXPECT_EQ(a.calibration_hash, b.calibration_hash);
}

std::string error_of(const std::filesystem::path& directory, const std::string& job) {
  try {
    load_zero(directory, job);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Records, ComeBackBitForBit) {
  const TemporaryFolder directory;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const ZeroRecord record = example(seed);
    const std::uint32_t id = save_zero(directory.path(), record);
    const auto loaded = load_zero(directory.path(), "body");
    ASSERT_TRUE(loaded);
    expect_same(*loaded, record);
    EXPECT_EQ(loaded->id, id);
    EXPECT_NE(id, 0U);
    EXPECT_EQ(id, short_hash(text_of_file(zero_path(directory.path(), "body"))));
  }
}

// A wheel's has no marks, but the profile that was chosen.
TEST(Records, OfAWheelComeBackBitForBit) {
  const TemporaryFolder directory;
  ZeroRecord record = example(4);
  record.zero.compensation_O_mm.clear();
  record.zero.profile_radius_mm = 705.6 / 3;
  save_zero(directory.path(), record);
  const auto loaded = load_zero(directory.path(), "body");
  ASSERT_TRUE(loaded);
  expect_same(*loaded, record);
}

TEST(Records, OfMarksIsOutdatedForAWheel) {
  const TemporaryFolder directory;
  Cell cell;
  Job job;
  job.name = "body";
  job.wheel.emplace();
  ZeroRecord record = example(5);
  record.zero.compensation_O_mm.clear();
  record.config_hash = cell.config_hash, record.calibration_hash = cell.calibration_hash;
  save_zero(directory.path(), record);
  const StoredZero without = load_zero_for(directory.path(), cell, job);
  EXPECT_EQ(without.code, Code::zero_outdated);
  EXPECT_THAT(without.reason, HasSubstr("no profile of a tyre"));
  record.zero.profile_radius_mm = 235;
  save_zero(directory.path(), record);
  EXPECT_EQ(load_zero_for(directory.path(), cell, job).code, Code::ok);
}

TEST(Records, ExtremeNumbersComeBack) {
  const TemporaryFolder directory;
  ZeroRecord record = example(1);
  record.zero.X_WO0.translation() = Eigen::Vector3d(std::numeric_limits<double>::denorm_min(), -0.0, 1.0 / 3);
  record.zero.compensation_O_mm = {{std::nextafter(1.0, 2.0), 1e-300, -999999.9999999999}};
  save_zero(directory.path(), record);
  const auto loaded = load_zero(directory.path(), "body");
  ASSERT_TRUE(loaded);
  expect_same(*loaded, record);
  EXPECT_TRUE(std::signbit(loaded->zero.X_WO0.translation().y()));
}

TEST(Records, MissingIsNothing) {
  const TemporaryFolder directory;
  EXPECT_FALSE(load_zero(directory.path(), "body"));
  EXPECT_FALSE(load_zero(directory.path() / "no such directory", "body"));
}

TEST(Records, ThePreviousOneIsKept) {
  const TemporaryFolder directory;
  const std::filesystem::path path = zero_path(directory.path(), "body");
  save_zero(directory.path(), example(1));
  EXPECT_FALSE(std::filesystem::exists(previous_of(path)));
  const std::string first = text_of_file(path);
  save_zero(directory.path(), example(2));
  EXPECT_EQ(text_of_file(previous_of(path)), first);
  save_zero(directory.path(), example(3));
  EXPECT_NE(text_of_file(previous_of(path)), first);
}

TEST(Records, EveryJobHasItsFile) {
  const TemporaryFolder directory;
  const std::vector<std::string> jobs{
      "body", "Body", "../body", "a/b", "a%2Fb", "tür 1", std::string(200, 'x'), std::string(199, 'x') + "y"};
  for (const std::string& job : jobs) {
    ZeroRecord record = example(static_cast<unsigned>(job.size()));
    record.job = job;
    save_zero(directory.path(), record);
  }
  for (const std::string& job : jobs) {
    EXPECT_EQ(zero_path(directory.path(), job).parent_path(), directory.path());
    ASSERT_TRUE(load_zero(directory.path(), job)) << job;
    EXPECT_EQ(load_zero(directory.path(), job)->job, job);
  }
}

// The law of the checksum: no single byte of the file may change unnoticed.
TEST(Records, EveryDamagedByteIsNoticed) {
  const TemporaryFolder directory;
  save_zero(directory.path(), example(7));
  const std::filesystem::path path = zero_path(directory.path(), "body");
  const std::string good = text_of_file(path);
  for (std::size_t at = 0; at < good.size(); ++at) {
    // In place: a file system that flushes replaced files would make this slow.
    const auto put = [&](char c) {
      std::fstream(path, std::ios::in | std::ios::out | std::ios::binary)
          .seekp(static_cast<std::streamoff>(at))
          .put(c);
    };
    put(static_cast<char>(good[at] ^ 1));
    EXPECT_THROW(load_zero(directory.path(), "body"), ConfigError) << "byte " << at << " of " << good;
    put(good[at]);
  }
  EXPECT_TRUE(load_zero(directory.path(), "body"));
}

TEST(Records, EveryTruncationIsNoticed) {
  const TemporaryFolder directory;
  save_zero(directory.path(), example(7));
  const std::filesystem::path path = zero_path(directory.path(), "body");
  for (std::size_t length = std::filesystem::file_size(path); length-- > 0;) {
    std::filesystem::resize_file(path, length);
    EXPECT_THROW(load_zero(directory.path(), "body"), ConfigError) << length;
  }
}

TEST(Records, WhatIsWrongIsNamed) {
  const TemporaryFolder directory;
  save_zero(directory.path(), example(7));
  const std::filesystem::path path = zero_path(directory.path(), "body");
  const std::string good = text_of_file(path);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    directory.write(path.filename().string(), text);
    return error_of(directory.path(), "body");
  };
  EXPECT_THAT(with("\"frames\":10", "\"frames\":11"), HasSubstr(path.string() + ": sha256: found \""));
  EXPECT_THAT(with("\"version\":2", "\"version\":1"), HasSubstr("version: found 1, expected 2"));
  EXPECT_THAT(with("zeropose zero", "zeropose cell"),
              HasSubstr("format: found \"zeropose cell\", expected \"zeropose zero\""));
  EXPECT_THAT(with("\"content\"", "\"contents\""), HasSubstr("content: found no such key"));
}

TEST(Records, ZeroOfAnotherJobIsRefused) {
  const TemporaryFolder directory;
  save_zero(directory.path(), example(7));
  std::filesystem::copy(zero_path(directory.path(), "body"), zero_path(directory.path(), "door"));
  EXPECT_THAT(error_of(directory.path(), "door"),
              HasSubstr("content.job: found \"body\", expected \"door\""));
}

TEST(Records, WhatCannotBeReadBackIsNotSaved) {
  const TemporaryFolder directory;
  save_zero(directory.path(), example(1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<ZeroRecord> bad(6, example(2));
  bad[0].zero.X_WO0.translation().x() = nan;
  bad[1].zero.X_WO0.linear() *= 1.001;
  bad[2].zero.compensation_O_mm[3].y() = std::numeric_limits<double>::infinity();
  bad[3].time_utc = "yesterday";
  bad[4].frames = 0;
  bad[5].spread[2] = nan;
  for (const ZeroRecord& record : bad)
    EXPECT_THROW(save_zero(directory.path(), record), std::invalid_argument);
  expect_same(load_zero(directory.path(), "body").value(), example(1));
}

// What becomes of the zero of example(7) in a cell (spec 85 R20).
class ZeroForACell : public testing::Test {
 protected:
  ZeroForACell() {
    job.name = "body";
    job.marks.resize(12);
    cell.config_hash = 0x0000beefU;
    cell.calibration_hash = 0xfedcba98U;
    save_zero(directory.path(), example(7));
  }

  void expect(Code code, const std::string& sentence) const {
    const StoredZero stored = load_zero_for(directory.path(), cell, job);
    EXPECT_EQ(stored.code, code) << stored.reason;
    EXPECT_EQ(stored.record.has_value(), code == Code::ok);
    EXPECT_THAT(stored.reason, HasSubstr(sentence));
    EXPECT_EQ(stored.reason.empty(), code == Code::ok);
  }

  TemporaryFolder directory;
  Cell cell;
  Job job;
};

TEST_F(ZeroForACell, IsUsedWithTheFilesItWasMadeWith) {
  expect(Code::ok, "");
  expect_same(load_zero_for(directory.path(), cell, job).record.value(), example(7));
}

TEST_F(ZeroForACell, IsMissingForAnotherJob) {
  job.name = "door";
  expect(Code::zero_missing, "no zero measurement was made for job door");
}

TEST_F(ZeroForACell, IsOutdatedByAnotherFile) {
  cell.config_hash ^= 1;
  expect(Code::zero_outdated, "job body of 2026-01-31T12:34:56Z was made with another cell file");
  cell.calibration_hash ^= 1;
  expect(Code::zero_outdated, "was made with another cell file and another calibration");
  cell.config_hash ^= 1;
  expect(Code::zero_outdated, "was made with another calibration");
}

TEST_F(ZeroForACell, IsOutdatedByAnotherNumberOfMarks) {
  job.marks.pop_back();
  expect(Code::zero_outdated, "was made with 12 marks, the job has 11");
}

TEST_F(ZeroForACell, ThatIsDamagedIsNotUsed) {
  const std::filesystem::path path = zero_path(directory.path(), "body");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  expect(Code::storage_failed, "the zero measurement of job body cannot be used: " + path.string());
  std::filesystem::resize_file(path, 0);
  expect(Code::storage_failed, "cannot be used: " + path.string());
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  expect(Code::storage_failed, "found a directory");
}

TEST(Records, TimeIsUtc) {
  EXPECT_EQ(iso8601_utc(std::chrono::system_clock::from_time_t(1769862896)), "2026-01-31T12:34:56Z");
}

}  // namespace
}  // namespace zeropose
