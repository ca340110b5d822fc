// What in a window may be the mark: regions that look like it at several grey levels.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "measure/ellipse_fit.h"
#include "measure/mark_blobs.h"
#include "measure/marks.h"

namespace zeropose {

// One thing in the window, seen at one or more levels.
struct MarkCandidate {
  EllipseStart start;
  double contrast = 0;  // positive: between mark and surroundings, median round the outline
};

struct CandidateSearch {
  std::vector<MarkCandidate> candidates;
  MarkStatus reason = MarkStatus::no_candidate;  // when there are none: what came nearest to a mark
};

class CandidateFinder {
 public:
  // Looks at grey levels step by step through the range of the window; a finer step only where the coarser
  // one found nothing. Precondition: the window lies in the image.
  CandidateSearch find(const ImageView& image, const PixelWindow& window, const MarkSearch& search);

 private:
  struct Sighting {
    Eigen::Vector2d centre_px;
    Eigen::Matrix2d shape_px2;
    double major_px, minor_px;
    int level;
  };
  using Group = std::vector<Sighting>;

  void look_at_level(const ImageView& image, const PixelWindow& window, const MarkSearch& search, int level);
  void add(const Sighting& sighting);
  CandidateSearch judge(const ImageView& image, const MarkSearch& search);

  BlobFinder blobs_;
  std::vector<Group> groups_;
  MarkStatus reason_ = MarkStatus::no_candidate;
};

}  // namespace zeropose
