// find_marks() in windows with faults of growing strength: what it finds, what it misses and why. Whatever it
// finds must be right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "measure/marks.h"
#include "tests/measure/hard_rows.h"
#include "tests/support/sanitized.h"

namespace zeropose {
namespace {

using test::Fault;
using test::hard_frame;
using test::HardFrame;
using test::HardRow;

// An error that neither a robot would forgive nor the covariance admits.
bool is_wrong(const HardFrame& frame, const MarkFinding& finding) {
  const double error_px = (finding.u_px - frame.centre_px).norm();
  const double sigma_px = std::sqrt(finding.covariance_px2.trace());
  return !frame.visible || !(error_px <= std::max(0.25, 5 * sigma_px));
}

struct Tally {
  std::vector<double> errors_px;  // of the marks that were found
  std::vector<unsigned> wrong;    // seeds
  std::map<std::string, int> reasons;

  double error_px(double share) const {
    if (errors_px.empty()) return 0;
    return errors_px[static_cast<std::size_t>(share * double(errors_px.size() - 1))];
  }
};

Tally tally_of(const HardRow& row) {
  Tally tally;
  for (unsigned seed = 0; seed < static_cast<unsigned>(test::trials(row.frames)); ++seed) {
    const HardFrame frame = hard_frame(row.given, seed);
    const MarkFinding finding = find_marks(frame.shot.view(), {&frame.search, 1}).front();
    if (finding.status != MarkStatus::found) {
      ++tally.reasons[std::string(name_of(finding.status))];
      continue;
    }
    tally.errors_px.push_back((finding.u_px - frame.centre_px).norm());
    if (is_wrong(frame, finding)) tally.wrong.push_back(seed);
  }
  std::sort(tally.errors_px.begin(), tally.errors_px.end());
  return tally;
}

void print(const HardRow& row, const Tally& tally) {
  std::ostringstream reasons;
  for (const auto& [reason, count] : tally.reasons) reasons << ' ' << count << ' ' << reason;
  const int wrong = static_cast<int>(tally.wrong.size()), found = static_cast<int>(tally.errors_px.size());
  std::printf("%-14s %5g | %3d %5d %6d %5d | %7.3f %7.3f |%s\n", name_of(row.given.fault).c_str(),
              row.given.strength, test::trials(row.frames), found - wrong, test::trials(row.frames) - found,
              wrong, tally.error_px(0.5), tally.error_px(1), reasons.str().c_str());
}

TEST(MarksHard, FindsWhatItDidAndNothingWrong) {
  std::printf("fault, strength      |   n found missed wrong | median   worst px | reasons\n");
  for (const HardRow& row : test::hard_rows) {
    const Tally tally = tally_of(row);
    print(row, tally);
    const int right = static_cast<int>(tally.errors_px.size() - tally.wrong.size());
    if (!test::sanitized()) {
      EXPECT_GE(right, row.least_found) << name_of(row.given.fault) << ' ' << row.given.strength;
    }
    EXPECT_EQ(tally.wrong, std::vector<unsigned>{}) << name_of(row.given.fault) << ' ' << row.given.strength;
  }
}

}  // namespace
}  // namespace zeropose
