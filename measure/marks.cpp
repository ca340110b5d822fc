#include "measure/marks.h"

#include <algorithm>
#include <cmath>

#include "measure/disc_search.h"
#include "measure/edge_marks.h"
#include "measure/mark_verdict.h"
#include "measure/pattern_search.h"
#include "measure/ring_search.h"

namespace zeropose {
namespace {

bool shares_descend(const std::vector<double>& shares) {
  double outer = 1;
  for (const double share : shares) {
    if (!(share > 0 && share < outer)) return false;
    outer = share;
  }
  return !shares.empty();
}

bool makes_sense(const MarkSearch& s) {
  return place_makes_sense(s) && sizes_make_sense(s) &&
         (s.kind != MarkKind::ring || shares_descend(s.inner_shares));
}

// Found: there is something to search in.
MarkStatus first_look(const ImageView& image, const MarkSearch& search) {
  if (image.data == nullptr || image.width_px < 2 || image.height_px < 2) return MarkStatus::outside_image;
  if (!makes_sense(search)) return MarkStatus::not_searched;
  return window_of(image, search).empty() ? MarkStatus::outside_image : MarkStatus::found;
}

// -1 for what is no number.
int pixel_of(double place, int size) {
  return std::isnan(place) ? -1 : static_cast<int>(std::clamp(place, -1.0, double(size)));
}

MarkSight sight_of_one(const MarkFinding& finding) {
  if (finding.status == MarkStatus::found) return {{finding}, {}, false};
  return {{}, finding, false};
}

// Its memory is kept from one frame to the next; a fresh one costs as much as a search.
MarkWorkspace& kept_workspace() {
  thread_local MarkWorkspace workspace;
  return workspace;
}

bool is_round(MarkKind kind) {
  return kind == MarkKind::disc || kind == MarkKind::ball || kind == MarkKind::ring;
}

MarkSight look_for(const ImageView& image, const MarkSearch& search, HowMany wanted,
                   MarkWorkspace& workspace) {
  // The others look by themselves whether a search makes sense.
  if (is_round(search.kind))
    if (const MarkStatus status = first_look(image, search); status != MarkStatus::found)
      return sight_without(status);
  const PixelWindow window = is_round(search.kind) ? window_of(image, search) : PixelWindow{};
  switch (search.kind) {
    case MarkKind::disc:
    case MarkKind::ball:
      return look_for_discs(image, window, search, wanted, workspace);
    case MarkKind::ring:
      return look_for_rings(image, window, search, workspace);
    case MarkKind::slot:
      return look_for_slots(image, search, wanted);
    case MarkKind::cross:
      return look_for_crosses(image, search, wanted);
    case MarkKind::corner:
      return look_for_corners(image, search, wanted);
    case MarkKind::edge:
      return look_for_edges(image, search, wanted);
    case MarkKind::pattern:
      return sight_of_one(find_pattern(image, search));
  }
  return {};
}

}  // namespace

PixelWindow window_of(const ImageView& image, const MarkSearch& s) {
  const Eigen::Vector2d low = s.expected_px - s.half_window_px, high = s.expected_px + s.half_window_px;
  return {std::max(0, pixel_of(std::ceil(low.x()), image.width_px)),
          std::max(0, pixel_of(std::ceil(low.y()), image.height_px)),
          std::min(image.width_px - 1, pixel_of(std::floor(high.x()), image.width_px)),
          std::min(image.height_px - 1, pixel_of(std::floor(high.y()), image.height_px))};
}

std::vector<MarkFinding> find_marks(const ImageView& image, std::span<const MarkSearch> searches) {
  std::vector<MarkFinding> findings;
  findings.reserve(searches.size());
  MarkWorkspace& workspace = kept_workspace();
  for (const MarkSearch& search : searches) findings.push_back(look_for(image, search, {}, workspace).only());
  return findings;
}

AllMarks find_all_marks(const ImageView& image, const MarkSearch& search, std::size_t most) {
  MarkSight sight = look_for(image, search, {std::max<std::size_t>(1, most)}, kept_workspace());
  AllMarks all{{}, sight.nearest, sight.crowded};
  for (MarkFinding& mark : sight.standing) {
    if (mark.status == MarkStatus::found) {
      all.found.push_back(std::move(mark));
    } else {
      all.nearest = std::move(mark);
    }
  }
  return all;
}

}  // namespace zeropose
