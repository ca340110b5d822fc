#include "measure/marks.h"

namespace zeropose {

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
