#include "protocol/convention_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <sstream>
#include <stdexcept>

namespace zeropose {
namespace {

using Values = std::vector<double>;
using Change = std::function<Values(Values)>;
// What the robot saw of a shift, from where it was at zero and where it went (both X_R.).
using Motion = std::function<Pose(const Pose& X_RZ, const Pose& X_RP)>;

struct Cause {
  std::string text;
  Convention convention;
  Motion motion;
  Change change;
};

constexpr double small_turn_deg = 10;

Pose in_object_axes(const Pose& X_RZ, const Pose& X_RP) { return X_RZ.inverse() * X_RP; }
Pose in_base_axes(const Pose& X_RZ, const Pose& X_RP) { return X_RP * X_RZ.inverse(); }
Pose inverse_in_object_axes(const Pose& X_RZ, const Pose& X_RP) { return X_RP.inverse() * X_RZ; }
Pose inverse_in_base_axes(const Pose& X_RZ, const Pose& X_RP) { return X_RZ * X_RP.inverse(); }
Values unchanged(Values values) { return values; }

double turn_deg(const Pose& X) { return log_so3(X.linear()).norm() * degrees_per_radian; }

std::string fixed(double number, int digits) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << number;
  return text.str();
}

// Nothing where the numbers are no pose in this convention.
std::optional<Pose> seen(const Cause& cause, const Values& zero, const Values& went) {
  const auto X_RZ = from_maker(cause.convention, cause.change(zero));
  const auto X_RP = from_maker(cause.convention, cause.change(went));
  if (!X_RZ || !X_RP) return std::nullopt;
  return cause.motion(*X_RZ, *X_RP);
}

ShiftVerdict compare(const ConventionCheck& check, const KnownShift& shift, const std::optional<Pose>& X) {
  ShiftVerdict verdict;
  if (!X) {
    verdict.text =
        shift.name + ": the numbers are no pose in the convention " + std::string(name_of(check.convention));
    return verdict;
  }
  verdict.off_mm = (X->translation() - shift.X_O0O.translation()).norm();
  verdict.off_deg = turn_deg(shift.X_O0O.inverse() * *X);
  verdict.agrees = verdict.off_mm <= check.tolerance_mm && verdict.off_deg <= check.tolerance_deg;
  verdict.text = shift.name + (verdict.agrees ? ": agrees (" : ": DOES NOT AGREE (") +
                 fixed(verdict.off_mm, 2) + " mm, " + fixed(verdict.off_deg, 2) + " deg off)";
  return verdict;
}

bool explains(const Cause& cause, const ConventionCheck& check) {
  for (std::size_t i = 0; i < check.shifts.size(); ++i)
    if (!compare(check, check.shifts[i], seen(cause, check.at_zero, check.went[i])).agrees) return false;
  return true;
}

// All conventions on the wire that the numbers could be in, each class of equal ones once.
std::vector<Convention> classes(std::size_t count) {
  std::vector<Convention> list;
  for (const Convention convention : all_conventions()) {
    const bool known =
        std::ranges::any_of(list, [&](Convention other) { return writes_the_same(convention, other); });
    if (convention != Convention::matrix && field_names(convention).size() == count && !known)
      list.push_back(convention);
  }
  return list;
}

std::string names_of(const std::vector<Convention>& conventions) {
  std::string text;
  for (const Convention convention : conventions) {
    if (!text.empty()) text += ", ";
    text += name_of(convention);
  }
  return text;
}

std::vector<Convention> same_as(Convention convention) {
  std::vector<Convention> list;
  for (const Convention other : all_conventions())
    if (writes_the_same(convention, other)) list.push_back(other);
  return list;
}

Change scaled(std::size_t first, std::size_t last, double factor) {
  return [=](Values values) {
    for (std::size_t i = first; i < std::min(last, values.size()); ++i) values[i] *= factor;
    return values;
  };
}

std::vector<Cause> other_conventions(const ConventionCheck& check, const Motion& motion,
                                     const std::string& and_what) {
  std::vector<Cause> causes;
  for (const Convention other : classes(check.at_zero.size()))
    if (!writes_the_same(other, check.convention))
      causes.push_back({"the robot writes angles as " + names_of(same_as(other)) + and_what +
                            ", the cell file says " + std::string(name_of(check.convention)),
                        other, motion, unchanged});
  return causes;
}

std::vector<Cause> other_motions(const ConventionCheck& check) {
  const Convention c = check.convention;
  return {{"inverse: the robot goes the opposite way (the transform is inverted)", c, inverse_in_object_axes,
           unchanged},
          {"wrong frame: the shift is applied along the axes of the robot's base instead of the object's", c,
           in_base_axes, unchanged},
          {"inverse, and along the axes of the robot's base instead of the object's", c, inverse_in_base_axes,
           unchanged}};
}

std::vector<Cause> other_units(const ConventionCheck& check) {
  const Convention c = check.convention;
  return {{"lengths are given in mm where the convention has m", c, in_object_axes, scaled(0, 3, 0.001)},
          {"lengths are given in m where the convention has mm", c, in_object_axes, scaled(0, 3, 1000)},
          {"angles are given in degrees where the convention has rad", c, in_object_axes,
           scaled(3, 6, 1 / degrees_per_radian)},
          {"angles are given in rad where the convention has degrees", c, in_object_axes,
           scaled(3, 6, degrees_per_radian)}};
}

// Signs of one, two or three numbers of the same kind.
std::vector<Cause> other_signs(const ConventionCheck& check) {
  const auto names = field_names(check.convention);
  std::vector<Cause> causes;
  for (const std::size_t first : {std::size_t{0}, std::size_t{3}}) {
    for (unsigned flips = 1; flips < 8; ++flips) {
      std::string text;
      for (std::size_t i = 0; i < 3; ++i)
        if (flips >> i & 1) text.append(" ").append(names[first + i]);
      const auto flip = [=](Values values) {
        for (std::size_t i = 0; i < 3; ++i)
          if (flips >> i & 1) values[first + i] *= -1;
        return values;
      };
      causes.push_back({"inverted sign of" + text, check.convention, in_object_axes, flip});
    }
  }
  return causes;
}

// From the simplest cause to two at once; only the simplest that explain everything are told.
std::vector<std::string> explanations(const ConventionCheck& check) {
  const std::vector<std::vector<Cause>> stages = {
      other_conventions(check, in_object_axes, ""),
      other_motions(check),
      other_units(check),
      other_signs(check),
      other_conventions(check, inverse_in_object_axes, " and goes the opposite way"),
      other_conventions(check, in_base_axes, " and shifts along its base's axes")};
  for (const auto& stage : stages) {
    std::vector<std::string> found;
    for (const Cause& cause : stage)
      if (explains(cause, check)) found.push_back(cause.text);
    if (!found.empty()) return found;
  }
  return {};
}

void refuse_nonsense(const ConventionCheck& check) {
  if (check.shifts.empty() || check.shifts.size() != check.went.size())
    throw std::invalid_argument("convention check: " + std::to_string(check.shifts.size()) +
                                " shifts need as many poses of the robot, there are " +
                                std::to_string(check.went.size()));
  const std::size_t count = field_names(check.convention).size();
  const auto wrong = [&](const Values& values) { return values.size() != count; };
  if (wrong(check.at_zero) || std::ranges::any_of(check.went, wrong))
    throw std::invalid_argument("convention check: a pose in the convention " +
                                std::string(name_of(check.convention)) + " has " + std::to_string(count) +
                                " numbers");
}

std::string text_of_failure(const ConventionVerdict& verdict) {
  if (verdict.explanations.empty())
    return "NOT PROVEN, and nothing known explains it: was the object moved as said, and the robot brought "
           "to "
           "the same place on it each time? Is its tool measured in?";
  std::string text = "NOT PROVEN. What would explain all that was seen:";
  for (const std::string& one : verdict.explanations) text.append("\n  ").append(one);
  return text;
}

// Where the taught place is hardly turned, an error of the frame looks right.
std::string text_of_success(const ConventionCheck& check, const ConventionVerdict& verdict) {
  std::string text = "proven: " + std::string(name_of(check.convention));
  if (verdict.same.size() > 1)
    text += " (the same numbers as " + names_of(verdict.same) + ": these cannot and need not be told apart)";
  const auto X_RZ = from_maker(check.convention, check.at_zero);
  if (X_RZ && turn_deg(*X_RZ) < small_turn_deg)
    text +=
        ". The taught place is turned by less than 10 deg from the robot's base, so object's and base's "
        "axes were not told apart";
  return text;
}

// The shifts may be too few or too small: then a wrong convention would agree as well.
std::vector<std::string> rivals(const ConventionCheck& check) {
  std::vector<std::string> found;
  for (const Cause& cause : other_conventions(check, in_object_axes, ""))
    if (explains(cause, check)) found.push_back(cause.text);
  for (const Cause& cause : other_conventions(check, inverse_in_object_axes, " and goes the opposite way"))
    if (explains(cause, check)) found.push_back(cause.text);
  return found;
}

}  // namespace

