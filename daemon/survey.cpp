#include "daemon/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace zeropose {
namespace {

constexpr int most_positions = 1000;
// Of the target between the two pictures: what a standing robot and the noise leave at most.
constexpr double still_px = 0.15, still_sigmas = 4;

struct Seen {
  std::vector<SurveyPoint> points;
  std::string reason;  // why there are none
};

Seen seen(const RoundTarget& target, const ImageView& image) {
  MarkSearch search = target.search;
  search.expected_px = {(image.width_px - 1) / 2.0, (image.height_px - 1) / 2.0};
  search.half_window_px = {image.width_px / 2.0, image.height_px / 2.0};
  const AllMarks all = find_all_marks(image, search);
  const std::string_view what = search.kind == MarkKind::ball ? "ball" : "disc";
  if (all.found.empty())
    return {{}, fmt::format("no {} is in sight: {}", what, reason_text(all.nearest, search))};
  if (all.found.size() > 1)
    return {{},
            fmt::format(
                "{} things in the picture pass for the {}, at {:.0f} {:.0f} and {:.0f} {:.0f} px: cover the "
                "others, or narrow the limits of its diameter",
                all.found.size(), what, all.found[0].u_px.x(), all.found[0].u_px.y(), all.found[1].u_px.x(),
                all.found[1].u_px.y())};
  return {{{"", Eigen::Vector3d::Zero(), all.found[0].u_px, all.found[0].covariance_px2}}, {}};
}

Seen seen(const BoardTarget& target, const ImageView& image) {
  const BoardResult board = find_board(image, target.problem);
  if (board.status != BoardStatus::found) return {{}, "the board is not found: " + board.reason};
  if (board.equivalent_readings > 1)
    return {
        {},
        fmt::format(
            "the board looks the same from {} sides, so that its frame turns from picture to picture: take "
            "an asymmetric one with an odd number of rows",
            board.equivalent_readings)};
  Seen seen;
  for (const BoardPoint& point : board.points)
    seen.points.push_back({"", point.p_B_mm, point.u_px, point.covariance_px2, target.radius_mm});
  return seen;
}

Seen seen(const BodyTarget& target, const ImageView& image) {
  BodyProblem problem = target.problem;
  problem.marks = target.marks;
  const BodyResult body = find_body(image, problem);
  if (body.status != BodyStatus::found) return {{}, "the body is not found: " + body.reason};
  Seen seen;
  for (const BodyPoint& point : body.points) {
    const BodyMark& mark = target.marks[point.mark];
    seen.points.push_back(
        {"", mark.p_B_mm, point.u_px, point.covariance_px2, mark.radius_mm, point.normal_B});
  }
  return seen;
}

Seen seen(const TouchTarget&, const ImageView&) { return {}; }  // it has no cameras

// How far the target wandered, by the points that both pictures show.
std::string movement(const Seen& first, const Seen& second) {
  double squares = 0, variance = 0;
  int count = 0;
  for (const SurveyPoint& a : first.points)
    for (const SurveyPoint& b : second.points) {
      if (a.p_B_mm != b.p_B_mm) continue;
      squares += (b.u_px - a.u_px).squaredNorm();
      variance += a.covariance_px2.trace() + b.covariance_px2.trace();
      ++count;
    }
  if (count == 0) return "the two pictures show nothing in common";
  // Of every point, since a board that turns about its middle has none on average.
  const double moved_px = std::sqrt(squares / count), sigma_px = std::sqrt(variance / count);
  if (moved_px <= still_px + (1 + still_sigmas / std::sqrt(count)) * sigma_px) return {};
  return fmt::format("the target moved by {:.2f} px between two pictures: the robot did not stand still",
                     moved_px);
}

}  // namespace

Survey::Survey(const SurveyOptions& options) : options_(options) {
  const bool touches = std::holds_alternative<TouchTarget>(options.target);
  if (options.cameras.empty() && !touches)
    throw std::invalid_argument("cameras: found none, expected one or more");
  if (!options.cameras.empty() && touches)
    throw std::invalid_argument("cameras: found " + options.cameras.front().name +
                                ", expected none: nothing looks at touches");
  for (std::size_t i = 1; i < options.cameras.size(); ++i)
    if (std::ranges::find(options.cameras.begin(), options.cameras.begin() + std::ptrdiff_t(i),
                          options.cameras[i].index,
                          &SurveyCamera::index) != options.cameras.begin() + std::ptrdiff_t(i))
      throw std::invalid_argument("cameras: found " + options.cameras[i].name + " twice");
  if (options.cameras.size() > 1 && std::holds_alternative<BodyTarget>(options.target))
    throw std::invalid_argument("cameras: found more than one, expected the one that looks at the body");
  if (options.positions < 1 || options.positions > most_positions)
    throw std::invalid_argument(
        fmt::format("positions: found {}, expected 1 to {}", options.positions, most_positions));
  if (!options.targets.empty() && std::ssize(options.targets) != options.positions)
    throw std::invalid_argument(fmt::format("targets: found {}, expected one for each of {} positions",
                                            options.targets.size(), options.positions));
}

SurveyVerdict Survey::look(int position, const Pose& X_RH, std::span<const ImageView> first,
                           std::span<const ImageView> second) {
  if (position < 1 || position > options_.positions)
    return {Code::argument_out_of_range,
            fmt::format("position {} is told, the survey has 1 to {}", position, options_.positions)};
  SurveyView view{X_RH, {}};
  for (std::size_t i = 0; i < options_.cameras.size(); ++i) {
    const auto& camera = options_.cameras[i];
    const auto refused = [&](Code code, const std::string& reason) {
      return SurveyVerdict{code, options_.cameras.size() > 1 ? camera.name + ": " + reason : reason};
    };
    const auto look_at = [&](const ImageView& image) {
      return std::visit([&](const auto& target) { return seen(target, image); }, options_.target);
    };
    const Seen before = look_at(first[i]), after = look_at(second[i]);
    for (const Seen* one : {&before, &after})
      if (one->points.empty()) return refused(Code::too_few_marks, one->reason);
    if (const std::string moved = movement(before, after); !moved.empty())
      return refused(Code::not_standing_still, moved);
    for (SurveyPoint point : after.points) {
      point.camera = camera.name;
      view.points.push_back(std::move(point));
    }
  }
  views_[position] = std::move(view);
  return {Code::ok, {}};
}

std::vector<int> Survey::missing() const {
  std::vector<int> missing;
  for (int position = 1; position <= options_.positions; ++position)
    if (!views_.contains(position)) missing.push_back(position);
  return missing;
}

int Survey::next_after(int position) const {
  const std::vector<int> open = missing();
  if (open.empty()) return 0;
  const auto next = std::ranges::upper_bound(open, position);
  return next != open.end() ? *next : open.front();
}

}  // namespace zeropose
