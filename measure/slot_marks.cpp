// The slot.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "measure/edge_mark_judge.h"
#include "measure/edge_marks.h"
#include "measure/ellipse_band.h"
#include "measure/mark_blobs.h"

namespace zeropose {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int levels = 12;             // that a window's range is looked at
constexpr double size_margin_px = 2;   // the region at one level against the fitted outline
constexpr std::size_t most_slots = 6;  // fits per window where one is wanted
constexpr double most_skew = 0.75;     // cosine of the angle between the slot's axes
constexpr double most_squeeze = 2.2;   // of a cap, seen obliquely; flatter ones belong to a rectangle
constexpr double shortest_px = 1;      // of half the straight edges: less is an ellipse

// A region as an upright long hole with its second moments and area.
struct SlotStart {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // in the window
  double direction_rad = 0, length_px = 0, width_px = 0;
  double contrast = 0;
  double level = 0;
};

struct SlotSearch {
  std::vector<SlotStart> slots;
  MarkStatus reason = MarkStatus::no_candidate;
};

// Grey levels as bytes, whatever the camera's depth: what regions are cut from.
struct ByteWindow {
  std::vector<std::uint8_t> grey;
  ImageView view;
};

ByteWindow bytes_of(const GreyWindow& window) {
  ByteWindow bytes;
  bytes.grey.reserve(window.grey.size());
  for (const float grey : window.grey) {
    bytes.grey.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0F, 255.0F))));
  }
  bytes.view = {bytes.grey.data(), window.width(), window.height(), window.width()};
  return bytes;
}

// Length and width of the stadium with the region's area and the ratio of its second moments.
SlotStart upright_slot(const Blob& blob) {
  const HalfAxes axes = half_axes(blob.shape_px2);
  const double wanted = axes.minor_px / axes.major_px;
  double low = 0, high = 20;  // straight length by width
  for (int k = 0; k < 30; ++k) {
    const double q = 0.5 * (low + high);
    // Rectangle q x 1 and a disc cut in two, moved apart by q.
    const double across = q / 12 + pi / 64;
    const double along = q * q * q / 12 + pi / 64 + pi / 16 * q * q + q / 6;
    (across / along > wanted * wanted ? low : high) = q;
  }
  const double width = std::sqrt(double(blob.area) / (low + pi / 4));
  SlotStart slot;
  slot.centre = blob.centre_px;
  slot.direction_rad = axes.angle_rad;
  slot.width_px = width;
  slot.length_px = width * (1 + low);
  return slot;
}

// Grey levels in the middle and round the outline: median of the contrast all round.
double contrast_of(const GreyWindow& window, const SlotStart& slot, bool bright) {
  const Eigen::Vector2d along(std::cos(slot.direction_rad), std::sin(slot.direction_rad)),
      across(-along.y(), along.x());
  std::vector<double> around;
  for (int k = 0; k < 24; ++k) {
    const double t = 2 * pi * (k + 0.5) / 24;
    const Eigen::Vector2d at = slot.centre + (0.5 * slot.length_px + 3) * std::cos(t) * along +
                               (0.5 * slot.width_px + 3) * std::sin(t) * across;
    if (holds(window, at, 0)) around.push_back(grey_between(window, at));
  }
  if (around.size() < 12) return 0;
  const auto middle = around.begin() + std::ptrdiff_t(around.size() / 2);
  std::nth_element(around.begin(), middle, around.end());
  return (bright ? -1 : 1) * (*middle - grey_between(window, slot.centre));
}

bool right_direction(double direction_rad, const MarkSearch& search, double room_rad) {
  return std::abs(wrapped_line_rad(direction_rad - search.direction_rad)) <=
         search.direction_tolerance_rad + room_rad;
}

class SlotFinder {
 public:
  SlotFinder(const GreyWindow& window, const MarkSearch& search) : window_(window), search_(search) {}

  // The regions at several grey levels, each thing once: at the level nearest to its middle grey.
  SlotSearch find(HowMany wanted);

 private:
  void look_at_blob(const Blob& blob, double level);
  void add(const SlotStart& slot);
  void suggest(MarkStatus status) {
    if (status == MarkStatus::cut_off || found_.reason == MarkStatus::no_candidate) found_.reason = status;
  }

  const GreyWindow& window_;
  const MarkSearch& search_;
  SlotSearch found_;
};

