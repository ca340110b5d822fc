// What in a window may be the mark: regions that look like it at several grey levels.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "measure/ellipse_fit.h"
#include "measure/grey_histogram.h"
#include "measure/mark_blobs.h"
#include "measure/marks.h"
#include "measure/search_image.h"

namespace zeropose {

// One thing in the window, seen at one or more levels.
struct MarkCandidate {
  EllipseStart start;
  double contrast = 0;  // positive: between mark and surroundings, median round the outline
};

struct CandidateSearch {
  std::vector<MarkCandidate> candidates;         // the highest contrast first
  MarkStatus reason = MarkStatus::no_candidate;  // when there are none: what came nearest to a mark
  bool crowded = false;                          // more things than could be kept apart
  double step_grey = 0;                          // widest: things of less contrast may have been overlooked
};

// At which grey levels to look first.
struct LevelPlan {
  double widest_step_grey = 18;
  int most_levels = 255;  // further apart where the range asks for more
};

// Looks at grey levels step by step through the range of a window.
class CandidateFinder {
 public:
  static constexpr double shift_share = 1.0 / 6;  // of the step: how far a level may give way to noise
  static constexpr double step_grey_by_step = 1 + 2 * shift_share;

  // Precondition: the window lies in the image.
  CandidateSearch first(const ImageView& image, const PixelWindow& window, const MarkSearch& search,
                        const LevelPlan& plan = {});

  // At half the step of the call before, in the same window; all that was seen up to then. Nothing when that
  // would be finer than makes sense.
  std::optional<CandidateSearch> finer(const ImageView& image, const MarkSearch& search);

  // As first() in the same window, without the light's falling off. Nothing when it does not fall off.
  std::optional<CandidateSearch> flattened(const ImageView& image, const MarkSearch& search,
                                           const LevelPlan& plan = {});

 private:
  struct Sighting {
    Eigen::Vector2d centre_px;
    Eigen::Matrix2d shape_px2;
    double major_px, minor_px;
    int level;
  };
  using Group = std::vector<Sighting>;

  CandidateSearch start(const ImageView& image, const MarkSearch& search, const LevelPlan& plan);
  CandidateSearch look(const ImageView& image, const MarkSearch& search, double first_level);
  void look_at_level(const MarkSearch& search, int level);
  void add(const Sighting& sighting);
  CandidateSearch judge(const ImageView& image, const MarkSearch& search);

  SearchImage reduced_;
  GreyHistogram histogram_;
  BlobFinder blobs_;
  std::vector<Group> groups_;
  MarkStatus reason_ = MarkStatus::no_candidate;
  double low_ = 0, high_ = 0, step_ = 0;
  bool crowded_ = false;
};

}  // namespace zeropose
