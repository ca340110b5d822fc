// The uncertainty of a calibration as people read it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/calibration.h"

namespace zeropose {

struct ReportedUncertainty {
  std::vector<Parameter> parameters;
  Eigen::VectorXd sigma;  // in their order: px, coefficients without unit, mm, degrees
  Eigen::MatrixXd correlation;
};

// Of the parameters and the six numbers of X_WC, whose angles are those of spec 10 instead of a rotation
// about the world's axes. frame_offset_z_mm: of X_WC moved along the camera's z axis by so much (spec 30,
// exchange with systems that put the camera frame elsewhere): x y z then inherit the angles' uncertainty and
// appear even where they were held. At ry = +-90 deg, where rx and rz are one, the angles are about the
// world's axes.
ReportedUncertainty reported_uncertainty(const ParameterCovariance& uncertainty, const Pose& X_WC,
                                         double frame_offset_z_mm = 0);

// -1 where the parameter is not among them: held, or not estimated.
double sigma_of(const ReportedUncertainty& uncertainty, Parameter parameter);

// X_WC with the camera's frame moved along its z axis.
Pose with_frame_offset(const Pose& X_WC, double frame_offset_z_mm);

}  // namespace zeropose
