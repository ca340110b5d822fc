#include "sim/part_log.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace zeropose {
namespace {

Vector6 numbers_of(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  return {s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg};
}

// The codes that a part may get by its true place. Where the errors that are allowed do not tell, several.
std::vector<Code> expected_codes(const Vector6& truth, const std::array<Range, 6>& limits,
                                 const Vector6& max_error) {
  constexpr std::array codes{Code::limit_x,  Code::limit_y,  Code::limit_z,
                             Code::limit_rx, Code::limit_ry, Code::limit_rz};
  std::vector<Code> expected;
  for (std::size_t axis = 0; axis < codes.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double beyond = std::max(truth(i) - limits[axis].max, limits[axis].min - truth(i));
    if (beyond > -max_error(i)) expected.push_back(codes[axis]);
    if (beyond > max_error(i)) return expected;
  }
  expected.push_back(Code::ok);
  return expected;
}

void print(const Pose& X_AB) {
  const SixNumbers s = to_six_numbers(X_AB);
  std::printf(" %7.3f %7.3f %7.3f %7.4f %7.4f %7.4f |", s.x_mm, s.y_mm, s.z_mm, s.rx_deg, s.ry_deg, s.rz_deg);
}

}  // namespace

Parts::Parts(const DriveOptions& options, const Job& job, std::uint64_t seed)
    : options_(options), job_(job), generator_(seed) {}

Pose Parts::next() {
  const Pose X_O0O = options_.poses.empty() ? drawn() : options_.poses[count_ % options_.poses.size()];
  ++count_;
  const auto every = static_cast<std::size_t>(std::max(options_.beyond_every, 0));
  return every > 0 && count_ % every == 0 ? beyond_a_limit(X_O0O, count_ / every - 1) : X_O0O;
}

Pose Parts::drawn() {
  std::array<double, 6> six{};
  for (std::size_t axis = 0; axis < six.size(); ++axis) {
    const double most = options_.shift(static_cast<Eigen::Index>(axis));
    six[axis] = std::uniform_real_distribution<double>(-most, most)(generator_);
  }
  return from_six_numbers({six[0], six[1], six[2], six[3], six[4], six[5]});
}

Pose Parts::beyond_a_limit(const Pose& X_O0O, std::size_t turn) const {
  constexpr double by = 0.1;  // of the range
  std::vector<std::size_t> axes{0, 1, 2, 3, 4, 5};
  if (job_.X_WP_planar) axes = {0, 1, 5};
  if (job_.wheel) axes = {0, 1, 2, 3, 4};
  const std::size_t axis = axes[turn % axes.size()];
  const Range& range = job_.requirements.limits[axis];
  const double room = by * (range.max - range.min);
  Vector6 six = numbers_of(X_O0O);
  six(static_cast<Eigen::Index>(axis)) = turn / axes.size() % 2 == 0 ? range.max + room : range.min - room;
  return from_six_numbers({six(0), six(1), six(2), six(3), six(4), six(5)});
}

void PartLog::print_head() {
  std::printf("\n%5s | %-47s | %-47s | %-21s | %6s\n", "part", "correction received (X_O0O: mm, deg)",
              "truth", "worst error mm, deg", "ms");
}

void PartLog::refused(const Pose& truth, const RobotAnswer& answer) {
  const bool good = answer.code != 0 && may_be(truth, static_cast<Code>(answer.code));
  bad_ += good ? 0 : 1;
  if (good)
    std::printf("%5d | beyond its limit and refused: code %u\n", parts_, answer.code);
  else
    std::printf("%5d | no correction: %s (code %u)\n", parts_, answer.refusal.c_str(), answer.code);
  std::fflush(stdout);
}

void PartLog::corrected(const Pose& truth, const Pose& received, std::chrono::microseconds time) {
  const Corrected part = compared(truth, received, time);
  done_.push_back(part);
  const bool good = within_figures(part) && may_be(truth, Code::ok);
  bad_ += good ? 0 : 1;
  std::printf("%5d |", parts_);
  print(received);
  print(truth);
  std::printf(" %8.4f %9.5f %s | %6.1f\n", part.error.head<3>().cwiseAbs().maxCoeff(),
              part.error.tail<3>().cwiseAbs().maxCoeff(), good ? "ok" : "!!", 1000 * part.seconds);
  std::fflush(stdout);
}