void SlotFinder::look_at_blob(const Blob& blob, double level) {
  const double longest = std::max(blob.box.width(), blob.box.height());
  if (blob.touches_window) {
    const double box = double(blob.box.width()) * blob.box.height();
    if (longest > 0.6 * search_.min_diameter_px && double(blob.area) > 0.65 * box &&
        double(blob.area) < 0.5 * window_.width() * window_.height()) {
      suggest(MarkStatus::cut_off);
    }
    return;
  }
  SlotStart slot = upright_slot(blob);
  slot.level = level;
  const double ratio = slot.width_px / slot.length_px;
  if (ratio > 1 / (slot_least_ratio - 0.1) || ratio < search_.min_axis_ratio - 0.1 || slot.width_px < 2.5 ||
      slot.length_px > search_.max_diameter_px + size_margin_px ||
      !right_direction(slot.direction_rad, search_, 0.3)) {
    return;
  }
  if (slot.length_px < search_.min_diameter_px - size_margin_px) {
    if (slot.length_px > 0.6 * search_.min_diameter_px) suggest(MarkStatus::too_small);
    return;
  }
  slot.contrast = contrast_of(window_, slot, search_.bright);
  if (slot.contrast > 0.5 * search_.min_contrast) add(slot);
}

// The same thing at another level has nearly the same centre and length.
void SlotFinder::add(const SlotStart& slot) {
  const double sign = search_.bright ? -1 : 1;
  const auto off_middle = [&](const SlotStart& s) {
    const double inside = grey_between(window_, s.centre);
    return std::abs(s.level - (inside + sign * 0.5 * s.contrast));
  };
  for (SlotStart& known : found_.slots) {
    if ((known.centre - slot.centre).norm() < 0.3 * known.width_px &&
        std::abs(known.length_px - slot.length_px) < 0.25 * known.length_px) {
      if (off_middle(slot) < off_middle(known)) known = slot;
      return;
    }
  }
  found_.slots.push_back(slot);
}

SlotSearch SlotFinder::find(HowMany wanted) {
  const ByteWindow bytes = bytes_of(window_);
  const auto [low, high] = std::minmax_element(bytes.grey.begin(), bytes.grey.end());
  const BlobLimits limits{std::max(4.0, 0.3 * search_.min_diameter_px),
                          search_.max_diameter_px + 2 * size_margin_px};
  SearchImage reduced;
  reduced.prepare(bytes.view, {0, 0, window_.width() - 1, window_.height() - 1}, 1);
  BlobFinder blobs;
  const double step = std::max(3.0, double(*high - *low) / levels);
  for (double level = *low + 0.5 * step; level < *high; level += step) {
    const int whole = static_cast<int>(std::lround(level));
    for (const Blob& blob : blobs.find(reduced, whole, search_.bright, limits)) {
      look_at_blob(blob, whole);
    }
  }
  std::stable_sort(found_.slots.begin(), found_.slots.end(),
                   [](const SlotStart& a, const SlotStart& b) { return a.contrast > b.contrast; });
  found_.slots.resize(std::min(wanted.one() ? most_slots : wanted.most, found_.slots.size()));
  return found_;
}

ContourStart start_of(const SlotStart& slot) {
  ContourStart start;
  start.origin_i = static_cast<int>(std::lround(slot.centre.x()));
  start.origin_j = static_cast<int>(std::lround(slot.centre.y()));
  start.shape.head<2>() = slot.centre - Eigen::Vector2d(start.origin_i, start.origin_j);
  const double r = 2 / slot.width_px, c = std::cos(slot.direction_rad), s = std::sin(slot.direction_rad);
  start.shape.segment<4>(2) << r * c, r * s, -r * s, r * c;
  start.shape(6) = std::max(0.05, slot.length_px / slot.width_px - 1);
  return start;
}

// What the fitted outline measures: its axes, and whether it is a slot at all.
struct SlotSize {
  Eigen::Vector2d along = Eigen::Vector2d::Zero();  // half of the straight edges and a cap
  double length_px = 0, width_px = 0, straight_px = 0;
  double skew = 0, cap_ratio = 1;  // of the caps' half axes, along by across
};

