// Bright lines of light in an image, with centres between the pixels (C. Steger, "An unbiased detector of
// curvilinear structures", PAMI 1998).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "measure/image.h"

namespace zeropose {

struct LightLineSearch {
  double sigma_px = 1.7;      // of the bell curve that a line's section is, blur of the lens included
  double min_contrast = 10;   // grey levels of a line over what is beside it
  double min_length_px = 10;  // of a piece
  double max_join_px = 45;    // a line goes on behind a gap so long
};

// Upright lines have one centre per image row, level ones one per column.
enum class LineCourse { upright, level };

struct LineCentre {
  double at = 0;        // row (upright) or column (level), px
  double place = 0;     // column (upright) or row (level) of the centre, px
  double sigma_px = 0;  // of place, from the image's noise and the line's contrast
};

struct LightLine {
  LineCourse course = LineCourse::upright;
  std::vector<LineCentre> centres;  // at rises; rows or columns without a centre are left out

  double from() const { return centres.front().at; }
  double to() const { return centres.back().at; }
  // Of the rows or columns between its ends.
  double share_seen() const { return static_cast<double>(centres.size()) / (to() - from() + 1); }
  // Between two centres straight; nothing beyond the ends.
  std::optional<double> place_at(double at) const;
  // How far the nearest centre is along the line.
  double unseen_px(double at) const;
};

// Centres of neighbouring rows (or columns) have errors in common, because the image is smoothed along the
// line too: a sum over many of them has this many times the variance of independent ones.
double neighbours_gain(const LightLineSearch& search);

struct LightLines {
  std::vector<LightLine> upright, level;  // in no order
};

// Precondition: the image is larger than 16 px both ways.
//
// The image is smoothed with a bell curve of sigma_px; a centre is where the slope across the line is 0, with
// a second derivative like that of a line of min_contrast and at least eight times its own noise. The line's
// direction decides its course. Pieces are chained from row to row and joined over gaps where they go
// straight on.
LightLines find_light_lines(const ImageView& image, const LightLineSearch& search);

}  // namespace zeropose
