// Marks in words for people.
#include "calib/words.h"
#include "measure/marks.h"

namespace zeropose {
namespace {

std::string place(const Eigen::Vector2d& u_px) {
  return std::string("(") + number(u_px.x(), 1) + ", " + number(u_px.y(), 1) + ")";
}

std::string wanted(const MarkSearch& search) {
  const std::string colour = search.kind == MarkKind::edge || search.kind == MarkKind::pattern ? ""
                             : search.bright                                                   ? "bright "
                                                                                               : "dark ";
  return colour + std::string(name_of(search.kind)) + " of " + number(search.min_diameter_px, 1) + " to " +
         number(search.max_diameter_px, 1) + " px";
}

std::string nothing(const MarkFinding& finding, const MarkSearch& search) {
  std::string text = std::string("nothing within ") + number(search.half_window_px.x(), 0) + " x " +
                     number(search.half_window_px.y(), 0) + " px of " + place(search.expected_px) +
                     " looks like a " + wanted(search);
  if (finding.diameter_px > 0)
    text += "; the nearest to it, at " + place(finding.u_px) + ", is " + number(finding.diameter_px, 1) +
            " px long and " + number(finding.axis_ratio, 2) + " times as wide (at least " +
            number(search.min_axis_ratio, 2) + ")";
  return text;
}

}  // namespace

std::string reason_text(const MarkFinding& finding, const MarkSearch& search) {
  switch (finding.status) {
    case MarkStatus::found:
      return {};
    case MarkStatus::not_searched:
      return "the search makes no sense: window, sizes, axis ratio and contrast must be positive numbers, "
             "the limits in order, the radii of a ring's inner circles descending within 0 to 1";
    case MarkStatus::outside_image:
      return std::string("the window about ") + place(search.expected_px) + " lies outside the image";
    case MarkStatus::no_candidate:
      return nothing(finding, search);
    case MarkStatus::too_small:
      return (finding.diameter_px > 0 ? std::string("what is at ") + place(finding.u_px) + " has " +
                                            number(finding.diameter_px, 1) + " px"
                                      : "only smaller things were seen") +
             ", at least " + number(search.min_diameter_px, 1) + " px are expected";
    case MarkStatus::low_contrast:
      return (finding.contrast > 0 ? std::string("what is at ") + place(finding.u_px) + " differs by " +
                                         number(finding.contrast, 1) + " grey levels from what is round it"
                                   : std::string("hardly anything in the window differs in grey level")) +
             ", at least " + number(search.min_contrast, 1) + " are needed";
    case MarkStatus::blurred:
      return std::string("the edges at ") + place(finding.u_px) + " are blurred by " +
             number(finding.blur_px, 2) + " px (sigma), at most " + number(search.max_blur_px, 2) +
             " px: out of focus or moving";
    case MarkStatus::saturated:
      return std::string("white is reached at the edge of what is at ") + place(finding.u_px) +
             ": its place would be wrong; expose less";
    case MarkStatus::cut_off:
      return "what looks like it reaches beyond the window or the image";
    case MarkStatus::ambiguous:
      return std::string("several things look like a ") + wanted(search) + ", one of them at " +
             place(finding.u_px);
    case MarkStatus::not_converged:
      return std::string("what looks like it is no ") + std::string(name_of(search.kind)) +
             " at a closer look" +
             (finding.contrast > 0
                  ? std::string(": at ") + place(finding.u_px) + ", " + number(finding.diameter_px, 1) +
                        " px, contrast " + number(finding.contrast, 1) + ", " +
                        number(100 * finding.outline_share, 0) + " % of its outline could be used"
                  : std::string());
  }
  return {};
}

std::string_view name_of(MarkKind kind) {
  switch (kind) {
    case MarkKind::disc:
      return "disc";
    case MarkKind::ring:
      return "ring";
    case MarkKind::ball:
      return "ball";
    case MarkKind::slot:
      return "slot";
    case MarkKind::cross:
      return "cross";
    case MarkKind::corner:
      return "corner";
    case MarkKind::edge:
      return "edge";
    case MarkKind::pattern:
      return "pattern";
  }
  return "unknown";
}

std::string_view name_of(MarkStatus status) {
  switch (status) {
    case MarkStatus::not_searched:
      return "not_searched";
    case MarkStatus::found:
      return "found";
    case MarkStatus::outside_image:
      return "outside_image";
    case MarkStatus::no_candidate:
      return "no_candidate";
    case MarkStatus::too_small:
      return "too_small";
    case MarkStatus::low_contrast:
      return "low_contrast";
    case MarkStatus::blurred:
      return "blurred";
    case MarkStatus::saturated:
      return "saturated";
    case MarkStatus::cut_off:
      return "cut_off";
    case MarkStatus::ambiguous:
      return "ambiguous";
    case MarkStatus::not_converged:
      return "not_converged";
  }
  return "unknown";
}

}  // namespace zeropose