SlotSize size_of(const ShapeParameters& at) {
  const double determinant = at(2) * at(5) - at(3) * at(4);
  const Eigen::Vector2d along = Eigen::Vector2d(at(5), -at(4)) / determinant,
                        across = Eigen::Vector2d(-at(3), at(2)) / determinant;
  SlotSize size;
  size.along = (1 + at(6)) * along;
  size.length_px = 2 * size.along.norm();
  size.width_px = 2 / std::hypot(at(4), at(5));  // between the straight edges
  size.straight_px = at(6) * along.norm();
  size.cap_ratio = along.norm() / across.norm();
  size.skew = std::abs(along.normalized().dot(across.normalized()));
  return size;
}

MarkStatus status_of_size(const SlotSize& size, const MarkSearch& search) {
  if (size.straight_px < shortest_px || size.length_px < slot_least_ratio * size.width_px ||
      size.skew > most_skew || size.cap_ratio < 1 / most_squeeze || size.cap_ratio > most_squeeze ||
      size.length_px > search.max_diameter_px || size.width_px < search.min_axis_ratio * size.length_px) {
    return MarkStatus::no_candidate;
  }
  return size.length_px < search.min_diameter_px ? MarkStatus::too_small : MarkStatus::found;
}

// The core of the band within the window, all round.
bool band_in_window(const GreyWindow& window, const ContourFit& fit, const Eigen::Vector2d& centre) {
  const SlotSize size = size_of(fit.shape);
  const Eigen::Vector2d cap = fit.shape(6) / (1 + fit.shape(6)) * size.along;
  const Eigen::Matrix2d M{{fit.shape(2), fit.shape(3)}, {fit.shape(4), fit.shape(5)}};
  const double determinant = M(0, 0) * M(1, 1) - M(0, 1) * M(1, 0), core = contour_core_px(fit.blur_px);
  const Eigen::Vector2d reach(std::hypot(M(1, 1), M(0, 1)) / determinant + std::abs(cap.x()) + core,
                              std::hypot(M(1, 0), M(0, 0)) / determinant + std::abs(cap.y()) + core);
  return holds(window, centre + reach, 0) && holds(window, centre - reach, 0);
}

JudgedMark judged_slot(const GreyWindow& window, const MarkSearch& search, const SlotStart& slot,
                       ContourWorkspace& workspace) {
  const ContourStart start = start_of(slot);
  const ContourFit fit = fit_contour(window, SlotShape(start.shape), start, workspace);
  JudgedMark mark{judged_fit(fit, search), slot.contrast * slot.length_px};
  MarkFinding& finding = mark.finding;
  if (!fit.converged) {
    finding.u_px = to_image(window, slot.centre);
    finding.contrast = slot.contrast;
    finding.diameter_px = slot.length_px;
    return mark;
  }
  const SlotSize size = size_of(fit.shape);
  const Eigen::Vector2d centre = fit.shape.head<2>() + Eigen::Vector2d(start.origin_i, start.origin_j);
  finding.u_px = to_image(window, centre);
  finding.covariance_px2 = fit.covariance.topLeftCorner<2, 2>();
  finding.diameter_px = size.length_px;
  finding.axis_ratio = size.width_px / size.length_px;
  const double turn = wrapped_line_rad(std::atan2(size.along.y(), size.along.x()) - search.direction_rad);
  finding.direction_rad = wrapped_rad(search.direction_rad + turn);
  if (finding.status != MarkStatus::found) return mark;
  if ((fit.mark_grey > fit.background_grey) != search.bright) {
    finding.status = MarkStatus::not_converged;
  } else if (!band_in_window(window, fit, centre)) {
    finding.status = MarkStatus::cut_off;
  } else if (!right_direction(finding.direction_rad, search, 0)) {
    finding.status = MarkStatus::no_candidate;
  } else {
    finding.status = status_of_size(size, search);
  }
  return mark;
}

}  // namespace

MarkSight look_for_slots(const ImageView& image, const MarkSearch& search, HowMany wanted) {
  const OpenedWindow opened = open_window(image, search, true);
  if (opened.status != MarkStatus::found) return sight_without(opened.status);
  const SlotSearch seen = SlotFinder(opened.greys, search).find(wanted);
  std::vector<JudgedMark> marks;
  ContourWorkspace workspace;
  for (const SlotStart& slot : seen.slots) {
    marks.push_back(judged_slot(opened.greys, search, slot, workspace));
  }
  MarkSight sight = sight_of(marks, opened.greys, search, wanted);
  if (marks.empty() && sight.nearest.status == MarkStatus::no_candidate) sight.nearest.status = seen.reason;
  return sight;
}

}  // namespace zeropose