std::vector<KnownShift> known_shifts() {
  return {
      {"shifted 30 mm along x", from_six_numbers({30, 0, 0, 0, 0, 0})},
      {"shifted 40 mm along y", from_six_numbers({0, 40, 0, 0, 0, 0})},
      {"shifted 50 mm along z", from_six_numbers({0, 0, 50, 0, 0, 0})},
      {"turned 15 deg about x", from_six_numbers({0, 0, 0, 15, 0, 0})},
      {"turned 20 deg about y", from_six_numbers({0, 0, 0, 0, 20, 0})},
      {"turned 25 deg about z", from_six_numbers({0, 0, 0, 0, 0, 25})},
      {"shifted 20, -30, 40 mm and turned 20, -25, 30 deg", from_six_numbers({20, -30, 40, 20, -25, 30})}};
}

bool writes_the_same(Convention a, Convention b) {
  if (a == b) return true;
  const Pose probe = from_six_numbers({1, -2, 3, 20, -35, 50});
  const Values of_a = to_maker(a, probe), of_b = to_maker(b, probe);
  return of_a.size() == of_b.size() &&
         std::ranges::equal(of_a, of_b, [](double x, double y) { return std::abs(x - y) < 1e-9; });
}

ConventionVerdict check_convention(const ConventionCheck& check) {
  refuse_nonsense(check);
  const Cause as_configured{"", check.convention, in_object_axes, unchanged};
  ConventionVerdict verdict;
  for (std::size_t i = 0; i < check.shifts.size(); ++i)
    verdict.shifts.push_back(
        compare(check, check.shifts[i], seen(as_configured, check.at_zero, check.went[i])));
  verdict.same = same_as(check.convention);
  if (!std::ranges::all_of(verdict.shifts, &ShiftVerdict::agrees)) {
    verdict.explanations = explanations(check);
    verdict.text = text_of_failure(verdict);
    return verdict;
  }
  verdict.explanations = rivals(check);
  verdict.proven = verdict.explanations.empty();
  verdict.text =
      verdict.proven
          ? text_of_success(check, verdict)
          : "NOT PROVEN: all shifts agree, but they do not tell apart: " + verdict.explanations.front() +
                ". Take all shifts, each turn at least 10 deg";
  return verdict;
}

}  // namespace zeropose
