// Maximum-likelihood fit of a blurred ellipse to the pixels round its outline (spec 88, centre of a circular
// mark).
#pragma once

#include <Eigen/Core>

#include "measure/ellipse_band.h"
#include "measure/image.h"

namespace zeropose {

// Where the fit starts. The outline is (x - centre)^T shape^-1 (x - centre) = 1, px.
struct EllipseStart {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Identity();
  double mark_grey = 0, background_grey = 0;
  OutlineSectors hidden = 0;  // left out
  double band_px = 2.5;       // to both sides of the outline, more where the edge is blurred more
};

// How the edge's blur depends on the direction across it: sigma / (1 + c cos 2a + s sin 2a). Motion makes it
// so.
struct BlurShape {
  double c = 0, s = 0;
};

struct EllipseFit {
  bool converged = false;
  bool settled = false;  // the last step was small by itself, not by damping alone: else no measurement
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d shape_px2 = Eigen::Matrix2d::Zero();
  double mark_grey = 0, background_grey = 0;
  double blur_px = 0;                                        // sigma of the edge, mean over the directions
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();  // relative, about the centre
  double edge_rms = 0;                    // grey levels: residuals in the band across the outline
  double flat_rms = 0;                    // in the flat rings beside it that were taken; 0 if none was
  double edge_count = 0, flat_count = 0;  // pixels behind the two
  double outline_px = 0;                  // how far the outline is from the ellipse: rms over sixteen sectors
  double outline_noise_px = 0;            // what the noise alone makes of that
  double saturated_share = 0;             // of the band's pixels that stand at white
  int iterations = 0;
};

// Memory kept from one fit to the next to spare allocations. Holds no results.
struct EllipseWorkspace {
  EllipseBand band;
};

// Model: (1 + g . x) (M + (B - M) Phi(d / s)), d the distance to the outline (first order, exact on it), with
// ten unknowns: centre, shape (3), blur s, levels B and M, relative shading g (2). Pixels one by one within
// the band about the outline; beyond it up to two rings inside and
// three outside are taken as flat if they are. Covariance: inverse information times the residual variance,
// which is never taken below that of rounding. The blur's shape is taken as it is. Not converged: no minimum
// with a plausible outline near the start, or the band reaches beyond the image.
EllipseFit fit_ellipse(const ImageView& image, const EllipseStart& start, EllipseWorkspace& workspace,
                       const BlurShape& blur_shape = {});

}  // namespace zeropose