int PartLog::summary() const {
  std::printf("\njob %s\n", job_.name.c_str());
  if (!done_.empty()) print_figures();
  const Vector6& most = options_.max_error;
  std::printf("%d parts, %d answers not within %g %g %g mm and %g %g %g deg", parts_, bad_, most(0), most(1),
              most(2), most(3), most(4), most(5));
  if (options_.max_error_at_points_mm > 0)
    std::printf(", %g mm at the application points", options_.max_error_at_points_mm);
  std::printf("%s\n", options_.beyond_every > 0 ? ", or with a wrong verdict" : "");
  return parts_ > 0 && bad_ == 0 ? 0 : 1;
}

bool PartLog::may_be(const Pose& truth, Code code) const {
  const auto expected = expected_codes(numbers_of(truth), job_.requirements.limits, options_.max_error);
  return std::ranges::find(expected, code) != expected.end();
}

PartLog::Corrected PartLog::compared(const Pose& truth, const Pose& received,
                                     std::chrono::microseconds time) const {
  Corrected part;
  part.error = difference(truth, received);
  part.error.tail<3>() *= degrees_per_radian;
  for (const ApplicationPoint& point : job_.application_points)
    part.at_points_mm = std::max(part.at_points_mm, (received * point.p_O_mm - truth * point.p_O_mm).norm());
  part.seconds = std::chrono::duration<double>(time).count();
  return part;
}

bool PartLog::within_figures(const Corrected& part) const {
  const double most_mm = options_.max_error_at_points_mm;
  return (part.error.cwiseAbs().array() <= options_.max_error.array()).all() &&
         (most_mm <= 0 || part.at_points_mm <= most_mm);
}

void PartLog::print_figures() const {
  Vector6 squares = Vector6::Zero();
  std::vector<double> ms;
  double at_points_mm = 0;
  for (const Corrected& part : done_) {
    squares += part.error.cwiseAbs2();
    ms.push_back(1000 * part.seconds);
    at_points_mm = std::max(at_points_mm, part.at_points_mm);
  }
  const Vector6 rms = (squares / static_cast<double>(done_.size())).cwiseSqrt();
  std::sort(ms.begin(), ms.end());
  std::printf("RMS error  x %.4f  y %.4f  z %.4f mm   rx %.5f  ry %.5f  rz %.5f deg\n", rms(0), rms(1),
              rms(2), rms(3), rms(4), rms(5));
  std::printf("largest error at the application points %.4f mm\n", at_points_mm);
  std::printf("command to answer: median %.1f ms, p99 %.1f ms, worst %.1f ms\n", ms[ms.size() / 2],
              ms[(ms.size() * 99) / 100], ms.back());
}

Mounting::Mounting(const DriveOptions& options, const Job& into)
    : most_mm_(options.max_mounted_mm),
      points_(into.application_points),
      hand_({options.robot.repeatability_mm, options.robot.repeatability_deg, 0, 0}, 2, options.seed + 2000) {
}

void Mounting::mount(const Got& opening, const Got& pane) {
  if (!opening.received || !pane.received) return;
  const Pose at_opening = hand_.true_hand(0, *opening.received);
  const Pose at_pane = hand_.true_hand(1, *pane.received);
  const Pose X_OpeningPane = opening.X_O0O.inverse() * at_opening * at_pane.inverse() * pane.X_O0O;
  double worst_mm = 0;
  for (const ApplicationPoint& point : points_)
    worst_mm = std::max(worst_mm, (X_OpeningPane * point.p_O_mm - point.p_O_mm).norm());
  worst_mm_.push_back(worst_mm);
  std::printf("      | mounted and touched: %.3f mm off at the worst verification point\n", worst_mm);
  std::fflush(stdout);
}

int Mounting::summary() const {
  if (worst_mm_.empty()) return 1;
  const double worst_mm = *std::ranges::max_element(worst_mm_);
  std::printf("\n%zu mounted, at most %.3f mm off at a verification point (%g mm are allowed)\n",
              worst_mm_.size(), worst_mm, most_mm_);
  return most_mm_ <= 0 || worst_mm <= most_mm_ ? 0 : 1;
}

}  // namespace zeropose
